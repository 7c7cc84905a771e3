// SPDX-License-Identifier: Apache-2.0
// A part in the hand among parts that their owners move, through the core as a program has it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/device/device_stack.hpp"
#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/motion_script.hpp"
#include "rt_core/base/rotation.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr bool kIsFloat = HAPTIC_REAL_IS_FLOAT != 0;
constexpr double kStiffness_n_per_m = 1000;

std::vector<std::byte> compiled(const std::string& text) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "haptic_test_drive_run.toml";
  std::ofstream(path) << text;
  std::vector<std::byte> bytes = tools::compile_scene(tools::read_scene_file(path), {}).bytes;
  std::filesystem::remove(path);
  return bytes;
}

/// A block in the hand, a plate that is driven, and a wall; with further tables of the scene.
std::vector<std::byte> plate_scene(double stiffness_n_per_m = kStiffness_n_per_m,
                                   const std::string& tables = "") {
  return compiled(
      "format = 1\nname = \"plate\"\n"
      "[[part]]\nname = \"block\"\nrole = \"hand\"\nshape = \"box\"\n"
      "size_m = [0.04, 0.04, 0.03]\nposition_m = [0, 0, 0]\n"
      "[[part]]\nname = \"plate\"\nrole = \"driven\"\nshape = \"box\"\n"
      "size_m = [0.02, 0.1, 0.1]\nposition_m = [-0.1, 0, 0]\n"
      "fastest_m_per_s = 0.5\nfastest_rad_per_s = 2.0\npush_n = 60\n"
      "[[part]]\nname = \"wall\"\nrole = \"fixed\"\nshape = \"box\"\n"
      "size_m = [0.02, 0.3, 0.3]\nposition_m = [0.06, 0, 0]\n"
      "[rendering]\nk_f_n_per_m = 1000\n[coupling]\nk_t_n_per_m = " +
      std::to_string(stiffness_n_per_m) + "\n" + tables);
}

/// The hand's device and one owner, tick by tick at 1 kHz.
class Bench {
 public:
  explicit Bench(const std::vector<std::byte>& scene) : session_(scene, "the bench's scene") {}

  [[nodiscard]] PartHand& hand() { return *session_.hand(); }
  [[nodiscard]] const DrivenState& plate() { return hand().driven().states()[0]; }
  [[nodiscard]] double block_x_m() const { return static_cast<double>(last.proxy_pose_wa.p_wa[0]); }
  [[nodiscard]] Vec3 force_n() const { return last.wrench_w.force_w; }
  [[nodiscard]] double now_s() const { return 1e-9 * static_cast<double>(now_ns_); }

  void give(const Vec3& p_m, const Quat& q = Quat::Identity(), bool stands = false) {
    record_.number += 1;
    record_.stamp_ns = now_ns_;
    for (int k = 0; k < 3; ++k) record_.p_m[k] = static_cast<double>(p_m[k]);
    for (int k = 0; k < 4; ++k) record_.q_xyzw[k] = static_cast<double>(q.coeffs()[k]);
    record_.stands = stands ? 1 : 0;
  }

  const StepResult& tick() {
    now_ns_ += 1'000'000;
    const bool felt = !last.wrench_w.force_w.isZero(0);
    is_cause = hand().follow({std::span(&record_, 1), now_ns_, felt});
    StepInput input;
    input.sequence = ++ticks_;
    input.stamp_ns = now_ns_;
    input.pose_wa = device;
    last = session_.step(input);
    return last;
  }
  /// No count of any tick so far is above what the hand says of its scene.
  [[nodiscard]] bool is_bounded() {
    return within_bounds(session_.core().peaks(), session_.bounds());
  }

  Pose device;
  StepResult last;
  bool is_cause = false;

 private:
  CoreSession session_;
  FrameRecord record_;
  std::int64_t now_ns_ = 1'000'000;
  std::uint64_t ticks_ = 0;
};

}  // namespace

TEST_SUITE("host_sim.drive_run") {
  TEST_CASE("a driven part at rest is as hard as a fixed one") {
    Bench bench(plate_scene());
    // The plate's face is at x = -0.09; the block's at -0.02 from its middle.
    for (int k = 0; k < 400; ++k) {
      bench.device.p_wa[0] = static_cast<Real>(-0.0002 * k);
      bench.tick();
    }
    for (int k = 0; k < 50; ++k) bench.tick();
    const double pressed_m = 0.0002 * 399 - 0.07;
    const double force_n = kStiffness_n_per_m * pressed_m;
    CHECK(static_cast<double>(bench.force_n()[0]) == doctest::Approx(force_n).epsilon(1e-3));
    // By F / (1e4 k) more than a fixed one.
    const double give_m = force_n / (1e4 * kStiffness_n_per_m);
    CHECK(std::abs(bench.block_x_m() + 0.07) < give_m + (kIsFloat ? 2e-6 : 5e-7));
    CHECK(static_cast<double>(bench.plate().lag_m) == doctest::Approx(give_m).epsilon(0.05));
    CHECK(static_cast<double>(bench.plate().pushed_w.force_w[0]) ==
          doctest::Approx(-force_n).epsilon(1e-3));
    CHECK(bench.plate().touches());
    CHECK(bench.last.situation == ContactSituation::kFaceFace);
    CHECK((bench.last.flags & (kFlagDrivenBehind | kFlagDrivenLost)) == 0);
    CHECK(bench.is_bounded());
  }

  TEST_CASE("a driven part pushes a part that the hand lets go along, and the spring tells") {
    Bench bench(plate_scene());
    double largest_step_n = 0;
    Vec3 before = Vec3::Zero();
    for (int k = 0; k <= 400; ++k) {
      // 100 poses a second, 0.2 m/s.
      if (k % 10 == 0) bench.give(Vec3(static_cast<Real>(-0.1 + 0.0002 * k), 0, 0));
      bench.tick();
      largest_step_n =
          std::max(largest_step_n, static_cast<double>((bench.force_n() - before).norm()));
      before = bench.force_n();
    }
    // An interval behind: 10 ms, 2 mm.
    const double face_m = static_cast<double>(bench.plate().felt_wa.p_wa[0]) + 0.01;
    CHECK(bench.block_x_m() == doctest::Approx(face_m + 0.02).epsilon(1e-3));
    CHECK(static_cast<double>(bench.plate().lag_m) < 2e-6);
    const double force_n = kStiffness_n_per_m * bench.block_x_m();
    CHECK(static_cast<double>(bench.force_n()[0]) == doctest::Approx(force_n).epsilon(0.02));
    // No faster than it is pushed: 0.2 mm a tick.
    CHECK(largest_step_n < 0.25);
    CHECK_FALSE(bench.is_cause);
    CHECK(bench.is_bounded());
  }

  TEST_CASE(
      "squeezed against a wall the part stays, the driver is behind, and the hand feels no more") {
    Bench bench(plate_scene());
    // The block touches the wall at x = 0.03: the face at 0.05 less its half.
    for (int k = 0; k < 300; ++k) {
      bench.device.p_wa[0] = static_cast<Real>(0.0001 * k + 0.002);
      bench.tick();
    }
    for (int k = 0; k < 100; ++k) bench.tick();
    const Vec3 before = bench.force_n();
    CHECK(static_cast<double>(before[0]) == doctest::Approx(-1.9).epsilon(0.02));
    // The plate could come to -0.01 + 0.01 = 0 and is led to 0.022 at 0.2 m/s.
    double largest_change_n = 0, largest_push_n = 0;
    bool behind = false, clean = true;
    for (int k = 0; k <= 610; ++k) {
      if (k % 10 == 0) bench.give(Vec3(static_cast<Real>(-0.1 + 0.0002 * k), 0, 0));
      bench.tick();
      largest_change_n =
          std::max(largest_change_n, static_cast<double>(std::abs(bench.force_n()[0] - before[0])));
      largest_push_n =
          std::max(largest_push_n, static_cast<double>(bench.plate().pushed_w.force_w.norm()));
      behind = behind || (bench.last.flags & kFlagDrivenBehind) != 0;
      clean = clean && (bench.last.flags & kFlagProxyStuck) == 0;
    }
    for (int k = 0; k < 20; ++k) {
      bench.give(Vec3(static_cast<Real>(0.022), 0, 0));
      bench.tick();
    }
    CHECK(largest_change_n < 2e-3);
    CHECK(behind);
    CHECK(clean);
    CHECK(static_cast<double>(bench.plate().lag_m) == doctest::Approx(0.022).epsilon(2e-3));
    // Its spring holds no more than its push; the wall and the hand's part do.
    CHECK(largest_push_n <= 60.0 * 1.01);
    CHECK(largest_push_n > 55);
    // Led back it ends behind at its stated speed, and the part is where it was.
    for (int k = 0; k <= 400; ++k) {
      if (k % 10 == 0) bench.give(Vec3(static_cast<Real>(0.022 - 0.0002 * k), 0, 0));
      bench.tick();
    }
    CHECK(static_cast<double>(bench.plate().lag_m) < 1e-6);
    CHECK((bench.last.flags & kFlagDrivenBehind) == 0);
    CHECK(std::abs(bench.force_n()[0] - before[0]) < static_cast<Real>(2e-3));
    CHECK(bench.is_bounded());
  }

  TEST_CASE("squeezed on a table the driver is told its push, however far behind it is") {
    const std::vector<std::byte> scene = compiled(
        "format = 1\nname = \"table\"\n"
        "[[part]]\nname = \"part\"\nrole = \"hand\"\nshape = \"box\"\n"
        "size_m = [0.04, 0.04, 0.02]\nposition_m = [0, 0, 0.011]\n"
        "[[part]]\nname = \"plate\"\nrole = \"driven\"\nshape = \"box\"\n"
        "size_m = [0.06, 0.06, 0.01]\nposition_m = [0, 0, 0.035]\n"
        "fastest_m_per_s = 1\nfastest_rad_per_s = 5\n"
        "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\n"
        "size_m = [0.1, 0.1, 0.02]\nposition_m = [0, 0, -0.01]\n"
        "[rendering]\nk_f_n_per_m = 800\n[coupling]\nk_t_n_per_m = 800\n");
    for (const double press_m : {0.0020, 0.0028, 0.0032, 0.0035, 0.0037}) {
      CAPTURE(press_m);
      Bench bench(scene);
      std::uint32_t untouched = 0, stuck = 0, squeezed = 0;
      for (int k = 1; k <= 900; ++k) {
        const double t_s = 0.001 * k;
        bench.give(Vec3(0, 0, static_cast<Real>(0.035 - std::max(0.0, t_s - 0.6) * 0.05)));
        bench.device.p_wa[2] = static_cast<Real>(0.011 - std::min(0.01 * t_s, press_m));
        bench.tick();
        if (bench.plate().lag_m < static_cast<Real>(2e-4)) continue;
        ++squeezed;
        if (!bench.plate().touches()) ++untouched;
        if ((bench.last.flags & (kFlagProxyStuck | kFlagProxyLimited)) != 0) ++stuck;
      }
      // A part that the hand presses by less than the plate is behind by was let go of once.
      CHECK(squeezed > 80);
      CHECK(untouched == 0);
      CHECK(stuck == 0);
      CHECK(static_cast<double>(bench.plate().pushed_w.force_w[2]) == doctest::Approx(100));
    }
  }

  TEST_CASE("a lost stream releases the hand only where the part touches what it leads") {
    for (const bool touches : {false, true}) {
      CAPTURE(touches);
      Bench bench(plate_scene());
      // Pressed on the plate, or on the wall.
      for (int k = 0; k < 500; ++k) {
        if (k % 10 == 0) bench.give(Vec3(static_cast<Real>(-0.1), 0, 0));
        bench.device.p_wa[0] = static_cast<Real>(touches ? std::max(-0.072, -0.0002 * k)
                                                         : std::min(0.032, 0.0002 * k));
        bench.tick();
      }
      const Vec3 before = bench.force_n();
      REQUIRE(static_cast<double>(before.norm()) > 1.5);
      bool released = false, flagged = false, caused = false;
      double largest_step_n = 0;
      Vec3 last = before;
      for (int k = 0; k < 1000; ++k) {  // no pose for a second
        bench.tick();
        largest_step_n =
            std::max(largest_step_n, static_cast<double>((bench.force_n() - last).norm()));
        last = bench.force_n();
        released = released || bench.force_n().isZero(0);
        flagged = flagged || (bench.last.flags & kFlagDrivenLost) != 0;
        caused = caused || bench.is_cause;
      }
      CHECK(released == touches);
      CHECK(flagged == touches);
      CHECK(caused == touches);
      CHECK(bench.plate().is_lost);
      CHECK(largest_step_n < 0.1);  // the ramp's
      if (!touches) CHECK((bench.force_n() - before).norm() < static_cast<Real>(1e-3));
      // It comes back, and the hand is taken on from where it is.
      for (int k = 0; k < 300; ++k) {
        if (k % 10 == 0) bench.give(Vec3(static_cast<Real>(-0.1), 0, 0));
        bench.tick();
        largest_step_n =
            std::max(largest_step_n, static_cast<double>((bench.force_n() - last).norm()));
        last = bench.force_n();
      }
      CHECK(largest_step_n < 0.1);
      CHECK_FALSE(bench.is_cause);
      CHECK_FALSE(bench.plate().is_lost);
    }
  }

  TEST_CASE("poses that are none, too fast or from before stop a driven part and never the tick") {
    Bench bench(plate_scene());
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    const auto stands = [&] {
      const Pose before = bench.plate().felt_wa;
      for (int k = 0; k < 30; ++k) bench.tick();
      CHECK(bench.last.status == RtStatus::kOk);
      CHECK(is_finite(bench.plate().felt_wa.p_wa));
      return (bench.plate().felt_wa.p_wa - before.p_wa).norm();
    };
    for (int k = 0; k < 5; ++k) {
      bench.give(Vec3(static_cast<Real>(-0.1), 0, 0));
      static_cast<void>(stands());
    }
    bench.give(Vec3(nan, 0, 0));
    CHECK(stands() == 0);
    CHECK(bench.plate().is_lost);
    // Nobody touches it: it goes to the newest pose as soon as that is one, no faster than stated.
    bench.give(Vec3(static_cast<Real>(-0.15), 0, 0), Quat::Identity(), true);
    const auto way_m = static_cast<double>(stands());
    CHECK_FALSE(bench.plate().is_lost);
    CHECK(way_m > 0.01);
    CHECK(way_m < 0.5 * 1.25 * 0.031);
    CHECK((bench.last.flags & kFlagDrivenBehind) != 0);
    for (int k = 0; k < 3; ++k) static_cast<void>(stands());
    CHECK((bench.last.flags & kFlagDrivenBehind) == 0);
    CHECK(static_cast<double>(bench.plate().felt_wa.p_wa[0]) == doctest::Approx(-0.15));
  }

  TEST_CASE("a part that a driven one has run into is led out when it is taken") {
    Bench bench(plate_scene(kStiffness_n_per_m,
                            "[[part]]\nname = \"other\"\nrole = \"placed\"\nshape = \"box\"\n"
                            "size_m = [0.04, 0.04, 0.03]\nposition_m = [-0.05, 0.2, 0]\n"));
    for (int k = 0; k < 10; ++k) bench.tick();
    bench.hand().release();
    while (bench.hand().phase() != PartHand::Phase::kEmpty) bench.tick();
    // Through the part that lies there, to 3 mm short of its middle.
    for (int k = 0; k <= 1000; ++k) {
      const double share = 0.001 * k;
      if (k % 10 == 0)
        bench.give(Vec3(static_cast<Real>(-0.1 + 0.047 * share), static_cast<Real>(0.2 * share), 0),
                   Quat::Identity(), k == 1000);
      bench.tick();
    }
    for (int k = 0; k < 30; ++k) bench.tick();
    CHECK(static_cast<double>(bench.plate().lag_m) == 0);
    const auto other = static_cast<std::uint32_t>(3);
    REQUIRE(bench.hand().prepare(other) == RtStatus::kOk);
    std::uint32_t recovering = 0;
    double largest_n = 0, largest_way_m = 0, gap_m = -1;
    Vec3 before = bench.last.proxy_pose_wa.p_wa;
    for (int k = 0; k < 400; ++k) {
      bench.tick();
      const bool is_out = (bench.last.flags & kFlagRecovery) != 0;
      if (is_out) ++recovering;
      if (is_out) largest_n = std::max(largest_n, static_cast<double>(bench.force_n().norm()));
      if (k > 0)
        largest_way_m = std::max(
            largest_way_m, static_cast<double>((bench.last.proxy_pose_wa.p_wa - before).norm()));
      before = bench.last.proxy_pose_wa.p_wa;
      gap_m = static_cast<double>(bench.last.proxy_gap_m);
    }
    CHECK(recovering > 2);
    CHECK(largest_n == 0);
    CHECK(largest_way_m < 0.01);
    CHECK(gap_m > (kIsFloat ? -2e-6 : -1e-6));
    CHECK(static_cast<double>(bench.plate().lag_m) < 1e-5);
    CHECK(bench.is_bounded());
  }

  TEST_CASE("a tube that a robot carries at 0.87 m/s and 4 rad/s takes a peg along") {
    const std::vector<std::byte> scene = compiled(
        "format = 1\nname = \"carried\"\n"
        "[[part]]\nname = \"peg\"\nrole = \"hand\"\nshape = \"cylinder\"\n"
        "radius_m = 0.01\nheight_m = 0.05\nsegments = 24\n"
        "[[part]]\nname = \"tube\"\nrole = \"driven\"\nshape = \"tube\"\n"
        "inner_radius_m = 0.0103\nouter_radius_m = 0.02\nheight_m = 0.03\n"
        "segments = 24\n"
        "fastest_m_per_s = 1.2\nfastest_rad_per_s = 5.0\n"
        "[rendering]\nk_f_n_per_m = 1000\n[coupling]\nk_t_n_per_m = 1000\n");
    Bench bench(scene);
    constexpr double kRadius_m = 0.2, kTop_rad_per_s = 4;
    double angle = 0, speed = 0, largest_lag_m = 0, largest_ripple_n = 0;
    Vec3 first = Vec3::Zero();
    for (int k = 0; k < 3000; ++k) {
      speed = std::min(kTop_rad_per_s, speed + 0.004);
      angle += 0.001 * speed;
      const Quat turn = so3_exp(Vec3(0, 0, static_cast<Real>(angle)));
      const Vec3 arm(static_cast<Real>(kRadius_m), 0, 0);
      const Vec3 at = turn * arm - arm;
      bench.give(at, turn);
      // The hand goes along, 0.5 mm off towards the wall of the hole, in the frame that turns.
      const Pose& led = bench.plate().commanded_wa;
      bench.device.p_wa = led.p_wa + led.q_wa * Vec3(static_cast<Real>(0.0008), 0, 0);
      bench.device.q_wa = led.q_wa;
      bench.tick();
      if (k < 1500) continue;
      largest_lag_m = std::max(largest_lag_m, static_cast<double>(bench.plate().lag_m));
      const Vec3 force = led.q_wa.conjugate() * bench.force_n();
      if (k == 1500) first = force;
      largest_ripple_n = std::max(largest_ripple_n, static_cast<double>((force - first).norm()));
    }
    CHECK(speed * kRadius_m > 0.79);
    CHECK(static_cast<double>(first.norm()) > 0.3);
    CHECK(largest_lag_m < 1e-6);
    MESSAGE("ripple ", largest_ripple_n, " N, lag ", 1e6 * largest_lag_m, " um");
    CHECK(bench.is_bounded());
  }

  TEST_CASE("a hand that is pushed to and fro is not braked below the bound") {
    // 0.1 kg, 1 N s/m, 900 N/m: k T / 2 is below the damping.
    const std::vector<std::byte> scene = plate_scene(900,
                                                     "[device]\nmass_kg = 0.1\n"
                                                     "damping_ns_per_m = 1.0\n"
                                                     "rotor_inertia_kg_m2 = 1e-4\n"
                                                     "rotor_damping_nms_per_rad = 1e-3\n");
    for (const double rate_hz : {0.5, 3.0}) {
      CAPTURE(rate_hz);
      CoreSession session(scene, "pushed");
      REQUIRE(session.view().parameters().coupling.passivity != 0);
      DeviceModel device = device_of(session.view().parameters(), 1000);
      ClosedLoop loop(session, device, *hand_named("firm"), 1000);
      DriveStream stream{"plate", "", {}};
      for (int k = 0; k <= 500; ++k) {
        MotionSample pose;
        pose.t_s = 0.01 * k;
        pose.p[0] = -0.03 + 0.005 * std::sin(6.283185307179586 * rate_hz * pose.t_s);
        stream.poses.push_back(pose);
      }
      DriveRun drives(session, {stream});
      std::vector<MotionSample> still(5001);
      for (std::size_t k = 0; k < still.size(); ++k) still[k].t_s = 1e-3 * static_cast<double>(k);
      std::uint64_t braked = 0;
      double largest_n = 0;
      const std::vector<LoopRecord> records = run_loop(
          loop, still,
          [&](const LoopRecord& record) {
            drives.after_tick(record.tick);
            if ((record.tick.flags & kFlagPassivity) != 0) ++braked;
            largest_n = std::max(largest_n, std::abs(record.tick.force_n[0]));
          },
          [&](double t_s) { drives.before_tick(t_s); });
      CHECK(largest_n > 0.5);
      CHECK(braked <= 5);
      CHECK(drives.given_j() > 0);
      CHECK(records.back().delivered_j <= drives.given_j() + 1e-4);
    }
  }

  TEST_CASE(
      "to the servo tick a lost stream is a fault only where the part touches what it leads") {
    for (const bool touches : {false, true}) {
      CAPTURE(touches);
      CoreSession session(plate_scene(), "lost");
      const DeviceModel device = device_of(session.view().parameters(), 1000);
      static_cast<void>(fit_to_device(session, device, 1000, 1e-3));
      MotionScript script;
      script.waypoints.resize(3);
      script.waypoints[1].t_s = 0.8;
      script.waypoints[1].p[0] = touches ? -0.074 : 0.034;
      script.waypoints[2] = script.waypoints[1];
      script.waypoints[2].t_s = 2.5;
      const std::vector<MotionSample> motion = make_motion(script);
      DeviceStack stack(
          session,
          stack_over(StackCarrier::kDirect, device, DeviceParameters{}, *hand_named("firm"), 1000),
          scripted_hand(session, motion, 1000));
      double pressed_n = 0, last_n = 0;
      std::uint32_t faults = 0;
      std::uint64_t number = 0;
      const std::vector<StackRecord> records = run_stack(
          stack, motion,
          [&](const StackRecord& record) {
            const double t_s = record.loop.tick.t_s;
            if (t_s > 1.1 && t_s < 1.2) pressed_n = std::abs(record.loop.tick.force_n[0]);
            if (t_s < 2.2) faults |= record.faults;
            if (t_s > 2.0 && t_s < 2.2)
              last_n = static_cast<double>(record.handed_d.force_w.norm());
          },
          [&](double t_s) {
            if (t_s > 1.2 || (number > 0 && std::fmod(t_s, 0.01) > 0.0015)) return;
            FrameRecord record;
            record.number = ++number;
            record.stamp_ns = stack.now_ns();
            record.p_m[0] = -0.1;
            stack.drive(0, record);
          });
      CHECK(pressed_n > 0.5);
      CHECK((faults & kFaultFrame) == (touches ? std::uint32_t{kFaultFrame} : 0u));
      if (touches) {
        CHECK(last_n == 0);
      } else {
        CHECK(last_n == doctest::Approx(pressed_n).epsilon(0.01));
      }
    }
  }

  TEST_CASE("the same poses give the same bits, and a pose less gives others") {
    const std::vector<std::byte> scene = plate_scene();
    const auto hash = [&](int skipped) {
      Bench bench(scene);
      for (int k = 0; k < 400; ++k) {
        if (k % 10 == 0 && k != skipped)
          bench.give(Vec3(static_cast<Real>(-0.1 + 0.0002 * k), 0, 0));
        bench.tick();
      }
      return bench.last.state_hash;
    };
    CHECK(hash(-1) == hash(-1));
    CHECK(hash(-1) != hash(350));
  }

  TEST_CASE("owners of no part, or of one that is not driven, are refused by name") {
    const auto refusal = [](CoreSession& session, std::vector<DriveStream> streams) -> std::string {
      try {
        const DriveRun run(session, std::move(streams));
        return "";
      } catch (const tools::InputError& error) {
        return error.what();
      }
    };
    CoreSession session(plate_scene(), "plate");
    const std::vector<MotionSample> still(2);
    CHECK(haptic::test::has(refusal(session, {{"plat", "x.toml", still}}),
                            "no part of that name is driven; those are: plate"));
    CHECK(haptic::test::has(
        refusal(session, {{"plate", "x.toml", still}, {"plate", "y.toml", still}}), "given twice"));
    CHECK(refusal(session, {{"plate", "x.toml", still}}) == "");
    const std::filesystem::path scenes(HAPTIC_SCENES_DIR);
    CoreSession other(
        tools::compile_scene(tools::read_scene_file(scenes / "seven_parts" / "scene.toml"), {})
            .bytes,
        "seven parts");
    CHECK(haptic::test::has(refusal(other, {{"ring", "x.toml", still}}), "has no driven part"));
    CHECK_THROWS_AS(static_cast<void>(read_drive("plate")), tools::UsageError);
    CHECK_THROWS_AS(static_cast<void>(read_drive("=motion.toml")), tools::UsageError);
  }

  TEST_CASE("a robot carries a socket while a simulated hand puts a peg into it") {
    const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / "robot_fixture";
    CoreSession session(
        tools::compile_scene(tools::read_scene_file(folder / "scene.toml"), {}).bytes, "robot");
    const MotionScript script = read_motion_script(folder / "motion.toml");
    static_cast<void>(fit_to_device(session, {}, script.rate_hz));
    ClosedLoop loop(session, {}, *hand_named("firm"), script.rate_hz);
    DriveRun drives(session, {read_drive("socket=" + (folder / "socket.toml").string())});
    double least_energy_j = 0;
    bool passive = true;
    const std::vector<LoopRecord> records = run_loop(
        loop, make_motion(script),
        [&](const LoopRecord& record) {
          drives.after_tick(record.tick);
          least_energy_j = std::min(least_energy_j, static_cast<double>(record.tick.energy_j));
          passive = passive && (record.tick.flags & kFlagPassivity) == 0;
        },
        [&](double t_s) { drives.before_tick(t_s); });
    CHECK(drives.failures() == "");
    const DrivenAccount& socket = drives.accounts()[0];
    CHECK(socket.poses == 491);
    CHECK(socket.touched_s > 0.5);
    CHECK(socket.largest_lag_m < 5e-6);
    CHECK(passive);
    CHECK(least_energy_j > -1e-6);
    // The robot does the work.
    CHECK(drives.given_j() > 1e-3);
    CHECK(records.back().delivered_j <= drives.given_j() + 1e-4);
    const LoopTotals totals = total(records);
    CHECK(totals.finite);
    CHECK_FALSE(totals.runs_away());
    CHECK(totals.contact_ticks > 500);
    // In the hole: its axis is the peg's but for the clearance, and it is that deep.
    const DrivenState& state = session.hand()->driven().states()[0];
    const TickRecord& end = records.back().tick;
    const Vec3 peg(static_cast<Real>(end.proxy_wa.p_m[0]), static_cast<Real>(end.proxy_wa.p_m[1]),
                   static_cast<Real>(end.proxy_wa.p_m[2]));
    const Vec3 inside = state.felt_wa.q_wa.conjugate() * (peg - state.felt_wa.p_wa);
    CHECK(std::hypot(inside[0], inside[1]) < static_cast<Real>(0.003));
    CHECK(inside[2] < static_cast<Real>(0.02));
    CHECK(drives.csv().find("socket") != std::string::npos);
  }
}
