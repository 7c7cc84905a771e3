// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/stability_report.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "host_sim/lab/stability/extreme_scene.hpp"
#include "host_sim/lab/stability/pressed_contact.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint64_t kSeed = 0x33a7;
constexpr const char* kScalar = HAPTIC_REAL_IS_FLOAT ? "float" : "double";
/// Errors below this are drawn at it.
constexpr double kPictureFloor = 1e-21;

struct DepthRow {
  ExtremeScene scene;
  DepthErrors errors;
  [[nodiscard]] bool ok() const {
    return scene.refused ? !errors.refusal.empty()
                         : errors.refusal.empty() && errors.failures() == 0;
  }
};

struct PressRow {
  PressedContact contact;
  PressErrors errors;
};

std::vector<DepthRow> depth_rows(bool quick) {
  std::vector<DepthRow> rows;
  for (ExtremeScene& scene : extreme_scenes(quick)) {
    const std::uint32_t poses = scene.a.vertices.size() > 60 ? 100 : 400;
    DepthErrors errors = measure_depth(scene, quick ? poses / 20 : poses, kSeed);
    rows.push_back({std::move(scene), std::move(errors)});
  }
  return rows;
}

std::vector<PressRow> press_rows(bool quick) {
  std::vector<PressRow> rows;
  for (const PressedContact& contact : pressed_contacts(quick)) {
    for (const LawId law : {LawId::kProxy, LawId::kPaper}) {
      // Where faces are a hair from parallel, the paper's contact is a vertex or a face by
      // rounding.
      if (law == LawId::kPaper && contact.tilt_rad > 0) continue;
      rows.push_back({contact, press(contact, law)});
    }
  }
  return rows;
}

std::string depth_csv(const std::vector<DepthRow>& rows) {
  ReportTable table(
      "scalar,family,parameter,unit,size_m,poses,wrong_verdicts,wrong_depths,wrong_normals,"
      "refused_poses,limit_m,depth_error_m,normal_shortfall_m,normal_angle_rad,refusal");
  for (const DepthRow& row : rows) {
    const DepthErrors& e = row.errors;
    table.add({kScalar, row.scene.family, row.scene.parameter, row.scene.unit, row.scene.size_m,
               e.poses, e.wrong_verdicts, e.wrong_depths, e.wrong_normals, e.refused_poses,
               e.limit_m, e.depth_error_m, e.normal_shortfall_m, e.normal_angle_rad,
               quoted(e.refusal)});
  }
  return table.csv();
}

std::string press_csv(const std::vector<PressRow>& rows) {
  ReportTable table(
      "scalar,family,parameter,unit,size_m,contact,law,force_n,force_error_n,force_limit_n,"
      "torque_error_nm,torque_limit_nm,gap_m,tolerance_m,bad_ticks,holds");
  for (const PressRow& row : rows) {
    const ExtremeScene& scene = row.contact.scene;
    const PressErrors& e = row.errors;
    table.add({kScalar, scene.family, scene.parameter, scene.unit, scene.size_m,
               to_text(row.contact.kind), law_name(e.law), e.force_n, e.force_error_n,
               e.force_limit_n, e.torque_error_nm, e.torque_limit_nm, e.gap_m, e.tolerance_m,
               e.bad_ticks, yes_or_no(e.ok())});
  }
  return table.csv();
}

/// One line per family: what was driven how far, and the worst of it.
std::string depth_table(const std::vector<DepthRow>& rows) {
  std::string text = table_head({"family", "from", "to", "unit", "poses", "failed", "depth error",
                                 "normal's loss", "limit", "normal's angle"});
  std::map<std::string, std::vector<const DepthRow*>> families;
  std::vector<std::string> order;
  for (const DepthRow& row : rows) {
    if (row.scene.refused) continue;
    if (families[row.scene.family].empty()) order.push_back(row.scene.family);
    families[row.scene.family].push_back(&row);
  }
  for (const std::string& family : order) {
    const auto& list = families[family];
    std::uint32_t poses = 0, failed = 0;
    double depth = 0, loss = 0, limit = 0, angle = 0;
    for (const DepthRow* row : list) {
      const DepthErrors& e = row->errors;
      const double size_m = row->scene.size_m;
      poses += e.poses;
      failed += e.failures() + (e.refusal.empty() ? 0u : 1u);
      depth = std::max(depth, e.depth_error_m / size_m);
      loss = std::max(loss, e.normal_shortfall_m / size_m);
      limit = std::max(limit, e.limit_m / size_m);
      angle = std::max(angle, e.normal_angle_rad);
    }
    text += table_row({family, short_number(list.front()->scene.parameter, 2),
                       short_number(list.back()->scene.parameter, 2), list.front()->scene.unit,
                       std::to_string(poses), std::to_string(failed), short_number(depth, 2),
                       short_number(loss, 2), short_number(limit, 2), short_number(angle, 2)});
  }
  return text;
}

std::string press_table(const std::vector<PressRow>& rows) {
  std::string text =
      table_head({"family", "parameter", "contact", "law", "force, N", "force error", "of limit",
                  "torque error", "of limit", "gap / tolerance", "holds"});
  for (const PressRow& row : rows) {
    const PressErrors& e = row.errors;
    if (!e.refusal.empty()) {
      text += table_row({row.contact.scene.family, short_number(row.contact.scene.parameter, 2),
                         to_text(row.contact.kind), law_name(e.law), "-", "-", "-", "-", "-", "-",
                         e.must_be_refused ? "refused" : "REFUSED"});
      continue;
    }
    text += table_row({row.contact.scene.family, short_number(row.contact.scene.parameter, 2),
                       to_text(row.contact.kind), law_name(e.law), short_number(e.force_n, 2),
                       short_number(e.force_error_n / e.force_n, 2),
                       short_number(e.force_error_n / e.force_limit_n, 2),
                       short_number(e.torque_error_nm / (e.force_n * row.contact.scene.size_m), 2),
                       short_number(e.torque_error_nm / e.torque_limit_nm, 2),
                       e.law == LawId::kProxy ? short_number(e.gap_m / e.tolerance_m, 2) : "-",
                       yes_or_no(e.ok())});
  }
  return text;
}

std::string refusal_table(const std::vector<DepthRow>& rows, const std::vector<PressRow>& presses) {
  std::string text = table_head({"family", "parameter", "what the writer says"});
  for (const DepthRow& row : rows) {
    if (!row.scene.refused) continue;
    text += table_row({row.scene.family, short_number(row.scene.parameter, 2),
                       row.errors.refusal.empty() ? "NOT refused" : row.errors.refusal});
  }
  for (const PressRow& row : presses) {
    if (!row.errors.must_be_refused) continue;
    text += table_row({row.contact.scene.family, short_number(row.contact.scene.parameter, 2),
                       row.errors.refusal.empty() ? "NOT refused" : row.errors.refusal});
  }
  return text;
}

struct Curve {
  const char* family;
  const char* colour;
};

/// Errors of the depth in sizes over the parameter of each family, in three panels.
std::string depth_panels(const std::vector<DepthRow>& rows) {
  struct Frame {
    const char* title;
    const char* x_label;
    double x_low, x_high;
    std::vector<Curve> curves;
  };
  const std::vector<Frame> frames = {
      {"size, offset", "m", 1e-6, 1e4, {{"size", "#d55e00"}, {"offset", "#0072b2"}}},
      {"aspect", "length / width", 1e1, 1e6, {{"needle", "#d55e00"}, {"plate", "#0072b2"}}},
      {"from parallel",
       "angle (rad)",
       1e-16,
       1e-2,
       {{"parallel_faces", "#d55e00"},
        {"parallel_edges", "#0072b2"},
        {"parallel_all", "#009e73"}}}};
  std::string svg = heading_at(70, 28, std::string("Error of D_near in sizes, ") + kScalar);
  double left = 80;
  for (const Frame& frame : frames) {
    const LogPanel panel{left, 70, 300, 280, frame.x_low, frame.x_high, kPictureFloor, 1e-2};
    const std::string y_label = left < 100 ? "error / size" : "";
    svg += log_panel_frame(panel, frame.title, frame.x_label, y_label, 3);
    double y = 412;
    for (const Curve& c : frame.curves) {
      std::vector<Pixel> error, limit;
      for (const DepthRow& row : rows) {
        if (row.scene.family != c.family) continue;
        const double x = panel.x_of(row.scene.parameter);
        error.push_back({x, panel.y_of(row.errors.depth_error_m / row.scene.size_m)});
        limit.push_back({x, panel.y_of(row.errors.limit_m / row.scene.size_m)});
      }
      svg += polyline_of(error, c.colour, 2.2) + polyline_of(limit, c.colour, 1.2, "5 4");
      svg += legend_entry(left, y - 4, c.colour, c.family);
      y += 18;
    }
    left += 350;
  }
  return svg;
}

/// Errors of the force of a pressed contact over its size.
std::string press_panel(const std::vector<PressRow>& presses) {
  std::string svg =
      text_at(80, 486, "Force of a pressed contact, error / force, over its size; law proxy",
              "start", 18, "font-weight=\"bold\"");
  const LogPanel panel{80, 530, 650, 260, 1e-6, 1e3, 1e-18, 1e-1};
  svg += log_panel_frame(panel, "", "size (m)", "error / force", 3);
  constexpr const char* kKindColours[] = {"#d55e00", "#0072b2", "#009e73"};
  for (const PressKind kind : {PressKind::kFace, PressKind::kVertex, PressKind::kEdges}) {
    const char* colour = kKindColours[static_cast<std::size_t>(kind)];
    std::vector<Pixel> error, limit;
    for (const PressRow& row : presses) {
      const PressErrors& e = row.errors;
      if (row.contact.scene.family != "size" || row.contact.kind != kind ||
          e.law != LawId::kProxy || !e.refusal.empty())
        continue;
      const double x = panel.x_of(row.contact.scene.size_m);
      error.push_back({x, panel.y_of(e.force_error_n / e.force_n)});
      limit.push_back({x, panel.y_of(e.force_limit_n / e.force_n)});
    }
    svg += polyline_of(error, colour, 2.2) + polyline_of(limit, colour, 1.2, "5 4");
    const double y = 560 + 20 * static_cast<double>(kind);
    svg += legend_entry(750, y - 4, colour, to_text(kind));
  }
  return svg + text_at(750, 630, "dashed: limits", "start", 13);
}

void add_findings(const std::vector<DepthRow>& rows, const std::vector<PressRow>& presses,
                  PartReport& report) {
  std::uint32_t poses = 0, failed = 0, refused = 0, expected = 0;
  for (const DepthRow& row : rows) {
    poses += row.errors.poses;
    failed += row.scene.refused || row.ok() ? 0u : std::max(1u, row.errors.failures());
    expected += row.scene.refused ? 1u : 0u;
    refused += row.scene.refused && row.ok() ? 1u : 0u;
    report.passed = report.passed && row.ok();
  }
  std::uint32_t wrong = 0;
  for (const PressRow& row : presses) {
    expected += row.errors.must_be_refused ? 1u : 0u;
    refused += row.errors.must_be_refused && row.errors.ok() ? 1u : 0u;
    wrong += row.errors.ok() ? 0u : 1u;
    report.passed = report.passed && row.errors.ok();
  }
  const std::string in_scalar = std::string(", ") + kScalar;
  report.findings.push_back({"extreme geometry: verdict, depth, normal" + in_scalar, "0 failures",
                             std::to_string(failed) + " of " + std::to_string(poses) + " poses",
                             yes_or_no(failed == 0), "limits: 3. Extreme geometry"});
  report.findings.push_back({"extreme geometry: wrench of a pressed contact" + in_scalar,
                             "0 failures",
                             std::to_string(wrong) + " of " + std::to_string(presses.size()),
                             yes_or_no(wrong == 0), "closed forms"});
  report.findings.push_back({"extreme geometry: what is not served is refused" + in_scalar,
                             std::to_string(expected), std::to_string(refused),
                             yes_or_no(refused == expected), "message in the section"});
}

std::string words() {
  return std::string("One build has one scalar; this one's is ") + kScalar +
         ". Depth and normal are compared with a search over every basic contact in long double, "
         "each pose a jump from the one before, depths from a tenth of the size inside to a tenth "
         "outside. Limit: " +
         (HAPTIC_REAL_IS_FLOAT ? "1e-5" : "1e-12") +
         " of the size and eight roundings of the coordinates. A normal fails when the depth along "
         "it misses the best by more than the limit; its angle to the nearest normal that attains "
         "D_near is listed. Errors and limits in sizes.\n\n";
}

}  // namespace

PartReport extreme_part(bool quick) {
  const std::vector<DepthRow> rows = depth_rows(quick);
  const std::vector<PressRow> presses = press_rows(quick);
  PartReport report;
  report.title = "3. Extreme geometry";
  add_findings(rows, presses, report);
  report.markdown =
      words() + depth_table(rows) +
      "\nA contact pressed by a fiftieth of the size, k_t 1000 N/m, after coming down and resting; "
      "force error in forces, torque error in force times size. Law proxy against the minimum of "
      "its spring under the contact, law paper against its equations (1)-(3). Limit: k_t times "
      "twice the move that a proxy at rest leaves out (paper: the limit of D_near), and eight "
      "roundings of the coordinates.\n\n" +
      press_table(presses) + "\nRefused:\n\n" + refusal_table(rows, presses) + "\n" +
      picture_line("extreme.svg", "Errors at extreme sizes, aspects and angles");
  report.files = {
      {"extreme.csv", depth_csv(rows)},
      {"extreme_press.csv", press_csv(presses)},
      {"extreme.md", "# " + report.title + "\n\n" + report.markdown},
      {"extreme.svg", svg_document(1140, 850, depth_panels(rows) + press_panel(presses))}};
  return report;
}

}  // namespace haptic::sim
