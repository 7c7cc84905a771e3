// SPDX-License-Identifier: Apache-2.0
#include "tests/hal/link_bench.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "hal/device_limits.hpp"
#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/polhem_driver.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/spacemouse_driver.hpp"
#include "hal/usb/report_flow.hpp"
#include "tests/hal/falcon_counterpart.hpp"
#include "tests/hal/polhem_counterpart.hpp"
#include "tests/support/force_monitor.hpp"
#include "tests/support/spacemouse_counterpart.hpp"

namespace haptic::test {
namespace {

using hal::HalStatus;

constexpr std::int64_t kLoopPeriod_ns = 1'000'000;
// A look at the clock while a report-clocked link waits for its answer.
constexpr std::int64_t kLook_ns = 2'000, kAnswerWait_ns = 200'000;
// Of a command's age: a little time passes between the guard's look at the clock and ours.
constexpr std::int64_t kAgeSlack_ns = 100'000;

/// The script: zeros beyond its end.
class Script {
 public:
  explicit Script(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  std::span<const std::uint8_t> take(std::size_t count) {
    const auto taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  std::uint64_t number(std::size_t bytes) {
    std::uint64_t value = 0;
    unsigned shift = 0;
    for (const std::uint8_t byte : take(bytes)) {
      value |= std::uint64_t{byte} << shift;
      shift += 8;
    }
    return value;
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(number(1)); }
  int small() { return static_cast<std::int8_t>(byte()); }

 private:
  std::span<const std::uint8_t> rest_;
};

/// What the device says when asked to, and what it makes of a command. Troubles are bits; which
/// mean what differs.
class PlayedDevice {
 public:
  virtual ~PlayedDevice() = default;
  [[nodiscard]] virtual hal::Driver& driver() = 0;
  [[nodiscard]] virtual hal::UsbPort& port() = 0;
  virtual void power_up() {}
  /// Another of its kind, with other limits, comes in its place.
  virtual void exchange() {}
  virtual std::vector<std::uint8_t> report(std::uint8_t troubles, int motion, bool pressed) = 0;
  /// A report reached the host and was taken for a state.
  virtual void heard(std::span<const std::uint8_t> /*report*/) {}
  virtual void take(std::span<const std::uint8_t> /*command*/) {}
  /// The command asks for the drives, or lets a motor act.
  [[nodiscard]] virtual bool drives(std::span<const std::uint8_t> command) const = 0;
  /// By its last report it may be driven, where it says more than whether it is ready.
  [[nodiscard]] virtual bool may_be_driven() const { return true; }
  [[nodiscard]] virtual Real force_unit_n() const { return 0; }
  [[nodiscard]] virtual Real torque_unit_nm() const { return 0; }
  /// Where whole motor values mean more force the nearer the arm is to being stretched.
  [[nodiscard]] virtual Real coarsest_unit_n() const { return 0; }
};

/// Answers the request for the block of the reference device.
class BlockPort final : public hal::UsbPort {
 public:
  hal::ReferenceBlock block;

  HalStatus control(const hal::ControlRequest&, std::span<std::uint8_t> bytes, std::size_t& moved,
                    unsigned) noexcept override {
    std::array<std::uint8_t, hal::kReferenceBlockBytes> answer{};
    hal::encode(block, answer);
    moved = std::min(answer.size(), bytes.size());
    std::copy_n(answer.begin(), moved, bytes.begin());
    return HalStatus::kOk;
  }
  HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  HalStatus read(std::span<std::uint8_t>, std::size_t& moved, unsigned) noexcept override {
    moved = 0;
    return HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }
};

/// Of axes the block says nothing: variant 3 has them from its settings.
constexpr unsigned kWithAxes = 3, kVariants = 8;

hal::ReferenceBlock stated(unsigned variant) {
  hal::ReferenceBlock block;
  switch (variant) {
    case 1:  // 1 N, 50 N/s
      block.max_force = 100'000;
      block.max_torque = 200'000;
      block.max_force_rate_mn_per_s = 50'000;
      block.max_torque_rate_mnm_per_s = 1'000;
      break;
    case 2:
      block.max_force_rate_mn_per_s = block.max_torque_rate_mnm_per_s = 0;
      break;
    case 4:
      block.report_period_us = 2000;
      break;
    case 5:
      block.driven_dof = hal::kDofX | hal::kDofZ;
      break;
    case 6:
      block.report_period_us = 500;
      block.watchdog_ms = 10;
      break;
    case 7:  // 1 kN, 1 MN/s
      block.max_force = 100'000'000;
      block.max_force_rate_mn_per_s = 1'000'000'000;
      break;
    default:
      break;
  }
  return block;
}

/// Troubles: 0 emergency stop, 1 watchdog cut, 2 overheated, 3 drives drop, 4 no twist, 5 the
/// sequence stands still, 6 calibration lost, 7 a command refused.
class PlayedReference final : public PlayedDevice {
 public:
  explicit PlayedReference(unsigned variant) : driver_(settings(variant)), variant_(variant) {
    port_.block = stated(variant);
  }
  hal::Driver& driver() override { return driver_; }
  hal::UsbPort& port() override { return port_; }
  void power_up() override {
    said_ = hal::ReferenceReport{};
    drives_on_ = may_be_driven_ = false;
  }
  void exchange() override {
    variant_ = (variant_ + 1) % kVariants;
    port_.block = stated(variant_);
  }
  std::vector<std::uint8_t> report(std::uint8_t troubles, int motion, bool pressed) override {
    const auto trouble = [&](unsigned bit) { return (unsigned{troubles} >> bit & 1u) != 0; };
    if (trouble(0) || trouble(1) || trouble(3) || trouble(6)) drives_on_ = false;
    if (!trouble(5)) ++said_.sequence;
    if (trouble(7)) ++said_.rejected;
    said_.position[0] += motion * 20'000;
    said_.switches = pressed ? 1 : 0;
    unsigned status = trouble(6) ? 0 : hal::kReferenceCalibrated;
    if (drives_on_) status |= hal::kReferenceDrivesOn;
    if (!trouble(4)) status |= hal::kReferenceTwistValid;
    if (trouble(1)) status |= hal::kReferenceWatchdogCut;
    if (trouble(0)) status |= hal::kReferenceEmergencyStop;
    said_.status = static_cast<std::uint8_t>(status);
    said_.faults = trouble(2) ? kDeviceOverheated : 0u;
    std::vector<std::uint8_t> bytes(hal::kReferenceReportBytes);
    hal::encode(said_, std::span<std::uint8_t, hal::kReferenceReportBytes>(bytes));
    return bytes;
  }
  void heard(std::span<const std::uint8_t> report) override {
    hal::ReferenceReport r;
    if (hal::decode(report, r) != hal::CodecVerdict::kOk) return;
    constexpr unsigned kStopped = hal::kReferenceWatchdogCut | hal::kReferenceEmergencyStop;
    constexpr std::uint32_t kWrong = kDeviceWatchdogCut | kDeviceEmergencyStop | kDeviceNotHomed;
    may_be_driven_ = (r.status & hal::kReferenceCalibrated) != 0 && (r.status & kStopped) == 0 &&
                     (r.faults & kWrong) == 0;
  }
  void take(std::span<const std::uint8_t> command) override {
    hal::ReferenceCommand c;
    if (hal::decode(command, c) != hal::CodecVerdict::kOk) return;
    if (!hal::is_newer(c.sequence, said_.accepted_sequence)) {
      ++said_.rejected;
      return;
    }
    said_.accepted_sequence = c.sequence;
    said_.accepted_tick = c.tick;
    drives_on_ = c.drives_on;
  }
  [[nodiscard]] bool drives(std::span<const std::uint8_t> command) const override {
    hal::ReferenceCommand c;
    return hal::decode(command, c) == hal::CodecVerdict::kOk && c.drives_on;
  }
  [[nodiscard]] bool may_be_driven() const override { return may_be_driven_; }
  // Half a unit for each component, and one below the largest.
  [[nodiscard]] Real force_unit_n() const override { return 4.0e-5_r; }
  [[nodiscard]] Real torque_unit_nm() const override { return 4.0e-7_r; }

 private:
  static hal::ReferenceSettings settings(unsigned variant) {
    hal::ReferenceSettings its;
    its.ask_device = variant != kWithAxes;
    if (its.ask_device) return its;
    its.capabilities.max_axis_force_n = Vec3(2, 0, 3);
    its.capabilities.max_axis_torque_nm = Vec3(0, 0.01_r, 0);
    return its;
  }
  hal::ReferenceDriver driver_;
  BlockPort port_;
  unsigned variant_;
  hal::ReferenceReport said_;
  bool drives_on_ = false, may_be_driven_ = false;
};

/// Troubles: 0 counts that no position fits, 6 homing lost, 7 a packet cut.
class PlayedFalcon final : public PlayedDevice {
 public:
  PlayedFalcon() : driver_(hal::FalconSettings{}) { power_up(); }
  hal::Driver& driver() override { return driver_; }
  hal::UsbPort& port() override { return port_; }
  void power_up() override { port_.power_up_loaded(); }
  std::vector<std::uint8_t> report(std::uint8_t troubles, int motion, bool pressed) override {
    const auto trouble = [&](unsigned bit) { return (unsigned{troubles} >> bit & 1u) != 0; };
    at_m_ = std::clamp(at_m_ + 20.0e-6 * motion, -0.02, 0.02);
    hal::FalconAngles angles{};
    hal::FalconReport said;
    if (arm_.angles_at({at_m_, -0.5 * at_m_, hal::kFalconCentre_m + at_m_}, angles))
      said.counts = arm_.counts_of(angles);
    if (trouble(0)) said.counts = {30'000, -30'000, static_cast<std::int16_t>(motion * 200)};
    said.homed = trouble(6) ? 3 : 7;
    said.buttons = pressed ? 1 : 0;
    const hal::FalconPacket packet = hal::encode(said);
    const std::size_t count = packet.size() - (trouble(7) ? 3 : 0);
    std::vector<std::uint8_t> bytes(hal::kFtdiStatusBytes + count);
    bytes[0] = 0x01;
    bytes[1] = 0x60;
    std::copy_n(packet.begin(), count, bytes.begin() + hal::kFtdiStatusBytes);
    return bytes;
  }
  [[nodiscard]] bool drives(std::span<const std::uint8_t> command) const override {
    hal::FalconCommand c;
    return command.size() == hal::kFalconPacketBytes &&
           hal::decode(command.first<hal::kFalconPacketBytes>(), c) &&
           c.motors != std::array<std::int16_t, 3>{};
  }
  [[nodiscard]] Real force_unit_n() const override { return 0.005_r; }
  [[nodiscard]] Real coarsest_unit_n() const override { return 0.25_r; }

 private:
  static constexpr std::size_t kImageBytes = 1000;
  hal::FalconDriver driver_;
  FalconCounterpart port_{kImageBytes};
  hal::FalconKinematics arm_;
  double at_m_ = 0;
};

/// Troubles: 0 far away at once, 6 the calibration switch pressed, 7 a number that is none.
class PlayedPolhem final : public PlayedDevice {
 public:
  hal::Driver& driver() override { return driver_; }
  hal::UsbPort& port() override { return port_; }
  void power_up() override { flagged_ = true; }
  std::vector<std::uint8_t> report(std::uint8_t troubles, int motion, bool /*pressed*/) override {
    const auto trouble = [&](unsigned bit) { return (unsigned{troubles} >> bit & 1u) != 0; };
    if (trouble(6)) flagged_ = true;
    at_ = std::clamp(at_ + motion / 4, -1500, 1500);
    hal::PolhemReport said;
    for (std::size_t i = 0; i < said.counts.size(); ++i) {
      said.counts[i] = static_cast<std::int16_t>(geometry_.calibration_counts[i] +
                                                 (trouble(0) ? motion * 200 : at_));
    }
    said.switch_pressed = flagged_;
    std::vector<std::uint8_t> bytes(hal::kPolhemReportBytes);
    hal::encode(said, std::span<std::uint8_t, hal::kPolhemReportBytes>(bytes));
    if (trouble(7)) bytes[12] = 7;
    return bytes;
  }
  void take(std::span<const std::uint8_t> command) override {
    hal::PolhemCommand c;
    if (hal::decode(command, c) != hal::PolhemVerdict::kOk || !c.set_counts) return;
    at_ = 0;
    flagged_ = false;
  }
  [[nodiscard]] bool drives(std::span<const std::uint8_t> command) const override {
    hal::PolhemCommand c;
    return hal::decode(command, c) == hal::PolhemVerdict::kOk && !c.set_counts &&
           c.currents_ma != std::array<std::int16_t, 3>{};
  }
  [[nodiscard]] Real force_unit_n() const override { return 0.02_r; }
  [[nodiscard]] Real coarsest_unit_n() const override { return 0.25_r; }

 private:
  hal::PolhemDriver driver_;
  hal::PolhemGeometry geometry_;
  PolhemCounterpart port_;
  int at_ = 0;
  bool flagged_ = true;
};

class PlayedSpaceMouse final : public PlayedDevice {
 public:
  hal::Driver& driver() override { return driver_; }
  hal::UsbPort& port() override { return port_; }
  std::vector<std::uint8_t> report(std::uint8_t troubles, int motion, bool pressed) override {
    const auto axis = static_cast<std::int16_t>(motion * 4);
    if ((troubles & 1u) != 0) {
      port_.press(pressed ? 1 : 0);
    } else {
      port_.push({axis, 0, static_cast<std::int16_t>(-axis), 0, axis, 0});
    }
    std::vector<std::uint8_t> bytes(hal::kMaxReportBytes);
    bytes.resize(port_.on_in(bytes));
    return bytes;
  }
  [[nodiscard]] bool drives(std::span<const std::uint8_t> /*command*/) const override {
    return true;  // there is no command for it
  }

 private:
  hal::SpaceMouseDriver driver_;
  SpaceMouseCounterpart port_{true};
};

std::unique_ptr<PlayedDevice> played(BenchDevice kind, unsigned variant) {
  switch (kind) {
    case BenchDevice::kFalcon:
      return std::make_unique<PlayedFalcon>();
    case BenchDevice::kPolhem:
      return std::make_unique<PlayedPolhem>();
    case BenchDevice::kSpaceMouse:
      return std::make_unique<PlayedSpaceMouse>();
    case BenchDevice::kReference:
      break;
  }
  return std::make_unique<PlayedReference>(variant);
}

/// The driver as it is, with a look at what it writes.
class WatchedDriver final : public hal::Driver {
 public:
  WatchedDriver(hal::Driver& driver, LinkBench::Sabotage sabotage)
      : driver_(driver), sabotage_(sabotage) {}
  [[nodiscard]] const hal::UsbProfile& profile() const noexcept override {
    return driver_.profile();
  }
  [[nodiscard]] const hal::DeviceCapabilities& capabilities() const noexcept override {
    return driver_.capabilities();
  }
  [[nodiscard]] HalStatus start(hal::UsbPort& port) noexcept override {
    return driver_.start(port);
  }
  [[nodiscard]] hal::ReportVerdict read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                        DeviceState& state) noexcept override {
    return driver_.read(report, stamp_ns, state);
  }
  [[nodiscard]] std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                  std::span<std::uint8_t> report,
                                  Wrench& delivered_d) noexcept override {
    const Wrench asked_d =
        sabotage_ == LinkBench::Sabotage::kStuck && ++writes_ > 200 ? stuck_d_ : wrench_d;
    const std::size_t size = driver_.write(asked_d, tick, report, delivered_d);
    if (sabotage_ == LinkBench::Sabotage::kLouder) delivered_d.force_w *= 2.0_r;
    if (sabotage_ == LinkBench::Sabotage::kNotFinite && delivered_d.force_w.norm() > 0)
      delivered_d.force_w.y() = std::numeric_limits<Real>::quiet_NaN();
    hal::ReferenceCommand command;
    const auto bytes = report.first(size);
    if (sabotage_ == LinkBench::Sabotage::kDrivesOn &&
        hal::decode(bytes, command) == hal::CodecVerdict::kOk) {
      command.drives_on = true;
      hal::encode(command, bytes.first<hal::kReferenceCommandBytes>());
    }
    if (sabotage_ == LinkBench::Sabotage::kStuck && writes_ == 200) stuck_d_ = delivered_d;
    asked_of_it_d = asked_d;
    written_d = delivered_d;
    written_tick = tick;
    return size;
  }

  [[nodiscard]] std::size_t zero_report(std::span<std::uint8_t> report) const noexcept override {
    return driver_.zero_report(report);
  }

  [[nodiscard]] std::size_t release(std::uint64_t tick,
                                    std::span<std::uint8_t> report) noexcept override {
    asked_of_it_d = written_d = Wrench{};
    written_tick = tick;
    return driver_.release(tick, report);
  }
  [[nodiscard]] bool rest(std::int64_t stamp_ns, DeviceState& state) noexcept override {
    return driver_.rest(stamp_ns, state);
  }

  Wrench asked_of_it_d, written_d;
  std::uint64_t written_tick = 0;

 private:
  hal::Driver& driver_;
  LinkBench::Sabotage sabotage_;
  Wrench stuck_d_;
  unsigned writes_ = 0;
};

bool is_quiet(const Wrench& w) { return w.force_w.isZero(0) && w.torque_w.isZero(0); }

}  // namespace

class LinkBench::Play final : hal::ReportTransfers,
                              hal::LinkObserver,
                              hal::LinkTape,
                              hal::SwitchSource {
 public:
  Play(std::span<const std::uint8_t> script, Sabotage sabotage, BenchCounts& counts)
      : script_(script),
        setup_(script_.byte()),
        device_(played(static_cast<BenchDevice>(setup_ & 3u), setup_ >> 4u & 7u)),
        driver_(device_->driver(), sabotage),
        settings_(settings_of(driver_.capabilities())),
        monitor_(block_of(driver_.capabilities())),
        flow_(driver_, boxes_.front(), settings_),
        counts_(counts) {
    flow_.attach(*this);
    flow_.observe(this);
    flow_.tape(this);
  }

  std::string run() {
    plug();
    while (!script_.empty() && broken_.empty() && ++operations_ < kMostOperations) operate();
    return broken_;
  }

 private:
  static constexpr unsigned kMostOperations = 5000;
  static constexpr std::uint32_t kDeadman = 1;

  hal::LinkSettings settings_of(const hal::DeviceCapabilities& capabilities) {
    hal::LinkSettings settings;
    settings.limits = hal::limits_of(capabilities, kLoopPeriod_ns);
    if ((setup_ & 4u) != 0) settings.answer_wait_ns = kAnswerWait_ns;
    if ((setup_ & 8u) != 0) settings.deadman = kDeadman;
    if ((setup_ & 128u) != 0) {
      settings.switches = this;
      if (settings.deadman != 0) settings.deadman = hal::kInputSwitch;
    }
    settings.slept = [](void* play) { return static_cast<Play*>(play)->slept_ns_; };
    settings.clock = [](void* play) { return static_cast<Play*>(play)->look(); };
    settings.clock_context = this;
    return settings;
  }
  [[nodiscard]] ForceBlock block_of(const hal::DeviceCapabilities& capabilities) const {
    ForceBlock block = ForceBlock::of(capabilities, settings_.limits);
    block.force_unit_n = device_->force_unit_n();
    block.torque_unit_nm = device_->torque_unit_nm();
    return block;
  }
  std::int64_t look() {
    if (settings_.answer_wait_ns > 0) now_ns_ += kLook_ns;
    return now_ns_;
  }

  // The world.
  void operate();
  void beat();
  void say(std::span<const std::uint8_t> report);
  void pass(std::int64_t ns);
  void end_out(bool delivered);
  void plug();
  void replug(std::uint8_t how);
  void publish(DeviceCommand command);
  void publish_sane();
  void publish_hostile();
  void lose_servo(bool with_successor);
  void scribble();

  // When output must not grow: known from what happens around the guard alone.
  void block(const char* cause) {
    cause_ = cause;
    blocked_ = true;
    // Where the newest says nothing, an older one that the link has seen counts; which, is not
    // known.
    least_arming_ = newest_.tick != 0 ? newest_.arming : 0;
  }
  [[nodiscard]] bool is_stale(std::uint32_t periods) const;
  /// The deadman: as reported, or where it is beside the device, as it is.
  [[nodiscard]] bool is_held() const {
    if (settings_.deadman == hal::kInputSwitch) return pedal_;
    return (state_.switches & settings_.deadman) == settings_.deadman;
  }
  void look_at_causes();

  // ReportTransfers.
  std::span<std::uint8_t> out_bytes() noexcept override {
    return std::span(out_).first(driver_.profile().out_bytes);
  }
  [[nodiscard]] bool busy() const noexcept override { return busy_; }
  hal::SendOutcome send(std::size_t bytes) noexcept override {
    if (busy_) return hal::SendOutcome::kBusy;
    if (refused_ > 0) {
      --refused_;
      return hal::SendOutcome::kFailed;
    }
    busy_ = true;
    out_count_ = bytes;
    return hal::SendOutcome::kSent;
  }
  void cancel_out() noexcept override { cancelled_ = true; }
  [[nodiscard]] bool lost() const noexcept override { return false; }
  [[nodiscard]] hal::ZeroCommand zero_target() const noexcept override { return {}; }

  // SwitchSource.
  [[nodiscard]] std::uint32_t pressed() noexcept override {
    return pedal_ ? hal::kInputSwitch : 0u;
  }

  // LinkObserver, LinkTape.
  void on_report(std::int64_t, std::span<const std::uint8_t> report, hal::ReportVerdict verdict,
                 std::uint64_t) noexcept override {
    if (verdict == hal::ReportVerdict::kState) device_->heard(report);
  }
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
               const hal::GuardedOutput& output) noexcept override;
  void on_link(std::int64_t, LinkState, HalStatus) noexcept override {}
  void on_event(const hal::LinkEvent&) noexcept override {}
  void on_state(const DeviceState& state) noexcept override;

  Script script_;
  const unsigned setup_;
  std::unique_ptr<PlayedDevice> device_;
  WatchedDriver driver_;
  hal::LinkSettings settings_;
  ForceMonitor monitor_;
  std::deque<hal::MailboxMemory> boxes_{1};
  hal::ServoSide servo_{boxes_.front()};
  hal::ReportFlow flow_;
  BenchCounts& counts_;

  std::int64_t now_ns_ = 1'000'000'000'000, slept_ns_ = 0;
  unsigned operations_ = 0, op_ = 0;  ///< op_: the one under way
  std::string broken_;
  // The bus.
  std::array<std::uint8_t, hal::kMaxReportBytes> out_{};
  std::size_t out_count_ = 0;
  unsigned refused_ = 0;
  bool connected_ = false, busy_ = false, cancelled_ = false;
  // The servo and the operator.
  DeviceCommand newest_;
  WrenchRecord wanted_d_;
  std::uint64_t tick_ = 0;
  std::uint32_t arming_ = 0;
  bool pressed_ = true, pedal_ = true;
  // What the guard must follow.
  DeviceState state_;
  std::uint64_t last_tick_ = 0;
  std::uint32_t least_arming_ = 0;
  std::uint32_t least_since_send_ = 0, least_since_state_ = 0;
  bool blocked_ = true, resting_ = false;
  const char* cause_ = "not armed";
  bool scribbled_ = false;  ///< newest_ is not known
};

void LinkBench::Play::on_state(const DeviceState& state) noexcept {
  ++counts_.states;
  const std::uint32_t appeared = state.faults & ~state_.faults & ~0xffffu;
  // The same state again, for a fault that came or went, is no new cause.
  const bool fresh = state.sequence != state_.sequence || state.link != state_.link;
  state_ = state;
  if (fresh && state.link != LinkState::kReady) block("not ready");
  if (fresh && !is_held()) block("deadman up");
  // It was latched some time since the last state: where that was armed again meanwhile, it need
  // not hold.
  if (appeared != 0 && newest_.arming <= least_since_state_) block("fault of the link");
  least_since_state_ = newest_.arming;
}

/// Older than the limits allow, or as far in the future that it will not grow old.
bool LinkBench::Play::is_stale(std::uint32_t periods) const {
  if (newest_.tick == 0) return true;
  const std::int64_t most_ns = settings_.limits.period_ns * (1 + periods) + kAgeSlack_ns;
  const auto apart = [](std::int64_t from, std::int64_t to) {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  };
  const auto most = static_cast<std::uint64_t>(most_ns);
  if (newest_.stamp_ns <= now_ns_) return apart(newest_.stamp_ns, now_ns_) > most;
  const auto ahead = static_cast<std::uint64_t>(
      settings_.limits.period_ns * (1 + settings_.limits.held_periods) + kAgeSlack_ns);
  return apart(now_ns_, newest_.stamp_ns) > ahead;
}

/// Causes that are there at the moment of a send.
void LinkBench::Play::look_at_causes() {
  const bool back = driver_.written_tick < last_tick_;  // another servo process
  last_tick_ = driver_.written_tick;
  const bool lost = !scribbled_ && newest_.tick != 0 && is_finite(wrench_of(newest_.wrench_d)) &&
                    is_stale(settings_.limits.lost_periods);
  // Any arming may be read after a scribble: only what is wrong now counts.
  if (scribbled_) blocked_ = false;
  // Where one from the beginning was armed again before anything was sent, it need not hold.
  if (back && newest_.arming <= least_since_send_) block("ticks from the beginning");
  least_since_send_ = newest_.arming;
  if (state_.link != LinkState::kReady) block("not ready");
  if (!is_held()) block("deadman up");
  if (resting_) block("at rest");
  if (lost) block("no command for long");
}

void LinkBench::Play::on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                              const hal::GuardedOutput& /*output*/) noexcept {
  look_at_causes();
  SentCommand sent;
  sent.stamp_ns = stamp_ns;
  sent.wrench_d = driver_.written_d;
  sent.rounding_n = std::min(device_->coarsest_unit_n(),
                             (sent.wrench_d.force_w - driver_.asked_of_it_d.force_w).norm());
  sent.drives_on = device_->drives(report);
  sent.ready = state_.link == LinkState::kReady && device_->may_be_driven();
  sent.blocked = blocked_;
  sent.fading = !scribbled_ && (!is_finite(wrench_of(newest_.wrench_d)) ||
                                is_stale(settings_.limits.held_periods));
  const Wrench& asked_d = driver_.asked_of_it_d;
  const bool withheld =
      sent.wrench_d.force_w.norm() < asked_d.force_w.norm() - device_->force_unit_n() ||
      sent.wrench_d.torque_w.norm() < asked_d.torque_w.norm() - device_->torque_unit_nm();
  sent.cut = withheld || state_.link != LinkState::kReady || (state_.faults & 0xffffu) != 0;
  const std::string rule = monitor_.on_send(sent);
  if (!rule.empty() && broken_.empty())
    broken_ = rule + ", in operation " + std::to_string(operations_) + " (" + std::to_string(op_) +
              (blocked_ ? std::string(", blocked: ") + cause_ + ")" : std::string(")"));
  ++counts_.sends;
  const Real force_n = sent.wrench_d.force_w.norm();
  if (is_quiet(sent.wrench_d)) return;
  ++counts_.pushing;
  if (blocked_) ++counts_.pushing_blocked;
  if (force_n > 0.9_r * settings_.limits.max_force_n) ++counts_.full;
}

void LinkBench::Play::publish(DeviceCommand command) {
  newest_ = command;
  servo_.publish(command);
  if (command.tick == 0) {  // it hides those before, which the link may not have seen
    least_arming_ = least_since_send_ = least_since_state_ = 0;
    return;
  }
  // Armed again: beyond what it was when a cause was there, or began again from a lower count.
  if (blocked_ && command.arming > least_arming_) blocked_ = false;
  least_arming_ = std::min(least_arming_, command.arming);
  least_since_send_ = std::min(least_since_send_, command.arming);
  least_since_state_ = std::min(least_since_state_, command.arming);
}

void LinkBench::Play::publish_sane() {
  DeviceCommand command;
  command.tick = ++tick_;
  command.stamp_ns = now_ns_;
  command.sequence = state_.sequence + 1;
  command.wrench_d = wanted_d_;
  command.arming = arming_;
  publish(command);
}

void LinkBench::Play::publish_hostile() {
  static constexpr Real kLargest = std::numeric_limits<Real>::max();
  static constexpr std::array<Real, 8> kSpecial = {std::numeric_limits<Real>::quiet_NaN(),
                                                   std::numeric_limits<Real>::infinity(),
                                                   kLargest,
                                                   -kLargest,
                                                   std::numeric_limits<Real>::denorm_min(),
                                                   -0.0_r,
                                                   std::numeric_limits<Real>::min(),
                                                   1.0_r};
  const unsigned kinds = script_.byte();
  DeviceCommand command = newest_;
  const unsigned tick = kinds & 3u, stamp = kinds >> 2u & 3u, arming = kinds >> 4u & 3u;
  if (tick == 0) command.tick = newest_.tick + 1;
  if (tick == 1) command.tick = 0;
  if (tick == 2) command.tick = script_.number(8);
  if (tick == 3) command.tick = 1;
  if (stamp == 0) command.stamp_ns = now_ns_;
  if (stamp == 1) command.stamp_ns = static_cast<std::int64_t>(script_.number(8));
  if (stamp == 2) command.stamp_ns = now_ns_ + script_.small() * 1'000'000;
  if (stamp == 3) command.stamp_ns = now_ns_ - script_.byte() * 100'000;
  if (arming == 1) ++command.arming;
  if (arming == 2) command.arming = static_cast<std::uint32_t>(script_.number(4));
  if (arming == 3) command.arming = 0;
  command.sequence = kinds < 128 ? state_.sequence + 1 : script_.number(8);
  const auto component = [&]() -> Real {
    switch (kinds >> 6u) {
      case 0:
        return static_cast<Real>(static_cast<std::int16_t>(script_.number(2)));
      case 1:
        return static_cast<Real>(std::bit_cast<double>(script_.number(8)));
      default:
        return kSpecial[script_.byte() % kSpecial.size()];
    }
  };
  if (kinds >> 6u != 3) {
    for (Real& x : command.wrench_d.force_n) x = component();
    for (Real& x : command.wrench_d.torque_nm) x = component();
  }
  // It goes on from there, or from where it was.
  if (command.tick < 1'000'000'000) tick_ = command.tick;
  publish(command);
}

void LinkBench::Play::lose_servo(bool with_successor) {
  flow_.servo_lost();
  if (with_successor) {
    servo_ = hal::ServoSide(boxes_.emplace_back());
    flow_.use_mailbox(boxes_.back());
    newest_ = DeviceCommand{};
    tick_ = 0;
    arming_ = 0;
    scribbled_ = false;
  }
  block("servo lost");
}

void LinkBench::Play::say(std::span<const std::uint8_t> report) {
  if (!connected_) return;
  flow_.on_report(report);
  flow_.on_report_done();
}

/// What the link makes of it cannot be known from here, only that it is some command.
void LinkBench::Play::scribble() {
  const std::size_t where = script_.number(2) % sizeof(hal::CommandHalf);
  const auto bytes = script_.take(script_.byte());
  auto* const half = reinterpret_cast<unsigned char*>(&boxes_.back().command_half);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    half[(where + i) % sizeof(hal::CommandHalf)] = bytes[i];
  scribbled_ = true;
}

/// The link never waits but after a turn.
void LinkBench::Play::pass(std::int64_t ns) {
  if (connected_) {
    if (cancelled_) end_out(false);
    flow_.turn();
  }
  if (now_ns_ < std::numeric_limits<std::int64_t>::max() / 2) now_ns_ += ns;
}

void LinkBench::Play::end_out(bool delivered) {
  if (!busy_) return;
  busy_ = cancelled_ = false;
  const auto command = std::span(out_).first(out_count_);
  if (delivered) {
    device_->take(command);
  } else {
    monitor_.not_delivered();
  }
  flow_.on_out_end(delivered);
}

void LinkBench::Play::plug() {
  flow_.begin_start();
  const HalStatus started = driver_.start(device_->port());
  connected_ = started == HalStatus::kOk;
  monitor_ = ForceMonitor(block_of(driver_.capabilities()));
  if (connected_) {
    resting_ = false;
    flow_.begin_reports();
  } else {
    flow_.end(false, started);
  }
}

void LinkBench::Play::replug(std::uint8_t how) {
  if (connected_) {
    busy_ = cancelled_ = false;  // what was in flight ends without being told
    connected_ = false;
    flow_.end((how & 1u) != 0, HalStatus::kDeviceGone);
  }
  if ((how & 2u) != 0) device_->power_up();
  if ((how & 4u) != 0) device_->exchange();
  pass(std::int64_t{how} * 1'000'000);
  plug();
}

/// A period as it should be, so many times.
void LinkBench::Play::beat() {
  const std::int64_t report_ns = driver_.capabilities().report_period_ns;
  const std::int64_t period_ns = report_ns > 0 ? report_ns : kLoopPeriod_ns;
  for (int left = 1 + script_.byte() % 32; left > 0 && broken_.empty(); --left) {
    pass(period_ns);
    publish_sane();
    say(device_->report(0, 0, pressed_));
    end_out(true);
  }
}

void LinkBench::Play::operate() {
  constexpr auto kOps = static_cast<unsigned>(BenchOp::kCount);
  op_ = script_.byte() % kOps;
  switch (static_cast<BenchOp>(op_)) {
    case BenchOp::kBeat:
      return beat();
    case BenchOp::kReport: {
      const std::uint8_t troubles = script_.byte();
      return say(device_->report(troubles, script_.small(), pressed_));
    }
    case BenchOp::kRawReport: {
      const std::size_t size = script_.byte() % (hal::kMaxReportBytes + 1);
      return say(script_.take(size));
    }
    case BenchOp::kCommand: {
      const Real share = 1.0_r / 64.0_r;
      const SafetyLimits& limits = settings_.limits;
      for (Real& x : wanted_d_.force_n)
        x = share * limits.max_force_n * static_cast<Real>(script_.small());
      wanted_d_.torque_nm[2] = share * limits.max_torque_nm * static_cast<Real>(script_.small());
      return publish_sane();
    }
    case BenchOp::kHostile:
      return publish_hostile();
    case BenchOp::kPass:
      return pass(script_.byte() * kLoopPeriod_ns / 4);
    case BenchOp::kLeap:
      return pass(std::int64_t{1} << (script_.byte() % 50u));
    case BenchOp::kOutEnd:
      return end_out(true);
    case BenchOp::kOutFailed:
      return end_out(false);
    case BenchOp::kRefuse:
      refused_ = script_.byte() % 16u;
      return;
    case BenchOp::kTurn:
      if (connected_) flow_.turn();
      return;
    case BenchOp::kServoLost:
      return lose_servo((script_.byte() & 1u) != 0);
    case BenchOp::kReplug:
      return replug(script_.byte());
    case BenchOp::kRest:
      if (!connected_) return;
      flow_.begin_rest();
      resting_ = true;
      return;
    case BenchOp::kArm:
      ++arming_;
      return;
    case BenchOp::kDeadman:
      pressed_ = (script_.byte() & 1u) != 0;
      return;
    case BenchOp::kStop:
      flow_.emergency_stop();
      return block("stop called");
    case BenchOp::kSleep:
      slept_ns_ += script_.byte() * std::int64_t{4'000'000};
      return;
    case BenchOp::kPedal:
      pedal_ = (script_.byte() & 1u) != 0;
      return;
    case BenchOp::kScribble:
      return scribble();
    case BenchOp::kCount:
      return;
  }
}

std::string LinkBench::run(std::span<const std::uint8_t> script) {
  return Play(script, sabotage_, counts_).run();
}

}  // namespace haptic::test
