// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_guide.hpp"

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/guide_tables.hpp"
#include "tools/plan/plan_check.hpp"

namespace haptic::tools {

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
  GuideGains gains;
  gains.pull_n = guide.pull_n.value_or(gains.pull_n);
  gains.hold_n = guide.hold_n.value_or(gains.hold_n);
  gains.ramp_s = guide.ramp_s.value_or(gains.ramp_s);
  gains.let_go_m = guide.let_go_m.value_or(gains.let_go_m);
  GuideTables tables = guide_tables(scene, plan, gains);
  const GuideRecord& g = tables.record;
  notes.push_back(
      formatted("guide: %zu stations over %.4g mm, %llu steps proved; at most %.3g N and "
                "%.3g J, off beyond %.3g mm",
                tables.stations.size(), 1e3 * plan.stations.front().cost_to_go_m,
                static_cast<unsigned long long>(proof.steps), g.pull_n + g.hold_n, g.energy_j,
                1e3 * g.let_go_m));
  return tables;
}

}  // namespace haptic::tools
