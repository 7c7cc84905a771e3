// SPDX-License-Identifier: Apache-2.0
/// A session of each device that people own, from `run_device list` to a peg that is felt at the
/// floor and at a wall of its hole: the device's own wire says with which force.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tests/bridges/sessions/device_session.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic;
using namespace haptic::test;
using nlohmann::json;

namespace {

struct OwnedDevice {
  const char* title;
  const char* driver;
  std::unique_ptr<EmulatedHand> (*make)();
  bool has_force;
};

constexpr OwnedDevice kOwned[] = {
    {"3Dconnexion through spacenavd", "spacenav", make_spacenav_hand, false},
    {"Inverse3, service 3.1", "haply", [] { return make_haply_hand("3.1.1.0"); }, true},
    {"Inverse3, service 3.5", "haply", [] { return make_haply_hand("3.5.0.0"); }, true},
    {"Touch by libHD", "openhaptics", make_touch_hand, true},
    {"sigma.7 by libdhd", "forcedimension", make_force_dimension_hand, true},
    {"leader arm on DYNAMIXEL", "dynamixel", make_dynamixel_hand, true},
    {"leader arm on Feetech", "feetech", make_feetech_hand, false}};

/// Tries of a push that a busy machine disturbs.
constexpr int kTries = 12;
/// How far the hand goes on where the part has met something.
constexpr double kInto_m = 0.005, kAside_m = 0.003;

double eased(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

std::int64_t monotonic() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// The way down to `kInto_m` beyond the floor, held, then to the side, held.
struct PegMotion {
  static constexpr double kDown_s = 0.5, kAcross_s = 0.12, kHeld_s = 0.2;
  static constexpr double kFloor_m = kPegGap_m + kHoleDepth_m;
  static Vec3 at(double t_s) {
    const double down = (kFloor_m + kInto_m) * eased(t_s / kDown_s);
    const double aside = (kPegPlay_m + kAside_m) * eased((t_s - kDown_s - kHeld_s) / kAcross_s);
    return {static_cast<Real>(aside), 0, static_cast<Real>(-down)};
  }
  static constexpr double kFloorFelt_s = kDown_s + kHeld_s;
  static constexpr double kEnd_s = kFloorFelt_s + kAcross_s + kHeld_s;
};

struct Limits {
  double force_n = 0, slew_n_per_s = 0;
};

/// From what the run says that it sends.
Limits limits_of_run(const DeviceSession& session) {
  Limits limits;
  const std::string text = session.errors();
  const std::size_t at = text.find("sent to this device: at most ");
  double torque = 0;
  if (at != std::string::npos)
    (void)std::sscanf(text.c_str() + at, "sent to this device: at most %lf N, %lf N m, %lf N/s",
                      &limits.force_n, &torque, &limits.slew_n_per_s);
  return limits;
}

struct Felt {
  std::int64_t begun_ns = 0, floor_ns = 0, end_ns = 0, released_ns = 0;
  std::vector<WireForce> wire;

  /// Median force of the last 60 ms before a time.
  [[nodiscard]] Vec3 before(std::int64_t at_ns) const {
    std::vector<Real> xyz[3];
    for (const WireForce& f : wire) {
      if (f.at_ns > at_ns || f.at_ns < at_ns - 60'000'000) continue;
      for (int k = 0; k < 3; ++k) xyz[k].push_back(f.force_d[k]);
    }
    Vec3 median = Vec3::Zero();
    for (int k = 0; k < 3 && !xyz[k].empty(); ++k) {
      std::nth_element(xyz[k].begin(), xyz[k].begin() + static_cast<long>(xyz[k].size() / 2),
                       xyz[k].end());
      median[k] = xyz[k][xyz[k].size() / 2];
    }
    return median;
  }
};

/// The spring's force for how far the hand is beyond floor and wall, within `most_n`.
Vec3 expected_force(double k_n_per_m, double into_m, double aside_m, double most_n) {
  const Vec3 f(static_cast<Real>(-k_n_per_m * aside_m), 0, static_cast<Real>(k_n_per_m * into_m));
  const Real most = static_cast<Real>(most_n);
  return f.norm() > most ? Vec3(f * (most / f.norm())) : f;
}

void check_force(const char* where, const Vec3& felt, const Vec3& expected, double noise_n) {
  CAPTURE(where);
  INFO("felt " << felt.x() << " " << felt.y() << " " << felt.z() << " N, expected " << expected.x()
               << " " << expected.y() << " " << expected.z());
  CHECK(static_cast<double>((felt - expected).norm()) <
        0.25 * static_cast<double>(expected.norm()) + noise_n);
}

/// The wire of a device with force.
void judge_wire(const Felt& felt, const Limits& limits, double k_n_per_m, double noise_n) {
  REQUIRE(limits.force_n > 0);
  REQUIRE(limits.slew_n_per_s > 0);
  const double felt_n = std::min(0.05, 0.3 * limits.force_n) + noise_n;
  double peak_n = 0;
  std::int64_t first_ns = 0;
  const WireForce* last = nullptr;
  for (const WireForce& f : felt.wire) {
    if (f.at_ns < felt.begun_ns || f.at_ns > felt.released_ns + 500'000'000) continue;
    const auto size = static_cast<double>(f.force_d.norm());
    peak_n = std::max(peak_n, size);
    if (first_ns == 0 && size > felt_n) first_ns = f.at_ns;
    if (last != nullptr) {
      // A message may have waited for 5 ms on its way, on a machine that is busy.
      const double seconds = 1e-9 * static_cast<double>(f.at_ns - last->at_ns) + 0.005;
      CHECK(static_cast<double>((f.force_d - last->force_d).norm()) <=
            limits.slew_n_per_s * seconds + noise_n);
      // A spring that the hand stretches by 0.2 m/s at most: no step in it.
      if (f.at_ns < felt.released_ns)
        CHECK(static_cast<double>((f.force_d - last->force_d).norm()) <=
              k_n_per_m * 0.2 * (seconds + 0.015) + noise_n);
    }
    last = &f;
  }
  CHECK(peak_n <= limits.force_n * 1.01 + noise_n);
  CHECK(peak_n > felt_n);
  // Nothing was felt before the floor: the peg was in its hole.
  const double down_s = 1e-9 * static_cast<double>(first_ns - felt.begun_ns);
  CHECK(static_cast<double>(-PegMotion::at(down_s).z()) > PegMotion::kFloor_m - 0.002);
  check_force("floor", felt.before(felt.floor_ns),
              expected_force(k_n_per_m, kInto_m, 0, limits.force_n), noise_n);
  check_force("floor and wall", felt.before(felt.end_ns),
              expected_force(k_n_per_m, kInto_m, kAside_m, limits.force_n), noise_n);
  // Zero once the switch was released, and until the end.
  for (const WireForce& f : felt.wire) {
    if (f.at_ns > felt.released_ns + 150'000'000 && f.at_ns < felt.released_ns + 250'000'000)
      CHECK(static_cast<double>(f.force_d.norm()) <= noise_n);
  }
}

/// Down to the floor and to the wall, with the switch pressed. False: the machine was late
/// meanwhile, which has taken the force away.
bool leads_peg(DeviceSession& session, EmulatedHand& hand, Felt& felt) {
  const auto faults = [&] { return times(session.errors(), ": faulted, "); };
  const std::size_t before = faults();
  if (!session.arm(Vec3::Zero())) return false;
  session.lead(hand.settling_s(), [](double) { return Vec3(Vec3::Zero()); });
  felt.begun_ns = monotonic();
  session.lead(PegMotion::kFloorFelt_s, PegMotion::at);
  felt.floor_ns = monotonic();
  session.lead(PegMotion::kEnd_s - PegMotion::kFloorFelt_s,
               [](double t_s) { return PegMotion::at(PegMotion::kFloorFelt_s + t_s); });
  felt.end_ns = monotonic();
  hand.press(false);
  felt.released_ns = monotonic();
  session.lead(0.3, [](double) { return PegMotion::at(PegMotion::kEnd_s); });
  const bool is_undisturbed = faults() == before || session.has_ended();
  session.lead(0.4, [](double t_s) {
    return Vec3(PegMotion::at(PegMotion::kEnd_s) * (1 - static_cast<Real>(eased(t_s / 0.4))));
  });
  return is_undisturbed;
}

void feel_in_one_session(const OwnedDevice& device) {
  const std::unique_ptr<EmulatedHand> hand = [&] {
    const InRealTime here;
    return device.make();
  }();
  if (!hand->absence().empty()) {
    MESSAGE("skipped: " << device.title << ": " << hand->absence());
    return;
  }
  DeviceSession session(*hand);
  const json listed = session.list();
  REQUIRE(listed.is_object());
  REQUIRE_MESSAGE(session.start(listed, device.driver), listed.dump(1));
  Felt felt;
  bool is_felt = false;
  for (int k = 0; k < kTries && !is_felt && !session.has_ended(); ++k)
    is_felt = leads_peg(session, *hand, felt);
  CHECK(session.bridges().size() == 1);
  felt.wire = hand->wire();
  session.end();
  REQUIRE(session.has_ended());
  const json summary = session.newest("summary");
  INFO("standard error: " << session.errors());
  CHECK(is_felt);
  CHECK(session.bridges().empty());
  CHECK(hand->is_limp());
  CHECK(session.exit_code() == 0);
  const std::string verdict = summary["verdict"]["text"];
  CHECK_MESSAGE(has(verdict, "followed the hand in "), verdict);
  CHECK(summary["contact_ticks"] > 100);
  CHECK(summary["ending"]["last_force_n"] == 0.0);
  if (!device.has_force) {
    CHECK(summary["largest_force_n"] == 0.0);
    return;
  }
  // An arm's force is known by the steps of its currents and encoders.
  const bool is_arm = hand->settling_s() > 0;
  if (is_felt)
    judge_wire(felt, limits_of_run(session), hand->stiffness_n_per_m(), is_arm ? 0.05 : 0.02);
}

}  // namespace

TEST_SUITE_BEGIN("bridges.sessions");

TEST_CASE("from list to a felt peg, each device that people own") {
  for (const OwnedDevice& device : kOwned) {
    CAPTURE(std::string(device.title));
    feel_in_one_session(device);
  }
}

TEST_CASE("a service of Haply that no public source describes is listed with a sentence") {
  const std::unique_ptr<EmulatedHand> hand = make_haply_hand("3.0.7.0");
  if (!hand->absence().empty()) {
    MESSAGE("skipped: " << hand->absence());
    return;
  }
  DeviceSession session(*hand);
  const json listed = session.list();
  REQUIRE(listed.is_object());
  bool is_said = false;
  for (const json& absent : listed["absent"])
    is_said = is_said || (absent["bridge"] == "haply" && has(absent["why"], "3.0.7.0") &&
                          has(absent["why"], "install 3.1 or 3.5"));
  CHECK(is_said);
}

TEST_SUITE_END();
