// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_guide.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/plan_check.hpp"

namespace haptic::tools {
namespace {

/// The pull fades over the last of the way, in lengths of a turn of 1 rad: there it is a spring, of
/// pull_n over so much.
constexpr double kNearGoal = 0.1;

GuideStation station_of(const Plan& plan, const PlanStation& from) {
  const PlanPose& pose = plan.poses[from.pose];
  GuideStation station{};
  double square = 0;
  for (const double q : pose.q_wxyz) square += q * q;
  for (std::size_t k = 0; k < 3; ++k) {
    station.x0_m[k] = static_cast<Real>(pose.x0_m[k]);
    station.q_wa_xyzw[k] = static_cast<Real>(pose.q_wxyz[k + 1] / std::sqrt(square));
  }
  station.q_wa_xyzw[3] = static_cast<Real>(pose.q_wxyz[0] / std::sqrt(square));
  station.cost_m = static_cast<Real>(from.cost_to_go_m);
  station.clearance_m = static_cast<Real>(std::max(from.clearance_m, 0.0));
  station.contacts = static_cast<std::uint32_t>(from.contacts.size());
  return station;
}

/// The way to the next station, from the numbers as they are stored.
void add_way(const GuideStation& next, double turn_m, GuideStation& station) {
  const auto at = [](const Real* v, int k) { return static_cast<double>(v[k]); };
  const Real *const q = station.q_wa_xyzw, *const r = next.q_wa_xyzw;
  double cosine = 0, square = 0;
  for (int k = 0; k < 4; ++k) cosine += at(q, k) * at(r, k);
  const double twice = cosine < 0 ? -2 * turn_m : 2 * turn_m;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double cross = at(r, i) * at(q, j) - at(r, j) * at(q, i);
    const double way = at(next.x0_m, k) - at(station.x0_m, k);
    const double turn = twice * (at(r, k) * at(q, 3) - at(q, k) * at(r, 3) - cross);
    station.way_m[k] = static_cast<Real>(way);
    station.turn_way_m[k] = static_cast<Real>(turn);
    square += way * way + turn * turn;
  }
  station.per_square = static_cast<Real>(1 / square);
}

}  // namespace

GuideTables make_guide(const SceneGuide& guide, const SceneView& scene, const std::string& file,
                       std::vector<std::string>& notes) {
  if (scene.parameters().law != LawId::kProxy) {
    throw InputError(file +
                     ": [guide] needs [rendering] law = \"proxy\": other laws have no felt "
                     "part that could be led");
  }
  const std::string name = guide.plan.string();
  const Plan plan = read_plan(name);
  const PlanProof proof = prove_plan(scene, plan, name);
  if (!proof.holds()) {
    throw InputError(name + ": the plan is not proved: " + proof.failure +
                     "; make it again with host_sim plan");
  }
  GuideTables tables;
  GuideRecord& g = tables.record;
  g.plan_geometry = plan.geometry;
  g.turn_m = plan.length_m;
  g.pull_n = guide.pull_n.value_or(kDefaultPull_n);
  g.hold_n = guide.hold_n.value_or(kDefaultHold_n);
  g.ramp_s = guide.ramp_s.value_or(kDefaultGuideRamp_s);
  g.let_go_m = guide.let_go_m.value_or(kDefaultLetGo * plan.length_m);
  g.near_goal_m = kNearGoal * plan.length_m;
  // The difference of its potential between the farthest place and the goal.
  g.energy_j = g.pull_n * plan.stations.front().cost_to_go_m + g.hold_n * g.let_go_m;
  for (const PlanStation& station : plan.stations) {
    tables.stations.push_back(station_of(plan, station));
  }
  for (std::size_t k = 0; k + 1 < tables.stations.size(); ++k) {
    add_way(tables.stations[k + 1], g.turn_m, tables.stations[k]);
  }
  notes.push_back(
      formatted("guide: %zu stations over %.4g mm, %llu steps proved; at most %.3g N and "
                "%.3g J, off beyond %.3g mm",
                tables.stations.size(), 1e3 * plan.stations.front().cost_to_go_m,
                static_cast<unsigned long long>(proof.steps), g.pull_n + g.hold_n, g.energy_j,
                1e3 * g.let_go_m));
  return tables;
}

}  // namespace haptic::tools
