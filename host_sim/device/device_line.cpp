// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/device_line.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hal/drivers/reference_codec.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// A poll takes what the bus has; the second sees to what the first has set going.
constexpr int kPolls = 2;

}  // namespace

/// The link without a bus: the bytes of the device go straight to the driver and back, through the
/// same checks of order and the same guard.
class DeviceLine::DirectLink final : private hal::UsbPort {
 public:
  DirectLink(DeviceLine& line, ReferenceModel& model)
      : line_(line), model_(model), mailbox_(line.mailbox_), guard_(line.settings_.limits) {}

  void poll() {
    if (!started_) {
      started_ = true;
      if (line_.driver_.start(*this) != hal::HalStatus::kOk)
        throw tools::InputError("the device model refuses its own driver");
      const hal::DeviceCapabilities& stated = line_.driver_.capabilities();
      const SafetyLimits limits = hal::limits_of_connection(line_.settings_.limits, stated);
      guard_.limit(limits);
      state_.limits = hal::limits_record(limits, stated, 1);
    }
    const std::vector<std::uint8_t> report = model_.report();
    const hal::ReportVerdict verdict = line_.driver_.read(report, line_.clock_.now_ns, state_);
    if (verdict == hal::ReportVerdict::kState) {
      state_.sequence = ++sequence_;
      state_.stamp_ns = line_.clock_.now_ns;
      mailbox_.publish(state_, false);
      if (line_.settings_.report_clocked) line_.clock_.serve();
    }
    send();
  }

  void servo_lost() { guard_.latch(kLinkServoLost); }

 private:
  void send() {
    const haptic::DeviceCommand command = mailbox_.command();
    const std::uint32_t deadman = SwitchMap{}.deadman;
    if ((state_.switches & deadman) != deadman) guard_.hold_back(command);
    const hal::GuardedOutput output = guard_.update(line_.clock_.now_ns, command);
    std::array<std::uint8_t, hal::kMaxReportBytes> bytes{};
    Wrench delivered_d;
    const std::size_t count = line_.driver_.write(output.wrench_d, output.tick, bytes, delivered_d);
    if (count == 0) return;
    const std::span<const std::uint8_t> sent(bytes.data(), count);
    model_.command(sent);
    guard_.delivered(delivered_d);
    state_.accepted_d = record_of(delivered_d);
    state_.accepted_tick = output.tick;
    static_cast<hal::LinkObserver&>(line_).on_send(line_.clock_.now_ns, sent, output);
  }

  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned /*timeout_ms*/) noexcept override {
    const int result = line_.bus_->control(request.request_type, request.request, request.value,
                                           request.index, bytes);
    moved = result > 0 ? static_cast<std::size_t>(result) : 0;
    return result >= 0 ? hal::HalStatus::kOk : hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus write(std::span<const std::uint8_t> /*bytes*/,
                       unsigned /*timeout_ms*/) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus read(std::span<std::uint8_t> /*bytes*/, std::size_t& moved,
                      unsigned /*timeout_ms*/) noexcept override {
    moved = 0;
    return hal::HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

  DeviceLine& line_;
  ReferenceModel& model_;
  hal::DeviceSide mailbox_;
  hal::OutputGuard guard_;
  haptic::DeviceState state_;
  std::uint64_t sequence_ = 0;
  bool started_ = false;
};

StackSettings reference_stack(StackCarrier carrier) {
  StackSettings settings;
  settings.carrier = carrier;
  const hal::DeviceCapabilities capabilities = hal::reference_capabilities();
  settings.limits = hal::limits_of(capabilities, capabilities.report_period_ns);
  return settings;
}

DeviceLine::DeviceLine(Clock& clock, const StackSettings& settings,
                       std::function<HandAction(double t_s)> hand)
    : clock_(clock),
      settings_(settings),
      period_ns_(std::llround(1e9 / settings.model.report_rate_hz)),
      model_(settings.model, std::move(hand)),
      bus_(std::make_unique<ReferenceUsb>(model_, DevicePace::kRealTime)) {
  if (settings.carrier == StackCarrier::kDirect) {
    direct_ = std::make_unique<DirectLink>(*this, model_);
    return;
  }
  hal::LinkSettings link = link_settings();
  link.address.wrapped_fd = bus_->plug();
  link.clock = &DeviceLine::clock;
  link.clock_context = this;
  link.slept = &DeviceLine::slept;
  link_ = std::make_unique<hal::UsbLink>(driver_, mailbox_, link);
  link_->observe(this);
  bus_->on_replug([this](int descriptor) { link_->set_wrapped_fd(descriptor); });
}

DeviceLine::~DeviceLine() = default;

hal::LinkSettings DeviceLine::link_settings() const {
  hal::LinkSettings link;
  link.limits = settings_.limits;
  link.deadman = SwitchMap{}.deadman;
  link.answer_wait_ns = settings_.report_clocked ? period_ns_ : 0;
  link.retry_ns = 20 * period_ns_;
  return link;
}

// The link asks for the time while it waits for an answer: in one thread, that is when the servo
// loop runs.
std::int64_t DeviceLine::slept(void* self) {
  return static_cast<const DeviceLine*>(self)->clock_.slept_ns;
}

std::int64_t DeviceLine::clock(void* self) {
  auto& line = *static_cast<DeviceLine*>(self);
  if (line.in_poll_ && line.link_->state() == LinkState::kReady) line.clock_.serve();
  return line.clock_.now_ns;
}

void DeviceLine::begin_period() {
  out_.servo_ran = false;
  out_.sent.clear();
  seen_ = mailbox_.states->published.load(std::memory_order_acquire);
}

void DeviceLine::report() {
  if (!link_) {
    model_.advance();
    direct_->poll();
    return;
  }
  bus_->step();
  in_poll_ = settings_.report_clocked;
  for (int k = 0; k < kPolls; ++k) static_cast<void>(link_->poll(0));
  in_poll_ = false;
}

void DeviceLine::send() {
  if (link_) static_cast<void>(link_->poll(0));
}

void DeviceLine::end_period() {
  out_.period += 1;
  out_.t_s = static_cast<double>(out_.period) * (1e-9 * static_cast<double>(period_ns_));
  out_.device = model_.state();
  out_.acting = model_.acting();
  out_.drives_on = model_.drives_on();
  out_.cuts = model_.cuts();
  out_.link = link_ ? link_->state() : LinkState::kReady;
}

hal::LinkCounters DeviceLine::link_counters() const {
  return link_ ? link_->counters() : hal::LinkCounters{};
}

void DeviceLine::tape(hal::LinkTape* tape) {
  if (link_) link_->tape(tape);
}

void DeviceLine::stop_link() {
  if (link_) link_->emergency_stop();
}

void DeviceLine::servo_lost() {
  if (link_) link_->servo_lost();
  if (direct_) direct_->servo_lost();
}

void DeviceLine::unplug() { bus_->unplug(); }

void DeviceLine::plug(bool power) {
  if (power) model_.power_up();
  link_->set_wrapped_fd(bus_->plug());
}

void DeviceLine::on_report(std::int64_t /*stamp_ns*/, std::span<const std::uint8_t> /*report*/,
                           hal::ReportVerdict /*verdict*/, std::uint64_t /*sequence*/) noexcept {}

void DeviceLine::on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                         const hal::GuardedOutput& output) noexcept {
  out_.sends += 1;
  out_.handed_d = output.wrench_d;
  hal::ReferenceCommand command;
  if (hal::decode(report, command) != hal::CodecVerdict::kOk) return;
  StackSend& send = out_.sent.emplace_back();
  send.stamp_ns = stamp_ns;
  send.sequence = command.sequence;
  send.drives_on = command.drives_on;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    send.wrench.force_w[axis] = command.force[k] * hal::kReferenceForceUnit_n;
    send.wrench.torque_w[axis] = command.torque[k] * hal::kReferenceTorqueUnit_nm;
  }
}

void DeviceLine::on_link(std::int64_t /*stamp_ns*/, LinkState /*state*/,
                         hal::HalStatus /*why*/) noexcept {}

}  // namespace haptic::sim
