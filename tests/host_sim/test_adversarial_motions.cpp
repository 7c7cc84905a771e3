// SPDX-License-Identifier: Apache-2.0
// Motions that an adversarial search of the project's own scenes has found, kept so that the worst
// that was ever met is met again in every build: tests/golden/adversarial/SCENE/*.csv. What a tick
// may do is asked of it, no time.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/lab/wcet/adversarial_search.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/replay.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
namespace fs = std::filesystem;

namespace {

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> list;
  for (const auto& entry : fs::directory_iterator(folder)) list.push_back(entry.path());
  std::sort(list.begin(), list.end());
  return list;
}

std::vector<std::byte> compiled(const fs::path& scene) {
  const fs::path file = fs::path(HAPTIC_SCENES_DIR) / scene / "scene.toml";
  return tools::compile_scene(tools::read_scene_file(file), {}).bytes;
}

/// Of a scene of law kProxy: its spring.
struct Allowed {
  double k_n_per_m, damping_ns_per_m;
  Vec3 grip_a;

  explicit Allowed(const SceneView& view)
      : k_n_per_m(view.parameters().coupling.k_t_n_per_m),
        damping_ns_per_m(view.parameters().coupling.damping_ns_per_m) {
    for (int k = 0; k < 3; ++k) grip_a[k] = static_cast<Real>(view.bodies()[0].reference_m[k]);
  }
  [[nodiscard]] double between_m(const Pose& from, const Pose& to) const {
    const Vec3 d = (to.p_wa + to.q_wa * grip_a) - (from.p_wa + from.q_wa * grip_a);
    return static_cast<double>(d.norm());
  }
};

/// Ticks whose wrench a ramp, an anchor or passivity has a hand in: more than the law.
constexpr std::uint32_t kBeyondTheLaw =
    kFlagRecovery | kFlagSaturated | kFlagClutched | kFlagPassivity | kFlagRamping;

/// Forces of one motion: finite; never more than the spring's stretch; and from tick to tick no
/// more than the goal and the proxy's passes together can move.
void check_forces(CoreSession& session, const std::vector<MotionSample>& motion) {
  const Allowed allowed(session.view());
  REQUIRE(allowed.damping_ns_per_m == 0);
  constexpr double kRounding = sizeof(Real) == sizeof(float) ? 1e-3 : 1e-9;
  session.core().reset();
  StepResult before;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    CAPTURE(i);
    const StepResult now = session.core().step(input_of(motion[i], i));
    REQUIRE(now.status == RtStatus::kOk);
    REQUIRE(now.wrench_w.force_w.allFinite());
    REQUIRE(now.wrench_w.torque_w.allFinite());
    const double force_n = static_cast<double>(now.wrench_w.force_w.norm());
    const double stretch_m = allowed.between_m(now.goal_pose_wa, now.proxy_pose_wa);
    CHECK(force_n <= allowed.k_n_per_m * stretch_m + kRounding);
    CHECK(within_bounds(now.counters, session.view().header().capacity));
    if (i > 0 && ((now.flags | before.flags) & kBeyondTheLaw) == 0) {
      const double step_n =
          static_cast<double>((now.wrench_w.force_w - before.wrench_w.force_w).norm());
      const double goal_m = allowed.between_m(before.goal_pose_wa, now.goal_pose_wa);
      const double proxy_m = allowed.between_m(before.proxy_pose_wa, now.proxy_pose_wa);
      CHECK(step_n <= allowed.k_n_per_m * (goal_m + proxy_m) + kRounding);
    }
    before = now;
  }
}

void check_scene(const std::string& scene) {
  CAPTURE(scene);
  const std::vector<std::byte> bytes = compiled(scene);
  CoreSession session(bytes, scene);
  REQUIRE(session.view().parameters().law == LawId::kProxy);
  const fs::path folder = fs::path(HAPTIC_TEST_DIR) / "golden" / "adversarial" / scene;
  std::size_t contact = 0;
  ReplayOptions checked;
  checked.check = true;
  const std::vector<fs::path> files = sorted_entries(folder);
  REQUIRE(files.size() >= 4);
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    CAPTURE(name);
    const std::vector<MotionSample> motion = read_motion_csv(file.string());
    check_forces(session, motion);
    const ReplayResult first = replay(session, motion, checked);
    REQUIRE(first.check.has_value());
    // A tick that left pairs out says so; it may then take a free pair for touching, never the
    // other way round, and D_near is exact all the same.
    const auto left_out = static_cast<std::uint64_t>(std::ranges::count_if(
        first.ticks, [](const TickRecord& t) { return (t.flags & kFlagBudgetUsedUp) != 0; }));
    const CheckTotals& oracle = *first.check;
    CHECK(oracle.wrong_depth_pairs == 0);
    CHECK(oracle.missed_collision_pairs == 0);
    CHECK(oracle.wrong_verdict_ticks <= left_out);
    if (session.view().header().capacity.unproven == 0) CHECK(oracle.passed());
    CHECK(first.check->ticks == motion.size());
    const ReplayResult second = replay(session, motion, {});
    CHECK(second.ticks.back().state_hash == first.ticks.back().state_hash);
    contact += static_cast<std::size_t>(
        std::ranges::count_if(first.ticks, [](const TickRecord& t) { return t.d_near_m <= 0; }));
  }
  CHECK(contact > files.size());  // the cases are of contact
}

}  // namespace

TEST_SUITE("host_sim.adversarial_motions") {
  TEST_CASE("the paper's pair: within bounds, forces within the law, verdicts the oracle's") {
    check_scene("tetrahedron_on_box");
  }
  TEST_CASE("a peg and its hole: within bounds, forces within the law, verdicts the oracle's") {
    check_scene("square_peg_five");
  }
  TEST_CASE("pins over posts: within bounds, forces within the law, verdicts the oracle's") {
    check_scene("pin_field");
  }

  TEST_CASE("a force step was the proxy's doing: a contact ended and it caught up with the goal") {
    const std::vector<std::byte> bytes = compiled("square_peg_five");
    CoreSession session(bytes, "square_peg_five");
    AdversarialFinding finding;
    finding.goal = AdversarialGoal::kForceStep;
    finding.motion = read_motion_csv(
        HAPTIC_TEST_DIR "/golden/adversarial/square_peg_five/adversarial_force_step_seed1.csv");
    evaluate(session, finding.motion, finding);
    const double spring_alone_n = session.view().parameters().coupling.k_t_n_per_m *
                                  kAdversarialSpeed_m_per_s / session.view().parameters().rate_hz;
    CHECK(finding.value > 2 * spring_alone_n);
    CHECK(finding.cause.damping == 0);
    CHECK(finding.cause.proxy_m > 2 * finding.cause.goal_m);
  }
}
