// SPDX-License-Identifier: Apache-2.0
// The rules by which force comes and goes between the bridge's thread and a vendor's, turn by turn
// on one thread; and the axes.
#include <doctest/doctest.h>

#include <limits>
#include <numbers>
#include <string>

#include "hal/clock/servo_clock.hpp"
#include "tests/support/random.hpp"
#include "tools/bridges/openhaptics/hd_hints.hpp"
#include "tools/bridges/vendor/vendor_axes.hpp"
#include "tools/bridges/vendor/vendor_exchange.hpp"

using namespace haptic;
using namespace haptic::tools;
using hal::BridgeRead;

namespace {

constexpr VendorLimits kLimits = {1'000'000, 10, 0.2_r, 0};

class ScriptedHandle final : public VendorHandle {
 public:
  VendorResult sense(hal::BridgeSample& sample) noexcept override {
    sample.pose_dh.p_m[0] = 0.01_r;
    sample.calibrated = true;
    return sensed;
  }
  VendorResult exert(bool on, const Wrench& wrench_d) noexcept override {
    drives = on;
    force_n = wrench_d.force_w.norm();
    return exerted;
  }
  VendorResult sensed = VendorResult::kDone, exerted = VendorResult::kDone;
  bool drives = false;
  Real force_n = 0;
};

Wrench push(Real newtons) {
  Wrench wrench;
  wrench.force_w.x() = newtons;
  return wrench;
}

struct ExchangeBench {
  VendorExchange exchange{kLimits};
  ScriptedHandle handle;
  hal::BridgeSample sample;

  bool turn() { return exchange.turn(handle); }
  bool write(Real newtons, std::int64_t age_ns = 0) {
    return exchange.write(hal::monotonic_ns() - age_ns, push(newtons));
  }
  BridgeRead look(std::int64_t later_ns = 0) {
    return exchange.read(hal::monotonic_ns() + later_ns, sample);
  }
  void start() {
    REQUIRE(turn());
    (void)write(0);
    REQUIRE(turn());
    REQUIRE(handle.drives);
  }
};

}  // namespace

TEST_SUITE_BEGIN("bridges.vendor_exchange");

TEST_CASE("force comes on with a small order, never with a large one") {
  ExchangeBench b;
  REQUIRE(b.turn());
  (void)b.write(6);
  CHECK(b.turn());
  CHECK_FALSE(b.handle.drives);
  CHECK(b.handle.force_n == 0);
  CHECK_FALSE(b.write(6));  // it is held back, and the bridge learns it
  CHECK(b.turn());
  CHECK_FALSE(b.handle.drives);
  (void)b.write(0.5_r);
  CHECK(b.turn());
  CHECK(b.handle.drives);
  CHECK(b.handle.force_n == 0.5_r);
  (void)b.write(6);
  CHECK(b.turn());
  CHECK(b.handle.force_n == 6);
  CHECK(b.write(6));
}

TEST_CASE("an order that is too old cuts the force off until it is released") {
  ExchangeBench b;
  b.start();
  (void)b.write(6);
  REQUIRE(b.turn());
  REQUIRE(b.handle.force_n == 6);
  (void)b.write(6, VendorExchange::kOldest_ns + 1'000'000);
  CHECK(b.turn());
  CHECK_FALSE(b.handle.drives);
  CHECK(b.handle.force_n == 0);
  CHECK(b.look() == BridgeRead::kNew);
  CHECK((b.sample.faults & kDeviceDriveFault) != 0);
  for (const Real newtons : {6.0_r, 0.0_r}) {
    CHECK_FALSE(b.write(newtons));
    CHECK(b.turn());
    CHECK_FALSE(b.handle.drives);
  }
  CHECK_FALSE(b.exchange.release(hal::monotonic_ns()));
  CHECK(b.turn());
  CHECK(b.exchange.release(hal::monotonic_ns()));
  CHECK(b.turn());
  CHECK(b.look() == BridgeRead::kNew);
  CHECK(b.sample.faults == 0);
  b.start();
}

TEST_CASE("a turn that comes too late cuts the force off, however fresh the order is") {
  ExchangeBench b;
  b.start();
  (void)b.write(6);
  REQUIRE(b.turn());
  REQUIRE(b.handle.force_n == 6);
  (void)hal::sleep_until(hal::monotonic_ns() + VendorExchange::kOldest_ns + 2'000'000);
  (void)b.write(6);
  CHECK(b.turn());
  CHECK(b.handle.force_n == 0);
  CHECK_FALSE(b.write(0));
}

TEST_CASE("a release counts only once it was carried out") {
  ExchangeBench b;
  b.start();
  b.handle.exerted = VendorResult::kRefused;
  for (int k = 0; k < 3; ++k) {
    CHECK_FALSE(b.exchange.release(hal::monotonic_ns()));
    CHECK(b.turn());
    CHECK_FALSE(b.handle.drives);
  }
  b.handle.exerted = VendorResult::kDone;
  CHECK_FALSE(b.exchange.release(hal::monotonic_ns()));
  CHECK(b.turn());
  CHECK(b.exchange.release(hal::monotonic_ns()));
}

TEST_CASE("a call that fails cuts the force off, and the next order does not bring it back") {
  ExchangeBench b;
  b.start();
  (void)b.write(4);
  b.handle.exerted = VendorResult::kRefused;
  CHECK(b.turn());
  b.handle.exerted = VendorResult::kDone;
  CHECK_FALSE(b.write(0));
  CHECK(b.turn());
  CHECK_FALSE(b.handle.drives);
}

TEST_CASE("an order that is not finite is exerted as nothing") {
  ExchangeBench b;
  b.start();
  (void)b.write(std::numeric_limits<Real>::quiet_NaN());
  CHECK(b.turn());
  CHECK(b.handle.force_n == 0);
  (void)b.write(std::numeric_limits<Real>::infinity());
  CHECK(b.turn());
  CHECK(b.handle.force_n == 0);
}

TEST_CASE(
    "silence: nothing before the first sample, from two periods on, lost after three seconds") {
  ExchangeBench b;
  CHECK(b.look() == BridgeRead::kSilent);
  REQUIRE(b.turn());
  CHECK(b.look() == BridgeRead::kNew);
  CHECK(b.sample.pose_dh.p_m[0] == 0.01_r);
  const std::int64_t sampled_ns = b.sample.sampled_ns;
  CHECK(b.exchange.read(sampled_ns + kLimits.period_ns, b.sample) == BridgeRead::kSame);
  CHECK(b.exchange.read(sampled_ns + 3 * kLimits.period_ns, b.sample) == BridgeRead::kSilent);
  CHECK_FALSE(b.exchange.write(sampled_ns + VendorExchange::kOldest_ns, push(0)));
  CHECK(b.look(VendorExchange::kLongestSilence_ns + 1'000'000) == BridgeRead::kLost);
}

TEST_CASE("poses that are refused: no sample, and lost when there are only those") {
  ExchangeBench b;
  REQUIRE(b.turn());
  REQUIRE(b.look() == BridgeRead::kNew);
  b.handle.sensed = VendorResult::kRefused;
  for (unsigned k = 1; k < VendorExchange::kMostRefused; ++k) {
    REQUIRE(b.turn());
    REQUIRE(b.look() != BridgeRead::kNew);
  }
  CHECK_FALSE(b.turn());
  CHECK(b.look() == BridgeRead::kLost);
}

TEST_CASE("stopping takes the force away in the next turn") {
  ExchangeBench b;
  b.start();
  (void)b.write(5);
  REQUIRE(b.turn());
  REQUIRE(b.handle.force_n == 5);
  b.exchange.stop();
  CHECK_FALSE(b.exchange.has_stopped());
  CHECK(b.turn());
  CHECK_FALSE(b.handle.drives);
  CHECK(b.exchange.has_stopped());
}

TEST_CASE("a sample makes the descriptor readable, and a look empties it") {
  ExchangeBench b;
  pollfd watched = b.exchange.watched();
  CHECK(poll(&watched, 1, 0) == 0);
  REQUIRE(b.turn());
  CHECK(poll(&watched, 1, 0) == 1);
  (void)b.look();
  CHECK(poll(&watched, 1, 0) == 0);
}

TEST_CASE("any orders, ages and failures in any sequence keep the rules") {
  const Real smallest = VendorExchange::kLargestStart * kLimits.max_force_n;
  int driven = 0, cuts = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    test::Random random(seed);
    const auto chance = [&](double share) { return random.uniform(0, 1) < share; };
    ExchangeBench b;
    Real ordered_n = -1;  // below 0: nothing is to be driven
    bool is_fresh = false, was_driven = false, cut = false;
    for (int k = 0; k < 1000; ++k) {
      CAPTURE(k);
      if (chance(0.05)) {
        (void)b.exchange.release(hal::monotonic_ns());
        ordered_n = -1;
      } else if (chance(0.9)) {
        is_fresh = !chance(0.02);
        ordered_n = static_cast<Real>(random.uniform(0, chance(0.5) ? 0.4 : 12));
        (void)b.write(ordered_n, is_fresh ? 0 : VendorExchange::kOldest_ns + 1'000'000);
      }
      b.handle.sensed = chance(0.05) ? VendorResult::kRefused : VendorResult::kDone;
      b.handle.exerted = chance(0.03) ? VendorResult::kRefused : VendorResult::kDone;
      REQUIRE(b.turn());
      const bool drives = b.handle.drives;
      // Force only by a fresh order, as large as that, never after a cut, and never from nothing to
      // much.
      REQUIRE((!drives || (ordered_n >= 0 && is_fresh && !cut)));
      REQUIRE(b.handle.force_n == (drives ? ordered_n : 0));
      REQUIRE((!drives || was_driven || ordered_n <= smallest));
      driven += drives ? 1 : 0;
      const bool is_done = b.handle.exerted == VendorResult::kDone;
      if ((was_driven && ordered_n >= 0 && !is_fresh) || (drives && !is_done)) {
        cut = true;
        ++cuts;
      }
      if (ordered_n < 0 && is_done) cut = false;
      was_driven = drives;
    }
  }
  // It was no idle walk; a machine that holds this thread up cuts too, which makes it fewer.
  CHECK(driven > 500);
  CHECK(cuts > 20);
}

TEST_CASE("axes: right, away and up of both vendors") {
  const VendorAxes fd = VendorAxes::force_dimension(), hd = VendorAxes::open_haptics();
  // Towards the operator, to the right, up.
  CHECK(fd.to_d(Vec3(1, 0, 0)) == Vec3(0, -1, 0));
  CHECK(fd.to_d(Vec3(0, 1, 0)) == Vec3(1, 0, 0));
  CHECK(fd.to_d(Vec3(0, 0, 1)) == Vec3(0, 0, 1));
  CHECK(hd.to_d(Vec3(1, 0, 0)) == Vec3(1, 0, 0));
  CHECK(hd.to_d(Vec3(0, 1, 0)) == Vec3(0, 0, 1));
  CHECK(hd.to_d(Vec3(0, 0, 1)) == Vec3(0, -1, 0));
  test::Random random(7);
  for (const VendorAxes& axes : {fd, hd}) {
    for (int k = 0; k < 200; ++k) {
      const auto c = random.rotation();
      const Quat q(static_cast<Real>(c[0]), static_cast<Real>(c[1]), static_cast<Real>(c[2]),
                   static_cast<Real>(c[3]));
      const Vec3 arm(static_cast<Real>(random.uniform(-1, 1)), 0.3_r, -0.2_r);
      CHECK((axes.from_d(axes.to_d(arm)) - arm).norm() <= 8 * kRealEpsilon);
      CHECK((axes.to_d(arm.cross(Vec3(0, 1, 0))) - axes.to_d(arm).cross(axes.to_d(Vec3(0, 1, 0))))
                .norm() <= 8 * kRealEpsilon);
      PoseRecord record;
      REQUIRE(axes.pose_to_d(Vec3(0.1_r, 0.2_r, 0.3_r), q.toRotationMatrix(), record));
      // A point of the handle moves alike, by whichever axes it is told.
      const Pose pose = pose_of(record);
      const Vec3 by_vendor = axes.to_d(Vec3(0.1_r, 0.2_r, 0.3_r) + q * arm);
      CHECK((pose.p_wa + pose.q_wa * axes.to_d(arm) - by_vendor).norm() <= 64 * kRealEpsilon);
    }
  }
}

TEST_CASE("axes: what is no pose is refused") {
  const VendorAxes axes = VendorAxes::open_haptics();
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  const Mat3 one = Mat3::Identity();
  PoseRecord record;
  record.p_m[0] = 77;
  CHECK_FALSE(axes.pose_to_d(Vec3(nan, 0, 0), one, record));
  CHECK_FALSE(axes.pose_to_d(Vec3(0, 0, 2.1_r), one, record));
  CHECK_FALSE(axes.pose_to_d(Vec3::Zero(), Mat3::Zero(), record));
  CHECK_FALSE(axes.pose_to_d(Vec3::Zero(), -one, record));
  CHECK_FALSE(axes.pose_to_d(Vec3::Zero(), 1.02_r * one, record));
  Mat3 spoilt = one;
  spoilt(2, 1) = nan;
  CHECK_FALSE(axes.pose_to_d(Vec3::Zero(), spoilt, record));
  CHECK(record.p_m[0] == 77);
  CHECK(axes.pose_to_d(Vec3::Zero(), 1.001_r * one, record));
  CHECK(std::abs(pose_of(record).q_wa.norm() - 1) <= 8 * kRealEpsilon);
}

TEST_CASE("the version of HDAPI by the first number in its words") {
  CHECK(is_hd_version("3.4.0"));
  CHECK(is_hd_version("HDAPI 3.5"));
  CHECK(is_hd_version(""));  // not said: the functions are there
  CHECK_FALSE(is_hd_version("2.0.24"));
  CHECK_FALSE(is_hd_version("34"));
}

TEST_SUITE_END();
