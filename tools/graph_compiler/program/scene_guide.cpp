// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_guide.hpp"

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/guide_tables.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/plan_limits.hpp"

namespace haptic::tools {
namespace {

/// The core holds the part inside the limits, and could not follow a plan that leaves them.
void require_within(const EnvelopeParameters& envelope, const Plan& plan,
                    const std::string& where) {
  const std::string left = PlanLimits(envelope).left_by(plan);
  if (left.empty()) return;
  throw InputError(where + ": " + left +
                   "; make the plan with host_sim plan from a scene with these limits, or widen "
                   "them");
}

/// No device lets a hand stay nearer to a way than this [m].
constexpr double kLeastLetGo_m = 1.0e-6;

void check_gains(const GuideRecord& g, const DeviceParameters& device, const std::string& where,
                 std::vector<std::string>& notes) {
  if (g.let_go_m < kLeastLetGo_m) {
    throw InputError(where + formatted("let_go_m is %.3g m: the guide would let go at once; give "
                                       "%.0e at least",
                                       g.let_go_m, kLeastLetGo_m));
  }
  if (device.given == 0 || !(device.max_force_n > 0) || g.pull_n + g.hold_n <= device.max_force_n)
    return;
  notes.push_back(
      formatted("warning: [guide] pull_n and hold_n are %.3g N together, more than "
                "[device] max_force_n, %.3g N: the hand cannot feel all of it; lower "
                "one of the two",
                g.pull_n + g.hold_n, device.max_force_n));
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
  require_within(scene.parameters().envelope, plan, file + ": [guide] plan " + name);
  GuideGains gains;
  gains.pull_n = guide.pull_n.value_or(gains.pull_n);
  gains.hold_n = guide.hold_n.value_or(gains.hold_n);
  gains.ramp_s = guide.ramp_s.value_or(gains.ramp_s);
  gains.let_go_m = guide.let_go_m.value_or(gains.let_go_m);
  GuideTables tables = guide_tables(scene, plan, gains);
  const GuideRecord& g = tables.record;
  check_gains(g, scene.parameters().device, file + ": [guide] ", notes);
  notes.push_back(
      formatted("guide: %zu stations over %.4g mm, %llu steps proved; at most %.3g N and "
                "%.3g J, off beyond %.3g mm",
                tables.stations.size(), 1e3 * plan.stations.front().cost_to_go_m,
                static_cast<unsigned long long>(proof.steps), g.pull_n + g.hold_n, g.energy_j,
                1e3 * g.let_go_m));
  return tables;
}

}  // namespace haptic::tools
