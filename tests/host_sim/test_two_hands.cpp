// SPDX-License-Identifier: Apache-2.0
/// Two hands with a part each, in one law: what one feels of the other is minus what that feels; a
/// hand that is away holds its part still.

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "rt_core/base/rotation.hpp"
#include "rt_core/two_hand_tick.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using haptic::test::has;

namespace {

constexpr bool kSingle = HAPTIC_REAL_IS_FLOAT != 0;
constexpr double kBalance_n = kSingle ? 1e-4 : 1e-9;

std::vector<std::byte> two_hand_scene(const std::string& text) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "haptic_test_two_hands.toml";
  std::ofstream(path) << text;
  std::vector<std::byte> bytes = tools::compile_scene(tools::read_scene_file(path), {}).bytes;
  std::filesystem::remove(path);
  return bytes;
}

const char* const kRendering = "[rendering]\nk_f_n_per_m = 1000\n[coupling]\nk_t_n_per_m = 1000\n";

/// A block in each hand, 40 mm apart, and nothing else; or a table 0.1 m below.
std::vector<std::byte> two_blocks(bool with_table) {
  std::string text =
      "format = 1\nname = \"blocks\"\n"
      "[[part]]\nname = \"left\"\nrole = \"hand\"\nshape = \"box\"\n"
      "size_m = [0.04, 0.04, 0.03]\nposition_m = [-0.04, 0, 0]\n"
      "[[part]]\nname = \"right\"\nrole = \"hand2\"\nshape = \"box\"\n"
      "size_m = [0.04, 0.06, 0.05]\nposition_m = [0.04, 0, 0]\n";
  if (with_table)
    text +=
        "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\n"
        "size_m = [0.4, 0.4, 0.02]\nposition_m = [0, 0, -0.1]\n";
  return two_hand_scene(text + kRendering);
}

/// A round peg in one hand over a tube with a bottom in the other; 0.3 mm clearance.
std::vector<std::byte> peg_and_socket() {
  return two_hand_scene(
      std::string("format = 1\nname = \"bimanual\"\n"
                  "[[part]]\nname = \"peg\"\nrole = \"hand\"\nshape = \"cylinder\"\n"
                  "radius_m = 0.01\nheight_m = 0.05\nsegments = 24\nposition_m = [0, 0, 0.05]\n"
                  "[[part]]\nname = \"socket\"\nrole = \"hand2\"\nshape = \"tube\"\n"
                  "inner_radius_m = 0.0103\nouter_radius_m = 0.02\nheight_m = 0.03\n"
                  "segments = 24\nposition_m = [0, 0, -0.02]\n"
                  "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\n"
                  "size_m = [0.4, 0.4, 0.02]\nposition_m = [0, 0, -0.2]\n") +
      kRendering);
}

/// Both hands, tick by tick.
class HandsBench {
 public:
  explicit HandsBench(const std::vector<std::byte>& scene) : session_(scene, "the bench's scene") {
    REQUIRE(session_.hands() != nullptr);
    REQUIRE(session_.hands()->count() == 2);
    for (std::uint32_t k = 0; k < 2; ++k) device[k] = pose_of(session_.parts()->start_of(k));
    ticks(2);  // the handles are where the parts are
  }

  [[nodiscard]] Hands& hands() { return *session_.hands(); }
  void tick() {
    ticks_ += 1;
    std::array<StepInput, 2> inputs;
    Hands::Each<const StepInput*> given{};
    for (std::size_t k = 0; k < 2; ++k) {
      inputs[k].sequence = ticks_;
      inputs[k].stamp_ns = static_cast<std::int64_t>(ticks_) * 1'000'000;
      inputs[k].pose_wa = device[k];
      if (!is_away[k]) given[k] = &inputs[k];
    }
    const Hands::Each<StepResult> results = hands().step(given);
    for (std::size_t k = 0; k < 2; ++k)
      if (!is_away[k]) last[k] = results[k];
  }
  void ticks(int count) {
    for (int k = 0; k < count; ++k) tick();
  }
  [[nodiscard]] double force_n(std::size_t hand, int axis) const {
    return static_cast<double>(last[hand].wrench_w.force_w[axis]);
  }
  [[nodiscard]] double felt_m(std::size_t hand, int axis) const {
    return static_cast<double>(last[hand].proxy_pose_wa.p_wa[axis]);
  }
  /// Sum of the contacts on both parts: what comes from neither.
  [[nodiscard]] double left_n() {
    const Vec3 sum = hands().contact_w(0).force_w + hands().contact_w(1).force_w;
    return static_cast<double>(std::sqrt(sum.squaredNorm()));
  }
  /// Sum of the torques of the contacts on both, about W.
  [[nodiscard]] double left_nm() {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t k = 0; k < 2; ++k) {
      const Wrench& on = hands().contact_w(k);
      const Pose& felt = last[k].proxy_pose_wa;
      const Vec3 grip_w = felt.p_wa + felt.q_wa * hands().hand(k).grip_a();
      sum += on.torque_w + grip_w.cross(on.force_w);
    }
    return static_cast<double>(std::sqrt(sum.squaredNorm()));
  }
  [[nodiscard]] bool is_bounded() {
    return within_bounds(hands().hand(0).core().peaks(), hands().bounds()) &&
           within_bounds(hands().hand(1).core().peaks(), hands().bounds());
  }

  std::array<Pose, 2> device;
  std::array<StepResult, 2> last;
  std::array<bool, 2> is_away{};

 private:
  CoreSession session_;
  std::uint64_t ticks_ = 0;
};

}  // namespace

TEST_SUITE("host_sim.two_hands") {
  TEST_CASE("two hands that press feel the same, against each other") {
    for (const bool with_table : {true, false}) {
      CAPTURE(with_table);
      HandsBench bench(two_blocks(with_table));
      // 40 mm apart; each comes 25 mm, and so far is left to the springs.
      for (int k = 0; k < 500; ++k) {
        bench.device[0].p_wa[0] += 50e-6_r;
        bench.device[1].p_wa[0] -= 50e-6_r;
        bench.tick();
        CHECK(bench.left_n() <= kBalance_n);
      }
      bench.ticks(100);
      CHECK(bench.force_n(0, 0) == doctest::Approx(-5.0).epsilon(1e-3));
      CHECK(bench.force_n(1, 0) == doctest::Approx(5.0).epsilon(1e-3));
      CHECK(std::abs(bench.felt_m(0, 0) + 0.02) < 1e-6);
      CHECK(std::abs(bench.felt_m(1, 0) - 0.02) < 1e-6);
      CHECK(bench.last[0].situation == ContactSituation::kFaceFace);
      CHECK(bench.last[1].situation == ContactSituation::kFaceFace);
      CHECK(bench.is_bounded());
      // One pulls back: the other follows it to where its own hand is.
      for (int k = 0; k < 600; ++k) {
        bench.device[1].p_wa[0] += 50e-6_r;
        bench.tick();
      }
      bench.ticks(100);
      CHECK(bench.force_n(0, 0) == doctest::Approx(0));
      CHECK(bench.felt_m(0, 0) == doctest::Approx(-0.015));
    }
  }

  TEST_CASE("a peg in one hand goes into the socket in the other") {
    HandsBench bench(peg_and_socket());
    double largest_n = 0, left_n = 0;
    int touching = 0;
    // The peg comes down and the socket up, both off their axis and tilted by a little.
    for (int k = 0; k < 4000; ++k) {
      const Real t = 1e-3_r * static_cast<Real>(k);
      const Real way_m = std::min(0.01_r * t, 0.03_r);
      const Real wobble = std::sin(6 * t);
      bench.device[0].p_wa = {0.0006_r * wobble, 0, 0.05_r - way_m};
      bench.device[0].q_wa = so3_exp({0.01_r * std::sin(4 * t), 0, 0});
      bench.device[1].p_wa = {0, 0.0005_r * std::sin(5 * t), -0.02_r + way_m};
      bench.device[1].q_wa = so3_exp({0, 0.01_r * wobble, 0.02_r * t});
      bench.tick();
      REQUIRE(bench.last[0].status == RtStatus::kOk);
      touching += bench.last[0].situation != ContactSituation::kNone ? 1 : 0;
      left_n = std::max(left_n, bench.left_n());
      largest_n = std::max(largest_n, std::abs(bench.force_n(0, 0)));
    }
    MESSAGE("touching ", touching, ", largest ", largest_n, " N across, left ", left_n, " N");
    CHECK(touching > 500);
    CHECK(largest_n > 0.05);
    CHECK(left_n <= kBalance_n);
    // Torques are of the poses before a step; at rest they balance.
    bench.ticks(300);
    CHECK(bench.left_nm() <= kBalance_n);
    // Inside: the peg's lower end is 15 mm or more below the rim of the socket.
    CHECK(bench.felt_m(0, 2) - bench.felt_m(1, 2) < 0.02);
    CHECK(bench.is_bounded());
  }

  TEST_CASE("a hand that is away holds its part still, and gives way") {
    HandsBench bench(two_blocks(true));
    bench.tick();
    bench.is_away[1] = true;
    for (int k = 0; k < 1000; ++k) {
      bench.device[0].p_wa[0] += 50e-6_r;
      bench.tick();
      CHECK(bench.left_n() <= kBalance_n);
    }
    bench.ticks(100);
    // 50 mm of way, 40 of them free: the two springs, alike, share the rest.
    CHECK(bench.force_n(0, 0) == doctest::Approx(-5.0).epsilon(1e-3));
    CHECK(std::abs(bench.felt_m(0, 0) - 0.005) < 1e-5);
    // It comes back, led by a handle that is elsewhere now: from a reset on that leads from there.
    bench.is_away[1] = false;
    bench.device[1].p_wa = {0.3_r, 0.1_r, 0.2_r};
    // The other hand feels nothing of that: it goes on from how it was held.
    const double before_n = bench.force_n(0, 0);
    bench.hands().hand(1).reset(true);
    bench.tick();
    CHECK(bench.force_n(0, 0) == doctest::Approx(before_n).epsilon(1e-6));
    CHECK(std::abs(bench.felt_m(1, 0) - 0.045) < 1e-5);
    CHECK(std::abs(bench.felt_m(1, 1)) < 1e-5);
    CHECK(std::abs(bench.force_n(1, 0)) < 1e-6);
  }

  TEST_CASE("a bad pose of one hand stops it alone") {
    HandsBench bench(two_blocks(true));
    bench.ticks(10);
    bench.device[1].p_wa[0] = std::numeric_limits<Real>::quiet_NaN();
    for (int k = 0; k < 300; ++k) {
      bench.device[0].p_wa[0] += 100e-6_r;
      bench.tick();
      CHECK(bench.last[1].status == RtStatus::kPoseNotFinite);
      CHECK(bench.last[0].status == RtStatus::kOk);
    }
    CHECK(std::abs(bench.felt_m(0, 0) + 0.01) < 1e-6);
  }

  TEST_CASE("servo tick: a fault of the core and an emergency stop are of both, others of one") {
    const std::vector<std::byte> scene = two_blocks(true);
    enum Cause { kNone, kCore, kStop, kBadPose };
    for (const Cause cause : {kNone, kCore, kStop, kBadPose}) {
      CAPTURE(static_cast<int>(cause));
      CoreSession session(scene, "two hands' tick");
      std::array<ServoParameters, kMostHands> parameters;
      if (cause == kCore) parameters[1].map.scale = 0;  // not usable
      TwoHandTick tick(*session.hands(), parameters, {nullptr, nullptr});
      std::array<ServoInput, kMostHands> inputs;
      std::array<ServoResult, kMostHands> last;
      for (std::uint64_t k = 1; k <= 5; ++k) {
        for (ServoInput& input : inputs) {
          input.now_ns = static_cast<std::int64_t>(k) * 1'000'000;
          input.state.link = LinkState::kReady;
          input.state.sequence = k;
          input.state.stamp_ns = input.now_ns;
        }
        if (cause == kStop) inputs[1].emergency_stop = true;
        if (cause == kBadPose)
          inputs[1].state.pose_dh.p_m[0] = std::numeric_limits<Real>::quiet_NaN();
        last = tick.step(inputs);
      }
      const std::uint32_t shared = cause == kCore   ? kFaultInternal
                                   : cause == kStop ? kFaultEmergencyStop
                                                    : 0u;
      CHECK(last[0].faults == shared);
      CHECK((last[1].faults & shared) == shared);
      CHECK(((last[1].faults & kFaultBadPose) != 0) == (cause == kBadPose));
    }
  }

  TEST_CASE("the same inputs give the same bits") {
    std::vector<std::uint64_t> first;
    for (int run = 0; run < 2; ++run) {
      HandsBench bench(peg_and_socket());
      std::vector<std::uint64_t> hashes;
      for (int k = 0; k < 1500; ++k) {
        bench.device[0].p_wa = {0.0007_r * std::sin(0.01_r * static_cast<Real>(k)), 0,
                                0.05_r - 20e-6_r * static_cast<Real>(k)};
        bench.device[1].p_wa[2] += 10e-6_r;
        bench.tick();
        hashes.push_back(bench.last[0].state_hash ^ (bench.last[1].state_hash << 1));
      }
      if (run == 0) first = hashes;
      CHECK(hashes == first);
    }
  }

  TEST_CASE("what a scene with a second hand may not say is refused, with the fix") {
    const auto refused = [](const std::string& parts) {
      try {
        two_hand_scene("format = 1\nname = \"x\"\n" + parts + kRendering);
      } catch (const tools::InputError& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    const auto part = [](const std::string& name, const std::string& role, double x_m) {
      return "[[part]]\nname = \"" + name + "\"\nrole = \"" + role +
             "\"\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.02]\nposition_m = [" +
             std::to_string(x_m) + ", 0, 0]\n";
    };
    CHECK(has(refused(part("a", "hand", 0) + part("b", "hand2", 1) + part("c", "hand2", 2)),
              "is \"hand2\" of another part already; each hand holds one"));
    CHECK(has(refused(part("a", "hand", 0) + part("b", "hand2", 1) + part("c", "placed", 2)),
              "'c' is \"placed\"; make it fixed"));
    CHECK(has(refused(part("b", "hand2", 1) + part("c", "fixed", 2)), "none has role = \"hand\""));
    CHECK(refused(part("a", "hand", 0) + part("b", "hand2", 0.1)).empty());
  }
}
