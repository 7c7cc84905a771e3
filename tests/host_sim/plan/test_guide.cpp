// SPDX-License-Identifier: Apache-2.0
// A plan in a scene: what the tick makes of it.
#include <doctest/doctest.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/lab/planning/guided_scene.hpp"
#include "host_sim/lab/planning/hostile_hand.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_script.hpp"
#include "rt_core/base/rotation.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/tools/plan/plan_bench.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/plan/plan_check.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

std::filesystem::path peg_folder() {
  return std::filesystem::path(HAPTIC_SCENES_DIR) / "square_peg_five";
}

/// A device that the compiler derives gains from.
void add_device(SceneParameters& parameters) {
  DeviceParameters& device = parameters.device;
  device.given = 1;
  device.mass_kg = 0.1;
  device.damping_ns_per_m = 1.0;
  for (double& inertia : device.rotor_inertia_kg_m2) inertia = 1e-4;
  for (double& damping : device.rotor_damping_nms_per_rad) damping = 1e-3;
}

tools::SceneBytes guided_peg(const tools::Plan& plan, bool with_device = false) {
  tools::SceneFile scene = tools::read_scene_file(peg_folder() / "scene.toml");
  if (with_device) add_device(scene.parameters);
  return guided_scene(std::move(scene), plan);
}

struct GuidedPeg {
  PlannedScene plain{"square_peg_five"};
  tools::Plan plan = plan_to(plain.view, kPegGoal).plan;
  tools::SceneBytes guided = guided_peg(plan);
};

const GuidedPeg& guided_peg() {
  static const GuidedPeg the_one;
  return the_one;
}

bool same_bits(const Wrench& a, const Wrench& b) {
  return std::memcmp(a.force_w.data(), b.force_w.data(), 3 * sizeof(Real)) == 0 &&
         std::memcmp(a.torque_w.data(), b.torque_w.data(), 3 * sizeof(Real)) == 0;
}

Pose start_of(const SceneView& view) { return tools::pose_from_text(view, "start", "start"); }

void check_energy(std::uint64_t ticks) {
  const HostileRun run = run_hostile_hand(guided_peg().guided.span(), ticks, 11);
  MESSAGE("stated " << run.stated_j << " J, done at most " << run.most_j << " J, on in " << run.on
                    << " of " << run.ticks << " ticks");
  CHECK(run.on > run.ticks / 20);
  CHECK(run.most_j <= run.stated_j);
}

/// A light hand without a will of its own, which moves with what it feels.
void check_followed(std::uint64_t first_seed, std::uint64_t last_seed) {
  const SceneView& plain = guided_peg().plain.view;
  for (std::uint64_t seed = first_seed; seed <= last_seed; ++seed) {
    CAPTURE(seed);
    const tools::SceneBytes guided = guided_peg(plan_to(plain, kPegGoal, seed).plan);
    CoreSession session(guided.span(), "guided", GoalContact::kLeftOut);
    const SceneView& view = session.view();
    const GuideRecord& guide = *view.guide();
    Pose pose = start_of(view);
    std::uint64_t heap_calls = 0;
    StepResult result;
    Real most_n = 0;
    for (int k = 0; k < 20'000; ++k) {
      StepInput input;
      input.pose_wa = pose;
      {
        const haptic::test::RtGuard guard;
        result = session.core().step(input);
        heap_calls += guard.heap_calls();
      }
      const Wrench& w = result.guidance.wrench_w;
      most_n = std::max(most_n, w.force_w.norm());
      const Vec3 force = w.force_w + result.wrench_w.force_w;
      const Vec3 torque = w.torque_w + result.wrench_w.torque_w;
      const Vec3 grip = grip_place(view, pose) + 2e-5_r * force;
      pose.q_wa = (so3_exp(2e-5_r / 4e-4_r * torque) * pose.q_wa).normalized();
      pose.p_wa += grip - grip_place(view, pose);
    }
    CHECK(heap_calls == 0);
    CHECK(result.guidance.state == GuideState::kOn);
    CHECK(result.guidance.station + 2 >= view.guide_stations().size());
    CHECK(static_cast<double>(result.guidance.cost_m) < 1e-3);
    CHECK(static_cast<double>(most_n) <= guide.pull_n + guide.hold_n);
    MESSAGE("seed " << seed << ": station " << result.guidance.station << " of "
                    << view.guide_stations().size() << ", " << result.guidance.cost_m
                    << " m to go, at most " << most_n << " N");
  }
}

}  // namespace

TEST_SUITE("rt_core.guide") {
  TEST_CASE("guide: the compiler takes a proved plan, and refuses one of another scene") {
    SceneView view;
    REQUIRE(SceneView::open(guided_peg().guided.span(), view) == RtStatus::kOk);
    REQUIRE(view.guide() != nullptr);
    CHECK(view.guide_stations().size() == guided_peg().plan.stations.size());
    CHECK(guided_peg().plain.view.guide() == nullptr);
    CHECK(view.guide()->energy_j > 0);
    // The scene is the same geometry: its plan is proved in it, too.
    CHECK(tools::prove_plan(view, guided_peg().plan, "p").holds());

    tools::Plan wrong = guided_peg().plan;
    wrong.geometry ^= 1;
    CHECK_THROWS_AS((void)guided_peg(wrong), tools::InputError);
    wrong = guided_peg().plan;
    wrong.poses.back().x0_m[2] -= 0.01;
    CHECK_THROWS_AS((void)guided_peg(wrong), tools::InputError);
  }

  TEST_CASE("guide: a plan that leaves the scene's limits is refused by its pose and the key") {
    const tools::Plan& plan = guided_peg().plan;
    const auto refusal = [&](const auto& limit) {
      tools::SceneFile scene = tools::read_scene_file(peg_folder() / "scene.toml");
      limit(scene);
      try {
        (void)guided_scene(std::move(scene), plan);
      } catch (const tools::InputError& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    const double goal_z_m = plan.poses.back().x0_m[2];
    const auto deep = [&](double more_m) {
      return [=](tools::SceneFile& scene) {
        scene.workspace = tools::WorkspaceBox{{-1, -1, goal_z_m - more_m}, {1, 1, 1}};
      };
    };
    CHECK(refusal(deep(1e-4)) == "");
    const std::string low = refusal(deep(-1e-4));
    CAPTURE(low);
    CHECK(low.find("[guide] plan") != std::string::npos);
    CHECK(low.find("pose ") != std::string::npos);
    CHECK(low.find("[motion_limits] workspace min_m") != std::string::npos);
    const std::string turned = refusal([&](tools::SceneFile& scene) {
      // About the start's, from which the goal's is turned by 0.12 rad.
      scene.orientation =
          tools::OrientationEnvelope{{0.026816719, 0.053633438, 0, 0.998200540}, 0.05};
    });
    CAPTURE(turned);
    CHECK(turned.find("[motion_limits] orientation") != std::string::npos);
  }

  TEST_CASE("guide: gains that a device or a hand cannot follow are named") {
    const TemporaryFolder folder;
    write_whole_file(folder.file("guide.plan"), tools::plan_as_text(guided_peg().plan));
    const auto compiled = [&](double pull_n, double let_go_m) {
      tools::SceneFile scene = tools::read_scene_file(peg_folder() / "scene.toml");
      add_device(scene.parameters);
      scene.parameters.device.max_force_n = 3;
      scene.guide.emplace();
      scene.guide->plan = folder.file("guide.plan");
      scene.guide->pull_n = pull_n;
      scene.guide->let_go_m = let_go_m;
      std::string all;
      for (const std::string& note : tools::compile_scene(scene, {}).notes) all += note + "\n";
      return all;
    };
    CHECK(compiled(1.9, 0.01).find("max_force_n") == std::string::npos);
    CHECK(compiled(2.1, 0.01).find("more than [device] max_force_n, 3 N") != std::string::npos);
    CHECK_THROWS_WITH_AS((void)compiled(1, 1e-12), doctest::Contains("[guide] let_go_m is 1e-12 m"),
                         tools::InputError);
  }

  TEST_CASE("guide: a station that is not the compiler's own is refused") {
    const tools::SceneBytes& sound = guided_peg().guided;
    SceneView view;
    REQUIRE(SceneView::open(sound.span(), view) == RtStatus::kOk);
    const auto* const first = reinterpret_cast<const std::byte*>(view.guide_stations().data());
    const auto at = static_cast<std::size_t>(first - sound.span().data());
    const auto refused = [&](auto change) {
      tools::SceneBytes bytes(sound.span());
      auto* const stations = reinterpret_cast<GuideStation*>(bytes.span().data() + at);
      change(stations);
      auto* const header = reinterpret_cast<SceneHeader*>(bytes.span().data());
      header->content_hash = scene_content_hash(bytes.span());
      SceneView opened;
      return SceneView::open(bytes.span(), opened) != RtStatus::kOk;
    };
    CHECK_FALSE(refused([](GuideStation*) {}));
    CHECK(refused([](GuideStation* s) { s[1].cost_m = s[0].cost_m; }));
    CHECK(refused([](GuideStation* s) { s[1].x0_m[0] += 1e-6_r; }));
    CHECK(refused([](GuideStation* s) { s[1].per_square *= 1.1_r; }));
    CHECK(refused([](GuideStation* s) { s[1].q_wa_xyzw[0] += 0.1_r; }));
    CHECK(refused([](GuideStation* s) { s[1].clearance_m = -1; }));
    CHECK(refused([](GuideStation* s) { s[1].turn_way_m[1] += 1e-6_r; }));
  }

  TEST_CASE("guide: the contact wrench has the same bits with the guide on, off and absent") {
    CoreSession plain(guided_peg().plain.bytes.span(), "plain", GoalContact::kLeftOut);
    CoreSession on(guided_peg().guided.span(), "on", GoalContact::kLeftOut);
    CoreSession off(guided_peg().guided.span(), "off", GoalContact::kLeftOut);
    const MotionScript script = read_motion_script((peg_folder() / "insert.toml").string());
    std::uint64_t led = 0, contact = 0;
    std::uint64_t tick = 0;
    bool same = true, told = true;
    for (const MotionSample& sample : make_motion(script)) {
      StepInput input = input_of(sample, ++tick);
      const StepResult a = plain.core().step(input), b = on.core().step(input);
      input.guide_off = true;
      const StepResult c = off.core().step(input);
      same = same && same_bits(a.wrench_w, b.wrench_w) && same_bits(a.wrench_w, c.wrench_w) &&
             same_bits(a.spring_w, b.spring_w) && a.proxy_pose_wa.p_wa == b.proxy_pose_wa.p_wa &&
             a.flags == b.flags && a.flags == c.flags;
      told = told && a.guidance.state == GuideState::kNone && c.guidance.wrench_w.force_w.isZero(0);
      led += b.guidance.wrench_w.force_w.norm() > 0.1_r ? 1u : 0u;
      contact += a.situation != ContactSituation::kNone ? 1u : 0u;
    }
    CHECK(same);
    CHECK(told);
    CHECK(led > tick / 10);
    CHECK(contact > tick / 10);
    MESSAGE(tick << " ticks, led in " << led << ", contact in " << contact);
  }

  TEST_CASE(
      "guide: a hand that follows the force comes to the goal, and the force stays in its cap") {
    check_followed(1, 4);
  }
  TEST_CASE("[long] guide: a hand that follows the force comes to the goal with sixteen plans") {
    check_followed(5, 16);
  }

  TEST_CASE("guide: in the closed loop no hand or delay is less calm at rest than without") {
    // Half of the way in, then held there for a second.
    std::vector<MotionSample> motion =
        make_motion(read_motion_script((peg_folder() / "insert.toml").string()));
    motion.resize(motion.size() / 2);
    for (int k = 0; k < 1000; ++k) {
      motion.push_back(motion.back());
      motion.back().t_s += 1e-3;
    }
    tools::SceneFile without_guide = tools::read_scene_file(peg_folder() / "scene.toml");
    add_device(without_guide.parameters);
    CoreSession plain(tools::compile_scene(without_guide, {}).bytes, "plain",
                      GoalContact::kLeftOut);
    const tools::SceneBytes with_guide = guided_peg(guided_peg().plan, true);
    CoreSession guided(with_guide.span(), "guided", GoalContact::kLeftOut);
    for (const std::string& hand : hand_names()) {
      for (const std::uint32_t delay : {0u, 1u}) {
        CAPTURE(hand);
        CAPTURE(delay);
        DeviceModel device;
        device.delay_samples = delay;
        const auto rest = [&](CoreSession& session) {
          ClosedLoop loop(session, device, *hand_named(hand), 1000);
          return total(run_loop(loop, motion));
        };
        const LoopTotals without = rest(plain), with = rest(guided);
        MESSAGE("rest without " << without.rest_speed_m_per_s << " m/s, with "
                                << with.rest_speed_m_per_s << " m/s");
        CHECK(with.finite);
        CHECK((!with.runs_away() || without.runs_away()));
        CHECK(with.rest_speed_m_per_s <= 1.25 * without.rest_speed_m_per_s + 5e-4);
        CHECK(with.rest_turn_rad_per_s <= 1.25 * without.rest_turn_rad_per_s + 0.05);
      }
    }
  }

  TEST_CASE("guide: off the way it fades, lets go and takes up again at a station it can reach") {
    CoreSession session(guided_peg().guided.span(), "guided", GoalContact::kLeftOut);
    const SceneView& view = session.view();
    const auto step = [&](const Vec3& offset) {
      StepInput input;
      input.pose_wa = start_of(view);
      input.pose_wa.p_wa += offset;
      return session.core().step(input);
    };
    StepResult result;
    for (int k = 0; k < 400; ++k) result = step(Vec3::Zero());
    CHECK(result.guidance.state == GuideState::kOn);
    CHECK(result.guidance.wrench_w.force_w.norm() > 0.5_r);
    const Real far = 2 * static_cast<Real>(view.guide()->let_go_m);
    Real largest_step = 0;
    Vec3 last = result.guidance.wrench_w.force_w;
    for (int k = 0; k <= 1000; ++k) {
      result = step(Vec3(0, 0, far * static_cast<Real>(k) / 1000));
      largest_step = std::max(largest_step, (result.guidance.wrench_w.force_w - last).norm());
      last = result.guidance.wrench_w.force_w;
    }
    CHECK(result.guidance.state == GuideState::kLost);
    CHECK(result.guidance.wrench_w.force_w.isZero(0));
    CHECK(largest_step < 0.05_r);
    for (int k = 0; k < 400; ++k) result = step(Vec3::Zero());
    CHECK(result.guidance.state == GuideState::kOn);
  }

  TEST_CASE("guide: a switch ramps it out and in") {
    CoreSession session(guided_peg().guided.span(), "guided", GoalContact::kLeftOut);
    StepInput input;
    input.pose_wa = start_of(session.view());
    StepResult result;
    Vec3 last = Vec3::Zero();
    Real largest_step = 0;
    for (int k = 0; k < 1200; ++k) {
      input.guide_off = k >= 400 && k < 800;
      result = session.core().step(input);
      largest_step = std::max(largest_step, (result.guidance.wrench_w.force_w - last).norm());
      last = result.guidance.wrench_w.force_w;
      if (k == 399 || k == 1199) CHECK(last.norm() > 0.5_r);
      if (k == 799) CHECK(last.isZero(0));
    }
    CHECK(largest_step < 0.01_r);
  }

  TEST_CASE("guide: it does no more than the scene states, over 100 000 hostile ticks") {
    check_energy(100'000);
  }
  TEST_CASE("[long] guide: it does no more than the scene states, over 1 000 000 hostile ticks") {
    check_energy(1'000'000);
  }
}
