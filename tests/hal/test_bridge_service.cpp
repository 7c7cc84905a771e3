// SPDX-License-Identifier: Apache-2.0
// A device behind a bridge, with a host that does as it should and one that does not: the force
// goes off whenever the host, its commands or the device itself are no longer to be relied upon.
#include <doctest/doctest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hal/bridge/bridge_service.hpp"
#include "hal/bridge/bridge_units.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/process_peer.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr int kPatience = 20'000;  // of half a millisecond each: patience, not a time

/// A device in memory, as the test wants it.
class PlayedDevice final : public BridgedDevice {
 public:
  PlayedDevice() {
    facts_.name = "played device";
    DeviceCapabilities& c = facts_.capabilities;
    c.sensed_dof = c.driven_dof = kDofAll;
    c.max_force_n = 8;
    c.max_torque_nm = 0.2_r;
    c.report_period_ns = 1'000'000;
    sample_.calibrated = true;
    sample_.pose_dh.p_m[0] = 0.01_r;
  }
  bool open(std::string& why) override {
    const std::lock_guard lock(mutex_);
    why = "it is not plugged in";
    opened_ += there_ ? 1 : 0;
    return there_;
  }
  const BridgeFacts& facts() const override { return facts_; }
  BridgeRead read(std::int64_t now_ns, BridgeSample& sample) override {
    const std::lock_guard lock(mutex_);
    if (!there_) return BridgeRead::kLost;
    sample = sample_;
    sample.sampled_ns = now_ns;
    return says_;
  }
  bool write(std::int64_t, const Wrench& wrench_d) override {
    const std::lock_guard lock(mutex_);
    if (!takes_) return false;
    force_n_ = wrench_d.force_w.x();
    ++writes_;
    return true;
  }
  bool release(std::int64_t) override {
    const std::lock_guard lock(mutex_);
    if (!takes_) return false;
    force_n_ = 0;
    ++releases_;
    return true;
  }
  void close() noexcept override { ++closes_; }

  // The test's side.
  void be_there(bool there) {
    set([&] { there_ = there; });
  }
  void say(BridgeRead says) {
    set([&] { says_ = says; });
  }
  void take(bool takes) {
    set([&] { takes_ = takes; });
  }
  void sample(const BridgeSample& sample) {
    set([&] { sample_ = sample; });
  }
  [[nodiscard]] double force_n() { return get(force_n_); }
  [[nodiscard]] int releases() { return get(releases_); }
  [[nodiscard]] int writes() { return get(writes_); }
  [[nodiscard]] int opened() { return get(opened_); }

 private:
  template <typename Change>
  void set(const Change& change) {
    const std::lock_guard lock(mutex_);
    change();
  }
  template <typename Value>
  Value get(const Value& value) {
    const std::lock_guard lock(mutex_);
    return value;
  }

  std::mutex mutex_;
  BridgeFacts facts_;
  BridgeSample sample_;
  BridgeRead says_ = BridgeRead::kNew;
  bool there_ = true, takes_ = true;
  double force_n_ = 0;
  int writes_ = 0, releases_ = 0, opened_ = 0;
  std::atomic<int> closes_{0};
};

/// The service on a thread of its own.
struct ServedBridge {
  explicit ServedBridge(std::int64_t watchdog_ns = 20'000'000) {
    static std::atomic<int> count{0};
    settings.path =
        "/tmp/haptic_bridge_" + std::to_string(getpid()) + "_" + std::to_string(count++);
    settings.watchdog_ns = watchdog_ns;
    settings.again_ns = 5'000'000;
    settings.say = [this](const std::string& line) {
      const std::lock_guard lock(mutex);
      lines.push_back(line);
    };
    thread = std::thread([this] { result = serve_bridge(device, settings, stop); });
  }
  ~ServedBridge() { end(); }
  ServedBridge(const ServedBridge&) = delete;
  ServedBridge& operator=(const ServedBridge&) = delete;
  void end() {
    stop.store(true);
    if (thread.joinable()) thread.join();
  }
  [[nodiscard]] bool said(const std::string& text) {
    const std::lock_guard lock(mutex);
    for (const std::string& line : lines) {
      if (line.find(text) != std::string::npos) return true;
    }
    return false;
  }

  PlayedDevice device;
  BridgeSettings settings;
  std::mutex mutex;
  std::vector<std::string> lines;
  std::atomic<bool> stop{false};
  int result = -1;
  std::thread thread;
};

template <typename Condition>
bool bridge_comes(const Condition& condition) {
  for (int k = 0; k < kPatience; ++k) {
    if (condition()) return true;
    usleep(500);
  }
  return false;
}

/// Driver and peer as a link has them.
class BridgeHost final : UsbPort {
 public:
  explicit BridgeHost(const std::string& path) : peer_(path) {}

  [[nodiscard]] bool connect() {
    return bridge_comes([&] {
      return peer_.plug(monotonic_ns()) == HalStatus::kOk && driver.start(*this) == HalStatus::kOk;
    });
  }
  /// A report, and the answer to it. False: none came.
  bool turn(double force_n) {
    std::uint8_t bytes[kMaxReportBytes];
    std::int64_t sampled_ns = 0;
    const std::size_t size = peer_.report(monotonic_ns(), bytes, sampled_ns);
    if (size == 0 ||
        driver.read(std::span(bytes).first(size), sampled_ns, state) != ReportVerdict::kState)
      return false;
    command(force_n);
    return true;
  }
  void command(double force_n) {
    Wrench wrench, delivered;
    wrench.force_w.x() = static_cast<Real>(force_n);
    std::uint8_t bytes[kMaxReportBytes];
    const std::size_t size = driver.write(wrench, ++tick_, bytes, delivered);
    if (size > 0) peer_.command(monotonic_ns(), std::span(bytes).first(size));
  }
  /// Until the drives are on and the device has the force.
  bool push(PlayedDevice& device, double force_n) {
    return bridge_comes([&] {
      turn(driver.receipt().drives_on ? force_n : 0);
      return std::abs(device.force_n() - force_n) < 2.0e-5;
    });
  }
  void go() { peer_.unplug(); }
  [[nodiscard]] bool gone() {
    peer_.wait(monotonic_ns() + 1'000'000);
    return peer_.gone();
  }

  ReferenceDriver driver;
  DeviceState state;

 private:
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned) noexcept override {
    return peer_.control(request, bytes, moved);
  }
  HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  bool cancelled() const noexcept override { return false; }

  ProcessPeer peer_;
  std::uint64_t tick_ = 0;
};

constexpr double kBridgePush_n = 3;

}  // namespace

TEST_SUITE("hal.bridge_service") {
  TEST_CASE("a device behind a bridge states itself, is felt, and lets go at the end") {
    ServedBridge served;
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    CHECK(host.driver.capabilities().max_force_n == doctest::Approx(8));
    CHECK(host.driver.capabilities().watchdog_ns == 20'000'000);
    REQUIRE(host.push(served.device, kBridgePush_n));
    CHECK(host.state.pose_dh.p_m[0] == doctest::Approx(0.01));
    CHECK(host.state.link == LinkState::kReady);
    served.end();
    CHECK(served.result == 0);
    CHECK(served.device.force_n() == 0);
    CHECK(served.device.releases() > 0);
    CHECK(served.said("played device is there"));
  }

  TEST_CASE("commands that stop cut the force, and none comes back without a word of the host") {
    ServedBridge served;
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    REQUIRE(host.push(served.device, kBridgePush_n));
    CHECK(bridge_comes([&] { return served.device.force_n() == 0; }));
    const int writes = served.device.writes();
    CHECK(bridge_comes(
        [&] { return host.turn(kBridgePush_n) && (host.state.faults & kDeviceWatchdogCut) != 0; }));
    for (int k = 0; k < 20; ++k) host.command(kBridgePush_n);
    CHECK(served.device.writes() == writes);
    CHECK(host.push(served.device, kBridgePush_n));  // the driver acknowledges, and begins at zero
  }

  TEST_CASE("a host that goes takes its force with it") {
    ServedBridge served(1'000'000'000);
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    REQUIRE(host.push(served.device, kBridgePush_n));
    host.go();
    CHECK(bridge_comes([&] { return served.device.force_n() == 0; }));
  }

  TEST_CASE("a device that is unplugged sends its host away, and comes back") {
    ServedBridge served;
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    served.device.be_there(false);
    CHECK(bridge_comes([&] { return host.gone(); }));
    CHECK(bridge_comes([&] { return served.said("it is not plugged in"); }));
    served.device.be_there(true);
    REQUIRE(host.connect());
    CHECK(host.push(served.device, kBridgePush_n));
    CHECK(served.device.opened() == 2);
  }

  TEST_CASE("a device that takes no command accepts none, and is silent with a force taken away") {
    ServedBridge served;
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    REQUIRE(host.push(served.device, kBridgePush_n));
    served.device.take(false);
    for (int k = 0; k < 100; ++k) {
      host.turn(0);
      usleep(500);
    }
    CHECK(served.device.force_n() == doctest::Approx(kBridgePush_n));
    CHECK(host.driver.receipt().drives_on);  // by the last report, before it became silent
    CHECK(is_newer(host.driver.receipt().sent, host.driver.receipt().accepted));
    CHECK_FALSE(host.turn(0));
    served.device.take(true);
    CHECK(bridge_comes([&] { return served.device.force_n() == 0; }));
    CHECK(bridge_comes([&] { return host.turn(0); }));
    CHECK((host.state.faults & (kDeviceDriveFault | kDeviceWatchdogCut)) != 0);
    CHECK(host.push(served.device, kBridgePush_n));
  }

  TEST_CASE("silence is no report, and does not keep the force on") {
    ServedBridge served;
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    REQUIRE(host.push(served.device, kBridgePush_n));
    served.device.say(BridgeRead::kSilent);
    CHECK(bridge_comes([&] { return served.device.force_n() == 0; }));
    usleep(5000);
    while (host.turn(0)) {
    }
    usleep(5000);
    CHECK_FALSE(host.turn(0));
    served.device.say(BridgeRead::kSame);
    CHECK_FALSE(host.turn(0));  // silent until there is something new
    served.device.say(BridgeRead::kNew);
    CHECK(host.push(served.device, kBridgePush_n));
  }

  TEST_CASE("a pose that is none is not reported, and many of them are no device") {
    ServedBridge served;
    BridgeHost host(served.settings.path);
    REQUIRE(host.connect());
    BridgeSample sample;
    sample.calibrated = true;
    sample.pose_dh.p_m[1] = std::numeric_limits<Real>::quiet_NaN();
    served.device.sample(sample);
    CHECK(bridge_comes([&] { return host.gone(); }));
    CHECK(bridge_comes([&] { return served.said("played device sends what is no pose"); }));
  }

  TEST_CASE("sample_of: refuses what is no pose, keeps a twist out that is none") {
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    haptic_sample made{};
    BridgeSample sound;
    sound.twist_valid = true;
    sound.twist_d.linear_m_per_s[2] = -0.5_r;
    REQUIRE(sample_of(sound, made));
    CHECK(made.velocity_um_per_s[2] == -500'000);
    CHECK(made.orientation[3] == 1 << 30);
    CHECK(made.twist_is_missing == 0);
    const auto refuses = [&](const auto& change) {
      BridgeSample bad = sound;
      change(bad);
      return !sample_of(bad, made);
    };
    CHECK(refuses([&](BridgeSample& s) { s.pose_dh.q_xyzw[0] = nan; }));
    CHECK(refuses([&](BridgeSample& s) { s.pose_dh.q_xyzw[3] = 0; }));
    CHECK(refuses([&](BridgeSample& s) { s.pose_dh.q_xyzw[3] = 1.0e6_r; }));
    CHECK(refuses([&](BridgeSample& s) { s.pose_dh.p_m[0] = 2.1_r; }));
    CHECK(refuses(
        [&](BridgeSample& s) { s.pose_dh.p_m[0] = -std::numeric_limits<Real>::infinity(); }));
    BridgeSample torn = sound;
    torn.twist_d.angular_rad_per_s[0] = nan;
    REQUIRE(sample_of(torn, made));
    CHECK(made.twist_is_missing == 1);
    CHECK(made.velocity_um_per_s[2] == 0);
  }

  TEST_CASE("facts_of: within the ranges of the protocol, and nothing is driven without a limit") {
    DeviceCapabilities c;
    c.sensed_dof = kDofAll;
    c.driven_dof = kDofAll;
    c.max_force_n = 3;
    c.max_stiffness_n_per_m = 1.0e9_r;
    c.encoder_step_m = std::numeric_limits<Real>::quiet_NaN();
    const haptic_facts facts = facts_of(c, 5'000'000'000);
    CHECK(facts.driven_dof == kDofTranslation);
    CHECK(facts.max_force == 300'000);
    CHECK(facts.max_stiffness_mn_per_m == std::numeric_limits<std::uint32_t>::max());
    CHECK(facts.encoder_step_nm == 0);
    CHECK(facts.report_period_us == 100);
    CHECK(facts.watchdog_ms == 1000);
    CHECK(facts_of(c, 0).watchdog_ms == 1);
    CHECK(facts.name[0] == 0);
    CHECK(facts.latency_us == 0);
  }

  TEST_CASE("facts_of, sample_of: what 1.1 adds, and what is none of it") {
    DeviceCapabilities c;
    c.sensed_dof = c.driven_dof = kDofAll;
    c.max_force_n = 3;
    c.name = device_text("Desk arm");
    c.serial.fill('7');  // without an end
    c.latency_ns = 1'500'000;
    c.largest_gap_m = 0.07_r;
    haptic_facts facts = facts_of(c, 20'000'000);
    CHECK(std::string(facts.name) == "Desk arm");
    CHECK(facts.serial[0] == 0);
    CHECK(facts.latency_us == 1500);
    CHECK(facts.largest_gap_um == 70'000);
    CHECK(facts.is_displacement == 0);
    c.latency_ns = std::numeric_limits<std::int64_t>::max();
    c.largest_gap_m = std::numeric_limits<Real>::quiet_NaN();
    c.is_displacement = true;
    facts = facts_of(c, 20'000'000);
    CHECK(facts.latency_us == 100'000);
    CHECK(facts.largest_gap_um == 0);
    CHECK(facts.is_displacement == 1);
    CHECK(facts.driven_dof == 0);  // nothing pushes against springs
    c.largest_gap_m = 5;
    c.latency_ns = -1;
    facts = facts_of(c, 20'000'000);
    CHECK(facts.largest_gap_um == 1'000'000);
    CHECK(facts.latency_us == 0);

    BridgeSample sample;
    sample.pose_dh.q_xyzw[3] = 1;
    haptic_sample made{};
    for (const Real none : {-1.0_r, std::numeric_limits<Real>::quiet_NaN()}) {
      sample.gap_m = none;
      REQUIRE(sample_of(sample, made));
      CHECK(made.gap_is_measured == 0);
    }
    sample.gap_m = 0.025_r;
    REQUIRE(sample_of(sample, made));
    CHECK(made.gap_is_measured == 1);
    CHECK(made.gap_um == 25'000);
  }
}
