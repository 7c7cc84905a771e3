// SPDX-License-Identifier: Apache-2.0
// A link without a bus: the peer is the test itself, in real time. Nothing is asked of how long
// anything takes.
#include <doctest/doctest.h>

#include <algorithm>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/local_link.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr int kMostTurns = 5000;

/// At rest at the origin; drives follow what is asked at once.
class StillPeer final : public LocalPeer {
 public:
  HalStatus plug(std::int64_t now_ns) noexcept override {
    plugs += 1;
    due_ns_ = now_ns;
    return HalStatus::kOk;
  }
  HalStatus control(const ControlRequest& /*request*/, std::span<std::uint8_t> bytes,
                    std::size_t& moved) noexcept override {
    if (!answers) return HalStatus::kTimeout;
    encode(ReferenceBlock{}, bytes.first<kReferenceBlockBytes>());
    moved = kReferenceBlockBytes;
    return HalStatus::kOk;
  }
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override { return due_ns_; }
  std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                     std::int64_t& sampled_ns) noexcept override {
    if (now_ns < due_ns_) return 0;
    if (sampled != nullptr) sampled_ns = sampled(now_ns);
    due_ns_ = now_ns + kPeriod_ns;
    ReferenceReport r;
    r.sequence = ++reports;
    r.status = kReferenceCalibrated;
    if (last.drives_on) r.status |= kReferenceDrivesOn;
    r.accepted_sequence = last.sequence;
    r.accepted_tick = last.tick;
    encode(r, bytes.first<kReferenceReportBytes>());
    return kReferenceReportBytes;
  }
  void command(std::int64_t /*now_ns*/, std::span<const std::uint8_t> bytes) noexcept override {
    if (deaf) return;
    if (decode(bytes, last) == CodecVerdict::kOk) commands += 1;
    most_z = std::max(most_z, last.force[2]);
  }

  [[nodiscard]] bool gone() const noexcept override { return is_gone; }

  bool answers = true, deaf = false, is_gone = false;
  std::int64_t (*sampled)(std::int64_t now_ns) = nullptr;  ///< null: now
  std::uint32_t plugs = 0, reports = 0, commands = 0;
  std::int32_t most_z = 0;
  ReferenceCommand last;

 private:
  std::int64_t due_ns_ = 0;
};

LinkSettings link_settings() {
  LinkSettings settings;
  settings.limits = limits_of(reference_capabilities(), kPeriod_ns);
  settings.retry_ns = 0;
  return settings;
}

struct Bench {
  StillPeer peer;
  ReferenceDriver driver;
  MailboxMemory mailbox;
  ServoSide servo{mailbox};
  LinkSettings settings = link_settings();
  LocalLink link{driver, mailbox, peer, settings};
  DeviceCommand command;

  /// A turn, with a fresh command of `force_n` along z before it.
  HalStatus turn(double force_n, unsigned arming) {
    command.tick += 1;
    command.stamp_ns = monotonic_ns();
    command.sequence = servo.state().sequence;
    command.wrench_d.force_n[2] = static_cast<Real>(force_n);
    command.arming = arming;
    servo.publish(command);
    return link.poll(kPeriod_ns / 2);
  }
  /// The force of the last command that the peer has [N].
  [[nodiscard]] double force_n() const { return peer.last.force[2] * kReferenceForceUnit_n; }
};

}  // namespace

TEST_SUITE("hal.local_link") {
  TEST_CASE("reports come in, a force goes out once armed, and the end is at zero") {
    Bench b;
    CHECK(b.link.state() == LinkState::kAbsent);
    for (int k = 0; k < kMostTurns && b.link.state() != LinkState::kReady; ++k)
      CHECK(b.turn(0, 0) == HalStatus::kOk);
    REQUIRE(b.link.state() == LinkState::kReady);
    CHECK(b.link.trouble().empty());
    for (int k = 0; k < 20; ++k) b.turn(2.0, 0);  // not armed: nothing
    CHECK(b.peer.most_z == 0);
    for (unsigned k = 0; k < kMostTurns && b.force_n() < 1.999; ++k) b.turn(2.0, 1 + k / 500);
    CHECK(b.force_n() == doctest::Approx(2.0).epsilon(1e-3));
    CHECK(b.servo.state().link == LinkState::kReady);

    b.link.close();
    CHECK(b.force_n() == 0);
    CHECK(b.link.state() == LinkState::kAbsent);
    const LinkCounters counters = b.link.counters();
    CHECK(counters.connects == 1);
    CHECK(counters.disconnects == 0);
    CHECK(counters.states == b.peer.reports);
    CHECK(counters.sent == b.peer.commands);
  }

  TEST_CASE("a peer that does not start is reported and tried again") {
    Bench b;
    b.peer.answers = false;
    CHECK(b.link.poll(kPeriod_ns) == HalStatus::kTimeout);
    CHECK(b.link.state() == LinkState::kAbsent);
    CHECK_FALSE(b.link.trouble().empty());
    b.peer.answers = true;
    CHECK(b.link.poll(kPeriod_ns) == HalStatus::kOk);
    CHECK(b.peer.plugs == 2);
    CHECK(b.link.trouble().empty());
  }

  TEST_CASE("cancelled, nothing is opened until the link was closed; then again") {
    Bench b;
    b.link.cancel();
    (void)b.link.poll(kPeriod_ns);
    CHECK(b.peer.plugs == 0);
    b.link.close();
    CHECK(b.link.poll(kPeriod_ns) == HalStatus::kOk);
    CHECK(b.peer.plugs == 1);
  }

  TEST_CASE("a servo process that is lost: to zero, until another has armed again") {
    Bench b;
    for (unsigned k = 0; k < kMostTurns && b.force_n() < 1.9; ++k) b.turn(2.0, 1 + k / 500);
    REQUIRE(b.force_n() >= 1.9);
    b.link.servo_lost();
    MailboxMemory other;
    b.link.use_mailbox(other);
    for (int k = 0; k < kMostTurns && b.force_n() > 0; ++k) (void)b.link.poll(kPeriod_ns / 2);
    CHECK(b.force_n() == 0);
    CHECK((ServoSide(other).state().faults & kLinkServoLost) != 0);
  }

  TEST_CASE(
      "deaf: told after ten reports, ramped on our side, and the status keeps to the device") {
    Bench b;
    for (unsigned k = 0; k < kMostTurns && b.force_n() < 1.9; ++k) b.turn(2.0, 1 + k / 500);
    REQUIRE(b.force_n() >= 1.9);
    CHECK(b.link.held().force_n == doctest::Approx(b.force_n()).epsilon(0.1));
    const double has_n = b.force_n();
    b.peer.deaf = true;
    const std::uint32_t begin = b.peer.reports;
    const auto is_deaf = [&b] { return (b.servo.state().faults & kLinkDeaf) != 0; };
    for (int k = 0; k < kMostTurns && !is_deaf(); ++k) b.turn(2.0, 1);
    REQUIRE(is_deaf());
    CHECK(b.peer.reports - begin >= 10);
    CHECK(b.peer.reports - begin <= 13);
    for (int k = 0; k < 200; ++k) b.turn(2.0, 1);
    CHECK(b.link.held().force_n >= has_n - 1e-9);  // it has never said that it let go
    b.peer.deaf = false;
    for (int k = 0; k < kMostTurns && b.force_n() > 0; ++k) b.turn(2.0, 1);
    CHECK(b.force_n() == 0);  // the ramp had ended meanwhile, and nothing old was kept for it
    for (int k = 0; k < 20; ++k) b.turn(2.0, 1);
    CHECK(b.link.held().force_n == 0);
    CHECK_FALSE(is_deaf());
    CHECK(b.force_n() == 0);  // until armed again
    for (unsigned k = 0; k < kMostTurns && b.force_n() < 1.9; ++k) b.turn(2.0, 20 + k / 500);
    CHECK(b.force_n() >= 1.9);
  }

  TEST_CASE(
      "a peer deaf for a few reports of a ramp hears a step again, and not all that it missed") {
    // 9 N let go: 2 N a period, all of it within the five reports that the peer is deaf.
    constexpr double kMostStep_n = 2 * 2.0 + 0.01;
    for (const int deaf_reports : {3, 5, 8}) {
      CAPTURE(deaf_reports);
      Bench b;
      for (unsigned k = 0; k < kMostTurns && b.force_n() < 8.999; ++k) b.turn(9.0, 1 + k / 500);
      REQUIRE(b.force_n() == doctest::Approx(9.0).epsilon(1e-3));
      const std::uint32_t until = b.peer.reports + static_cast<std::uint32_t>(deaf_reports);
      b.peer.deaf = true;
      for (int k = 0; k < kMostTurns && b.peer.reports < until; ++k) b.turn(0, b.command.arming);
      b.peer.deaf = false;
      double last_n = b.force_n(), largest_n = 0;
      CHECK(last_n == doctest::Approx(9.0).epsilon(1e-3));
      for (int k = 0; k < kMostTurns && last_n > 0; ++k) {
        b.turn(0, b.command.arming);
        largest_n = std::max(largest_n, last_n - b.force_n());
        CHECK(b.force_n() <= last_n);
        last_n = b.force_n();
      }
      CHECK(last_n == 0);
      CHECK(largest_n <= kMostStep_n);
      CHECK(largest_n > 1);
    }
  }

  TEST_CASE("a report's own time: not beyond now, as old as it says, and silence where it stands") {
    Bench b;
    for (int k = 0; k < kMostTurns && b.link.state() != LinkState::kReady; ++k) b.turn(0, 0);
    b.peer.sampled = [](std::int64_t now_ns) { return now_ns + 1'000'000'000; };
    for (int k = 0; k < 20; ++k) b.turn(0, 0);
    CHECK(b.servo.state().stamp_ns <= monotonic_ns());
    b.peer.sampled = [](std::int64_t now_ns) { return now_ns - 3'000'000; };
    for (int k = 0; k < 20; ++k) b.turn(0, 0);
    CHECK(monotonic_ns() - b.servo.state().stamp_ns >= 3'000'000);
    b.peer.sampled = [](std::int64_t) { return std::int64_t{1}; };
    const std::int64_t stands_ns = b.servo.state().stamp_ns;
    const auto is_silent = [&b] { return (b.servo.state().faults & kLinkSilent) != 0; };
    for (int k = 0; k < kMostTurns && !is_silent(); ++k) b.turn(0, 0);
    CHECK(is_silent());
    CHECK(b.servo.state().stamp_ns == stands_ns);
  }
}
