// SPDX-License-Identifier: Apache-2.0
// Energy: the work that the hand puts in round closed loops, and over a long random session.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/contact_case.hpp"
#include "host_sim/shapes/wander.hpp"

namespace haptic::sim {
namespace {

/// A loop may give back this much, which is what the trapezoidal rule leaves.
constexpr double kLeastLoopWork_j = -1e-8;
/// So far may the hand's work lie below the energy that the spring holds, as a share of the most
/// that it has held: what the tolerance of the planes lets the energy rise.
constexpr double kSessionShare = 1e-5;

constexpr const char* kEnergyColours[] = {"#d55e00", "#009e73"};
constexpr std::uint64_t kSessionSeed = 20260604;

struct LoopWork {
  std::string title;
  LawId law = LawId::kProxy;
  std::vector<double> ticks, work_j;  ///< per cycle
};

/// One law over the random session.
struct Session {
  LawId law = LawId::kProxy;
  std::vector<double> t_s, work_j, potential_j;
  double least_margin_j = 0;  ///< smallest of work against the spring less its energy
  double largest_potential_j = 0;
};

LoopWork loop_work(const ContactLoop& loop, LawId law, const StabilityOptions& options) {
  LoopWork result{loop.title, law, {}, {}};
  for (const double ticks :
       options.quick ? std::vector<double>{1000, 4000} : std::vector<double>{1000, 4000, 16000}) {
    const Trace trace = run_trace(loop.scene, law, loop.path_of(ticks));
    result.ticks.push_back(ticks);
    // The second time round: the first begins where the approach has left the proxy.
    result.work_j.push_back(hand_work_j(trace.path().last(static_cast<std::size_t>(ticks) + 1)));
  }
  return result;
}

/// Energy of the coupling with the device at one tick and the proxy of another.
double spring_j(const CoupledScene& scene, const PathPose& device, const PathPose& proxy) {
  const double turn_rad = device.q.angularDistance(proxy.q);
  return (scene.k_t_n_per_m * (device.p - proxy.p).squaredNorm() +
          scene.k_r_nm_per_rad * turn_rad * turn_rad) /
         2;
}

/// The box wanders over the five-piece plate, down onto it, round its rim and off it.
Session session(LawId law, double seconds) {
  CoupledScene scene;
  scene.moving = sample_box();
  scene.statics.push_back(sample_plate());
  Seeded random(kSessionSeed);
  Wander shape;
  shape.centre = {0.03, 0.02, kBoxHalf_m[2] - 0.003};
  shape.reach_m = {0.09, 0.09, 0.03};
  shape.turn_rad = 0.25;
  TimedPath path;
  path.pose = wander(shape, random);
  path.duration_s = seconds;
  path.retreat_w = {0, 0, 0.1};
  path.approach_s = 2;
  const Trace trace = run_trace(scene, law, path);
  Session result;
  result.law = law;
  result.least_margin_j = std::numeric_limits<double>::max();
  double work_j = 0, against_spring_j = 0;
  for (std::size_t k = 1; k < trace.ticks.size(); ++k) {
    // The device moves while the proxy stands, then the proxy moves: exact where the rule over the
    // wrench errs by the jump of a release times the device's step.
    const TraceTick &before = trace.ticks[k - 1], &now = trace.ticks[k];
    against_spring_j +=
        spring_j(scene, now.device, before.proxy) - spring_j(scene, before.device, before.proxy);
    work_j += hand_work_j(std::span(trace.ticks).subspan(k - 1, 2));
    const double potential_j = trace.ticks[k].potential_j;
    result.least_margin_j = std::min(result.least_margin_j, against_spring_j - potential_j);
    result.largest_potential_j = std::max(result.largest_potential_j, potential_j);
    result.t_s.push_back(static_cast<double>(k) * kTracePeriod_s);
    result.work_j.push_back(work_j);
    result.potential_j.push_back(potential_j);
  }
  return result;
}

std::string loops_csv(const std::vector<LoopWork>& loops) {
  ReportTable table("loop,law,ticks,work_j");
  for (const LoopWork& l : loops) {
    for (std::size_t k = 0; k < l.ticks.size(); ++k)
      table.add({l.title, law_name(l.law), std::lround(l.ticks[k]), l.work_j[k]});
  }
  return table.csv();
}

/// Every tenth tick of the session.
std::string session_csv(const std::vector<Session>& sessions) {
  ReportTable table("t_s,law,work_j,potential_j");
  for (const Session& s : sessions) {
    for (std::size_t k = 0; k < s.t_s.size(); k += 10)
      table.add({s.t_s[k], law_name(s.law), s.work_j[k], s.potential_j[k]});
  }
  return table.csv();
}

std::string loops_table(const std::vector<LoopWork>& loops) {
  std::string text = table_head({"loop", "law", "ticks", "work per cycle, J", "active"});
  for (const LoopWork& l : loops) {
    std::string ticks, work;
    for (std::size_t k = 0; k < l.ticks.size(); ++k) {
      ticks += (k > 0 ? " / " : "") + std::to_string(std::lround(l.ticks[k]));
      work += (k > 0 ? " / " : "") + short_number(l.work_j[k], 3);
    }
    const bool active = *std::ranges::min_element(l.work_j) < kLeastLoopWork_j;
    text += table_row({l.title, law_name(l.law), ticks, work, yes_or_no(active)});
  }
  return text;
}

std::string picture(const std::vector<Session>& sessions) {
  std::string svg = heading_at(90, 30, "Work of the hand over a random session (J)");
  double low = 0, high = 0;
  for (const Session& s : sessions) {
    low = std::min(low, *std::ranges::min_element(s.work_j));
    high = std::max(high, *std::ranges::max_element(s.work_j));
  }
  const double margin = 0.06 * std::max(high - low, 1e-9);
  const Panel panel{90, 50, 960, 420, 0, sessions.front().t_s.back(), low - margin, high + margin};
  svg += panel_frame(panel, "work (J)", true);
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    const Session& s = sessions[k];
    const char* colour = kEnergyColours[static_cast<std::size_t>(s.law) - 1];
    svg += curve(panel, s.t_s, s.work_j, colour, 1.6);
    const double x = 90 + 180 * static_cast<double>(k);
    svg += legend_entry(x, 516, colour, law_name(s.law));
  }
  svg += text_at(1050, 520, "time (s); what falls is given back to the hand", "end", 13);
  return svg_document(1090, 540, svg);
}

void add_findings(const std::vector<LoopWork>& loops, const std::vector<Session>& sessions,
                  PartReport& report) {
  const auto add = [&](const std::string& topic, const std::string& stated,
                       const std::string& found, bool holds) {
    report.passed = report.passed && holds;
    report.findings.push_back({topic, stated, found, yes_or_no(holds), ""});
  };
  for (const LoopWork& l : loops) {
    if (l.law != LawId::kProxy) continue;
    const double least = *std::ranges::min_element(l.work_j);
    add("proxy, work round a closed loop: " + l.title, "at least -1e-8 J",
        short_number(least, 3) + " J", least >= kLeastLoopWork_j);
  }
  for (const Session& s : sessions) {
    if (s.law != LawId::kProxy) continue;
    add("proxy, random session: work of the hand less the energy of the spring",
        "never below -0.001 % of the most it held",
        short_number(s.least_margin_j, 3) + " J of " + short_number(s.largest_potential_j, 3) +
            " J",
        s.least_margin_j >= -kSessionShare * s.largest_potential_j);
  }
}

}  // namespace

PartReport energy_part(const StabilityOptions& options) {
  std::vector<LoopWork> loops;
  for (const ContactLoop& loop : contact_loops()) {
    if (options.progress) std::fprintf(stderr, "  %s\n", loop.name.c_str());
    for (const LawId law : options.laws) loops.push_back(loop_work(loop, law, options));
  }
  const double seconds = options.quick ? 20 : 600;
  std::vector<Session> sessions;
  for (const LawId law : options.laws) sessions.push_back(session(law, seconds));

  PartReport report;
  report.title = "5. Energy";
  add_findings(loops, sessions, report);
  report.markdown =
      "Work that the hand puts in, by the trapezoidal rule, the second time round a loop on which "
      "the device turns and moves; k_t = k_F = 1000 N/m, no friction, no damping. Below -1e-8 J a "
      "loop gives energy to the hand each time round.\n\n" +
      loops_table(loops) + "\nA random session of " + fixed(seconds, 0) + " s (seed " +
      std::to_string(kSessionSeed) +
      "): a box wanders over the five-piece plate, onto it, round its rim and off.\n\n" +
      table_head({"law", "work in all, J", "least so far, J"});
  for (const Session& s : sessions) {
    report.markdown += table_row({law_name(s.law), short_number(s.work_j.back(), 3),
                                  short_number(*std::ranges::min_element(s.work_j), 3)});
  }
  report.markdown += "\n" + picture_line("energy.svg", "Work of the hand over the session");
  report.files = {{"energy.csv", loops_csv(loops)},
                  {"energy_session.csv", session_csv(sessions)},
                  {"energy.md", "# " + report.title + "\n\n" + report.markdown},
                  {"energy.svg", picture(sessions)}};
  return report;
}

}  // namespace haptic::sim
