// SPDX-License-Identifier: Apache-2.0
// Continuity: the largest change of force and torque per tick under each law, and by how much it
// falls when the ticks are half as long.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {
namespace {

/// Halved ticks must bring the largest step of the proxy down by this; a jump gives 1, a slope 2.
constexpr double kLeastHalving = 1.6;
/// Changes below these are what the tolerance of a plane may move: k_t tol, and that on a lever.
constexpr double kStill_n = 1e-4, kStill_nm = 1e-5;

constexpr const char* kLawColours[] = {"#d55e00", "#009e73"};

struct LawSteps {
  LawId law = LawId::kProxy;
  std::vector<WrenchSteps> by_period;  ///< longest period first
};

struct CaseSteps {
  ContactCase contact;
  std::vector<LawSteps> laws;
};

/// The paths on which the published law jumps, at their fine steps, one a tick.
ContactCase timed(const ContactPath& path, bool quick) {
  ContactCase result;
  result.name = path.name;
  result.title = path.title;
  result.scene.moving = united_body({&path.a, 1});
  result.scene.statics.push_back(united_body({&path.b, 1}));
  result.scene.k_t_n_per_m = kPathStiffness_n_per_m;
  result.scene.epsilon_m = kPathEpsilon_m;
  const double duration_s = kTracePeriod_s * path.fine_steps / (quick ? 4 : 1);
  const auto pose = path.pose;
  result.path.pose = [pose, duration_s](double t) { return pose(std::min(t / duration_s, 1.0)); };
  result.path.duration_s = duration_s;
  result.path.retreat_w = {0, 0, 0.02};
  // A vertex passes over an edge there, from one C-face to the next: the part slips by the depth
  // times the sine between the two.
  result.releases = path.name == "edge_rolling" || path.name == "general_motion";
  return result;
}

double ratio(double before, double after) { return after > 0 ? before / after : 0; }

bool falls(double before, double after, double still) {
  return after <= still || ratio(before, after) >= kLeastHalving;
}

/// Whether every halving brings both steps down, or they are still.
bool settles(const LawSteps& steps) {
  bool result = true;
  for (std::size_t k = 1; k < steps.by_period.size(); ++k) {
    const WrenchSteps &a = steps.by_period[k - 1], &b = steps.by_period[k];
    result = result && falls(a.force_n, b.force_n, kStill_n) &&
             falls(a.torque_nm, b.torque_nm, kStill_nm);
  }
  return result;
}

std::string csv_of(const std::vector<CaseSteps>& cases) {
  ReportTable table("case,law,period_s,force_step_n,torque_step_nm,force_ratio,torque_ratio");
  for (const CaseSteps& c : cases) {
    for (const LawSteps& l : c.laws) {
      for (std::size_t k = 0; k < l.by_period.size(); ++k) {
        const WrenchSteps& steps = l.by_period[k];
        const WrenchSteps before = k > 0 ? l.by_period[k - 1] : WrenchSteps{};
        table.add({c.contact.name, law_name(l.law), kTracePeriod_s / static_cast<double>(1u << k),
                   steps.force_n, steps.torque_nm, ratio(before.force_n, steps.force_n),
                   ratio(before.torque_nm, steps.torque_nm)});
      }
    }
  }
  return table.csv();
}

std::string table_of(const std::vector<CaseSteps>& cases) {
  std::string text = table_head({"path", "law", "force, N", "torque, mN m", "ratio, force",
                                 "ratio, torque", "falls with the tick"});
  for (const CaseSteps& c : cases) {
    for (const LawSteps& l : c.laws) {
      std::string force, torque;
      for (const WrenchSteps& steps : l.by_period) {
        force += (force.empty() ? "" : " / ") + short_number(steps.force_n, 3);
        torque += (torque.empty() ? "" : " / ") + short_number(1e3 * steps.torque_nm, 3);
      }
      const WrenchSteps &a = l.by_period[l.by_period.size() - 2], &b = l.by_period.back();
      text +=
          table_row({c.contact.title, law_name(l.law), force, torque,
                     b.force_n > kStill_n ? fixed(ratio(a.force_n, b.force_n), 2) : "still",
                     b.torque_nm > kStill_nm ? fixed(ratio(a.torque_nm, b.torque_nm), 2) : "still",
                     c.contact.releases ? "a release" : yes_or_no(settles(l))});
    }
  }
  return text;
}

/// One line of the picture per path: largest torque step, logarithmic; full marks at the longest
/// period, hollow ones at the shortest.
std::string picture(const std::vector<CaseSteps>& cases) {
  const double line = 26, top = 90;
  const double height = top + line * static_cast<double>(cases.size());
  SvgPage page(1100, height + 70, "Largest change of the torque in one tick");
  const Panel panel{380, top - 14, 680, height - top, -4, 3, 0, 1};
  for (int e = -4; e <= 3; ++e) {
    const double x = panel.x_of(e);
    page.line({x, panel.top}, {x, height - 10}, "#e4e4e4", 1);
    page.text(x, height + 10, short_number(std::pow(10, e), 3), "middle", 12);
  }
  page.text(1060, height + 30, "mN m", "end", 12);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double y = top + line * static_cast<double>(i);
    page.text(370, y + 4, cases[i].contact.title, "end", 12);
    for (const LawSteps& l : cases[i].laws) {
      const auto place = [&](const WrenchSteps& steps) -> Pixel {
        const double e = std::log10(std::max(1e3 * steps.torque_nm, 1e-30));
        return {panel.x_of(std::clamp(e, panel.t_low, panel.t_high)), y};
      };
      const char* colour = kLawColours[static_cast<std::size_t>(l.law) - 1];
      const Pixel coarse = place(l.by_period.front()), fine = place(l.by_period.back());
      page.line(fine, coarse, colour, 1.4);
      page.dot(coarse, 5, colour);
      page.dot(fine, 5, colour);
      page.dot(fine, 3, "#ffffff");
    }
  }
  const LawId laws[] = {LawId::kPaper, LawId::kProxy};
  for (std::size_t k = 0; k < 2; ++k) {
    const double x = 380 + 170 * static_cast<double>(k);
    page.dot({x, height + 46}, 5, kLawColours[k]);
    page.text(x + 12, height + 50, law_name(laws[k]), "start", 13);
  }
  page.text(890, height + 50, "hollow: shortest ticks", "start", 13);
  return page.finish();
}

void add_findings(const std::vector<CaseSteps>& cases, PartReport& report) {
  for (const CaseSteps& c : cases) {
    for (const LawSteps& l : c.laws) {
      if (l.law != LawId::kProxy || c.contact.releases) continue;
      const bool holds = settles(l);
      report.passed = report.passed && holds;
      const WrenchSteps &a = l.by_period[l.by_period.size() - 2], &b = l.by_period.back();
      report.findings.push_back({"proxy, " + c.contact.title + ": halved ticks",
                                 "steps fall by 1.6 or are still",
                                 "force " + fixed(ratio(a.force_n, b.force_n), 2) + ", torque " +
                                     fixed(ratio(a.torque_nm, b.torque_nm), 2),
                                 yes_or_no(holds), ""});
    }
  }
}

}  // namespace

PartReport continuity_part(const StabilityOptions& options) {
  std::vector<CaseSteps> cases;
  for (const ContactPath& path : contact_paths()) cases.push_back({timed(path, options.quick), {}});
  for (const ContactCase& contact : contact_cases()) cases.push_back({contact, {}});
  const unsigned halvings = options.quick ? 1 : 2;
  for (CaseSteps& c : cases) {
    if (options.progress) std::fprintf(stderr, "  %s\n", c.contact.name.c_str());
    for (const LawId law : options.laws) {
      LawSteps steps{law, {}};
      for (unsigned k = 0; k <= halvings; ++k) {
        const Trace trace = run_trace(c.contact.scene, law, c.contact.path,
                                      kTracePeriod_s / static_cast<double>(1u << k));
        steps.by_period.push_back(largest_steps(trace.path()));
      }
      c.laws.push_back(std::move(steps));
    }
  }
  PartReport report;
  report.title = "4. Continuity";
  add_findings(cases, report);
  report.markdown =
      "Largest change of the wrench from one tick to the next, 1 ms / " +
      std::string(options.quick ? "0.5 ms" : "0.5 ms / 0.25 ms") +
      " on the same paths of the device; k_t = k_F = 1000 N/m. Half as long ticks halve the steps "
      "of a law without jumps; a jump stays as it is. Below 1e-4 N (stiffness times the depth that "
      "counts as free) and 0.01 mN m a step counts as still. On the way over a convex edge of "
      "the C-obstacle the hold is really lost: such a step is a release, and its energy is let "
      "go.\n\n" +
      table_of(cases) + "\n" + picture_line("continuity.svg", "Largest torque step per path");
  report.files = {{"continuity.csv", csv_of(cases)},
                  {"continuity.md", "# " + report.title + "\n\n" + report.markdown},
                  {"continuity.svg", picture(cases)}};
  return report;
}

}  // namespace haptic::sim
