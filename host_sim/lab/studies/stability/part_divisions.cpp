// SPDX-License-Identifier: Apache-2.0
// Divisions: the same paths in holes that are cut into convex pieces in different ways.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host_sim/lab/stability/division_comparison.hpp"
#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

/// Differences of ticks below this lie at the left edge of the picture.
constexpr int kLowestDecade = -16, kHighestDecade = 1;

struct Row {
  DivisionCase contact;
  DivisionComparison found;
};

const char* kind_name(DivisionContact contact) {
  return contact == DivisionContact::kFace     ? "faces"
         : contact == DivisionContact::kMixed  ? "mixed"
         : contact == DivisionContact::kJammed ? "jammed"
                                               : "release";
}

std::string csv_of(const std::vector<Row>& rows) {
  ReportTable table(
      "path,contact,division,ticks,tolerance_n,median_n,p99_n,largest_n,share_over_0.01_n,"
      "other_contact_share,worst_gap_m,pushed_ticks,contact_ticks,proxy_mean_n,paper_mean_n");
  for (const Row& row : rows) {
    for (const DivisionDifference& d : row.found.differences) {
      table.add({row.contact.name, kind_name(row.contact.contact), d.division, row.found.ticks,
                 row.found.tolerance_n, d.quantile_n(0.5), d.quantile_n(0.99), d.quantile_n(1),
                 d.share_over(kFeltDifference_n), d.other_contact_share, d.worst_gap_m,
                 row.found.pushed_ticks, row.found.contact_ticks, row.found.proxy_mean_n,
                 row.found.paper_mean_n});
    }
  }
  return table.csv();
}

std::string table_of(const std::vector<Row>& rows) {
  std::string text =
      table_head({"path", "contact", "division", "median, N", "p99, N", "largest, N", "over 0.01 N",
                  "other contact", "over 0.01 N, paper", "mean force, N", "paper"});
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < row.found.differences.size(); ++k) {
      const DivisionDifference& d = row.found.differences[k];
      const auto felt = [](const DivisionDifference& of) {
        return fixed(100 * of.share_over(kFeltDifference_n), 2) + " %";
      };
      text += table_row({row.contact.title, kind_name(row.contact.contact), d.division,
                         short_number(d.quantile_n(0.5), 2), short_number(d.quantile_n(0.99), 2),
                         short_number(d.quantile_n(1), 2), felt(d),
                         fixed(100 * d.other_contact_share, 2) + " %", felt(row.found.paper[k]),
                         fixed(row.found.proxy_mean_n, 3), fixed(row.found.paper_mean_n, 3)});
    }
  }
  return text;
}

/// One line per path and division from median to largest difference, with a mark at the 99th
/// percentile; a tick where k_t times the tolerance lies.
std::string picture(const std::vector<Row>& rows) {
  std::size_t lines = 0;
  for (const Row& row : rows) lines += row.found.differences.size();
  const double line = 22, top = 90, height = top + line * static_cast<double>(lines);
  SvgPage page(1100, height + 60, "Difference of the wrench between two divisions");
  const Panel panel{500, top - 14, 560, height - top, kLowestDecade, kHighestDecade, 0, 1};
  for (int e = kLowestDecade; e <= kHighestDecade; e += 3) {
    page.line({panel.x_of(e), panel.top}, {panel.x_of(e), height - 6}, "#e4e4e4", 1);
    page.text(panel.x_of(e), height + 10, short_number(std::pow(10, e), 2), "middle", 12);
  }
  page.text(1060, height + 30, "N; dot: median, ring: p99, bar: largest, black: k_t tol", "end",
            12);
  double y = top;
  for (const Row& row : rows) {
    for (const DivisionDifference& d : row.found.differences) {
      const auto place = [&](double value_n) -> Pixel {
        const double e = std::log10(std::max(value_n, 1e-30));
        return {panel.x_of(std::clamp(e, panel.t_low, panel.t_high)), y};
      };
      const bool face = row.contact.contact == DivisionContact::kFace;
      const char* colour = face ? kRegionColour : kLitColour;
      page.text(490, y + 4, row.contact.title + ": " + d.division, "end", 12);
      const Pixel most = place(d.quantile_n(1)), tolerance = place(row.found.tolerance_n);
      page.line(place(d.quantile_n(0.5)), most, colour, 1.6);
      page.line({most.x, y - 6}, {most.x, y + 6}, colour, 2);
      page.dot(place(d.quantile_n(0.5)), 4, colour);
      page.dot(place(d.quantile_n(0.99)), 5, colour);
      page.dot(place(d.quantile_n(0.99)), 3, "#ffffff");
      if (face) page.line({tolerance.x, y - 8}, {tolerance.x, y + 8}, "#000000", 1);
      y += line;
    }
  }
  return page.finish();
}

std::string stated(const Row& row) {
  const std::string tolerance = short_number(row.found.tolerance_n, 2) + " N";
  const std::string share =
      fixed(100 * most_felt_share(row.contact.contact), 1) + " % of ticks over 0.01 N";
  switch (row.contact.contact) {
    case DivisionContact::kFace:
      return tolerance + " in every tick";
    case DivisionContact::kMixed:
      return "p99 " + tolerance + ", " + share;
    case DivisionContact::kJammed:
      return "5 % of ticks beyond k_t tol + 2 sqrt(2 k_t tol F)";
    case DivisionContact::kRelease:
      break;
  }
  return share;
}

void add_findings(const std::vector<Row>& rows, PartReport& report) {
  const auto add = [&](const std::string& topic, const std::string& limit, const std::string& found,
                       bool holds) {
    report.passed = report.passed && holds;
    report.findings.push_back({topic, limit, found, yes_or_no(holds), ""});
  };
  for (const Row& row : rows) {
    for (const DivisionDifference& d : row.found.differences) {
      const std::string topic = "proxy, " + row.contact.title + ": " + d.division;
      const std::string found =
          "largest " + short_number(d.quantile_n(1), 2) + " N, p99 " +
          short_number(d.quantile_n(0.99), 2) +
          " N, over 0.01 N: " + fixed(100 * d.share_over(kFeltDifference_n), 2) +
          " %, other contact: " + fixed(100 * d.other_contact_share, 2) + " %";
      add(topic, stated(row), found, agrees(d, row.contact.contact, row.found.tolerance_n));
    }
    if (!row.contact.other_strength.empty()) continue;
    add("proxy, " + row.contact.title + ": mean force", "within 20 % of the paper's",
        fixed(row.found.proxy_mean_n, 3) + " N, paper " + fixed(row.found.paper_mean_n, 3) + " N",
        row.found.same_strength());
  }
}

/// Paths on which the mean force is not compared, and why.
std::string exceptions(const std::vector<Row>& rows) {
  std::string text;
  for (const Row& row : rows) {
    if (!row.contact.other_strength.empty())
      text += "- " + row.contact.title + ": " + row.contact.other_strength + "\n";
  }
  return text;
}

}  // namespace

PartReport divisions_part(const StabilityOptions& options) {
  std::vector<Row> rows;
  for (DivisionCase& contact : hole_division_cases()) {
    if (options.progress) std::fprintf(stderr, "  %s\n", contact.name.c_str());
    DivisionComparison found = compare_divisions(contact);
    rows.push_back({std::move(contact), std::move(found)});
  }
  PartReport report;
  report.title = "7. Divisions";
  add_findings(rows, report);
  report.markdown =
      "A square hole and an L-shaped pocket, each cut into convex pieces in three ways that share "
      "their planes; the same path of the device in each, law proxy, k_t 1000 N/m, k_r 0.5 N m. "
      "Difference of the wrench from that in the first division, tick by tick: sqrt(|dF|^2 + "
      "|dtau|^2 k_t / k_r). Contacts of faces may differ by k_t times the depth that counts as "
      "free. Where contacts of edges come and go, the way of the iteration decides which of two "
      "free configurations it reaches, and when a hold is lost: these are counted. A part pulled "
      "hard against edges that leave it a freedom has many configurations whose energies differ by "
      "less than the free depth times the force: there the wrench is determined to 2 sqrt(2 k_t "
      "tol F), and what differs by more rests on another contact. Beside it the "
      "mean force of both laws in the first division over the ticks in which both push and less "
      "than 45 degrees apart: it must agree "
      "within 20 %, except for these.\n\n" +
      exceptions(rows) + "\n" + table_of(rows) + "\n" +
      picture_line("divisions.svg", "Difference between divisions, by path");
  report.files = {{"divisions.csv", csv_of(rows)},
                  {"divisions.md", "# " + report.title + "\n\n" + report.markdown},
                  {"divisions.svg", picture(rows)}};
  return report;
}

}  // namespace haptic::sim
