// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/device_stack.hpp"

#include <algorithm>
#include <cmath>

#include "hal/drivers/reference_codec.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Time of the first period: a stamp of 0 means "not stamped".
constexpr std::int64_t kFirst_ns = 1'000'000'000;
/// A poll takes what the bus has; the second sees to what the first has set going.
constexpr int kPolls = 2;

}  // namespace

/// The link without a bus: the bytes of the device go straight to the driver and back, through the
/// same checks of order and the same guard.
class DeviceStack::DirectLink final : private hal::UsbPort {
 public:
  DirectLink(DeviceStack& stack, ReferenceModel& model)
      : stack_(stack), model_(model), mailbox_(stack.mailbox_), guard_(stack.settings_.limits) {}

  void poll() {
    if (!started_) {
      started_ = true;
      if (stack_.driver_.start(*this) != hal::HalStatus::kOk)
        throw tools::InputError("the device model refuses its own driver");
      const hal::DeviceCapabilities& stated = stack_.driver_.capabilities();
      const SafetyLimits limits = hal::limits_of_connection(stack_.settings_.limits, stated);
      guard_.limit(limits);
      state_.limits = hal::limits_record(limits, stated, 1);
    }
    const std::vector<std::uint8_t> report = model_.report();
    const hal::ReportVerdict verdict = stack_.driver_.read(report, stack_.now_ns_, state_);
    if (verdict == hal::ReportVerdict::kState) {
      state_.sequence = ++sequence_;
      state_.stamp_ns = stack_.now_ns_;
      mailbox_.publish(state_, false);
      if (stack_.settings_.report_clocked) stack_.serve_servo(true);
    }
    send();
  }

  void servo_lost() { guard_.latch(kLinkServoLost); }

 private:
  void send() {
    const haptic::DeviceCommand command = mailbox_.command();
    const std::uint32_t deadman = SwitchMap{}.deadman;
    if ((state_.switches & deadman) != deadman) guard_.hold_back(command);
    const hal::GuardedOutput output = guard_.update(stack_.now_ns_, command);
    std::array<std::uint8_t, hal::kMaxReportBytes> bytes{};
    Wrench delivered_d;
    const std::size_t count =
        stack_.driver_.write(output.wrench_d, output.tick, bytes, delivered_d);
    if (count == 0) return;
    const std::span<const std::uint8_t> sent(bytes.data(), count);
    model_.command(sent);
    guard_.delivered(delivered_d);
    state_.accepted_d = record_of(delivered_d);
    state_.accepted_tick = output.tick;
    static_cast<hal::LinkObserver&>(stack_).on_send(stack_.now_ns_, sent, output);
  }

  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned /*timeout_ms*/) noexcept override {
    const int result = stack_.bus_->control(request.request_type, request.request, request.value,
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

  DeviceStack& stack_;
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

DeviceStack::DeviceStack(CoreSession& session, const StackSettings& settings,
                         std::function<HandAction(double t_s)> hand)
    : session_(session),
      settings_(settings),
      model_(settings.model, std::move(hand)),
      bus_(std::make_unique<ReferenceUsb>(model_, DevicePace::kRealTime)),
      recorder_memory_(FlightRecorder::bytes_for(settings.recorded_ticks)) {
  now_ns_ = kFirst_ns;
  period_ns_ = std::llround(1e9 / settings.model.report_rate_hz);
  settings_.limits.period_ns = period_ns_ / std::max(settings.ticks_per_report, 1u);
  const double* grip = session.view().bodies()[0].reference_m;
  for (int k = 0; k < 3; ++k) settings_.map.grip_a[k] = static_cast<Real>(grip[k]);
  for (std::size_t k = 0; k < driven_.size(); ++k) driven_writers_[k].emplace(driven_[k]);
  recorder_ = std::make_unique<FlightRecorder>(recorder_memory_.span());
  restart_servo();
  if (settings.carrier == StackCarrier::kDirect) {
    direct_ = std::make_unique<DirectLink>(*this, model_);
    return;
  }
  hal::LinkSettings link = link_settings();
  link.address.wrapped_fd = bus_->plug();
  link.clock = &DeviceStack::clock;
  link.clock_context = this;
  link.slept = &DeviceStack::slept;
  link_ = std::make_unique<hal::UsbLink>(driver_, mailbox_, link);
  link_->observe(this);
  bus_->on_replug([this](int descriptor) { link_->set_wrapped_fd(descriptor); });
}

DeviceStack::~DeviceStack() = default;

hal::LinkSettings DeviceStack::link_settings() const {
  hal::LinkSettings link;
  link.limits = settings_.limits;
  link.deadman = SwitchMap{}.deadman;
  link.answer_wait_ns = settings_.report_clocked ? period_ns_ : 0;
  link.retry_ns = 20 * period_ns_;
  return link;
}

ServoParameters DeviceStack::servo_parameters() const {
  ServoParameters parameters;
  parameters.map = settings_.map;
  parameters.limits = settings_.limits;
  parameters.envelope = settings_.envelope;
  return parameters;
}

hal::BusSession DeviceStack::bus_session() const {
  hal::BusSession session;
  session.scene_hash = session_.view().header().content_hash;
  session.driver = driver_.profile().name;
  session.vendor_id = driver_.profile().vendor_id;
  session.product_id = driver_.profile().product_id;
  session.period_ns = period_ns_;
  session.report_clocked = settings_.report_clocked;
  session.servo = servo_parameters();
  session.link = link_settings();
  return session;
}

void DeviceStack::record(hal::LinkTape* tape, hal::TickWatch watch, void* watch_context) {
  if (link_) link_->tape(tape);
  watch_ = watch;
  watch_context_ = watch_context;
}

void DeviceStack::restart_servo() {
  if (PartHand* const held = session_.hand()) {
    held->reset();
    tick_ = std::make_unique<ServoTick>(*held, servo_parameters(), recorder_.get());
  } else {
    session_.core().reset();
    tick_ = std::make_unique<ServoTick>(session_.core(), servo_parameters(),
                                        session_.view().header().capacity, recorder_.get());
  }
  hal::ServoLoopSettings loop;
  loop.report_goal_contact = true;
  if (session_.parts() != nullptr)
    loop.driven = std::span(driven_).first(session_.parts()->driven().size());
  loop.period_ns = settings_.limits.period_ns;
  loop_ = std::make_unique<hal::ServoLoop>(*tick_, mailbox_, loop);
  loop_->watch(&DeviceStack::saw, this);
  stalled_periods_ = 0;
}

void DeviceStack::drive(std::size_t driven, const FrameRecord& record) {
  driven_writers_[driven]->publish(record);
}

double DeviceStack::period_s() const { return 1e-9 * static_cast<double>(period_ns_); }

hal::LinkCounters DeviceStack::link_counters() const {
  return link_ ? link_->counters() : hal::LinkCounters{};
}

std::vector<StepTrace> DeviceStack::flight() const {
  std::vector<StepTrace> records(settings_.recorded_ticks);
  records.resize(FlightRecorder::copy_newest(recorder_memory_.span(), records));
  return records;
}

// The link asks for the time while it waits for an answer: in one thread, that is when the servo
// loop runs.
std::int64_t DeviceStack::slept(void* self) {
  return static_cast<const DeviceStack*>(self)->slept_ns_;
}

std::int64_t DeviceStack::clock(void* self) {
  auto& stack = *static_cast<DeviceStack*>(self);
  if (stack.in_poll_ && stack.link_->state() == LinkState::kReady) stack.serve_servo(true);
  return stack.now_ns_;
}

void DeviceStack::saw(void* self, const ServoInput& input, const ServoResult& result) {
  auto& stack = *static_cast<DeviceStack*>(self);
  stack.out_.state = input.state;
  if (stack.watch_ != nullptr) stack.watch_(stack.watch_context_, input, result);
}

void DeviceStack::serve_servo(bool by_report) {
  const bool is_new = mailbox_.states->published.load(std::memory_order_acquire) != seen_;
  if (out_.servo_ran || (by_report && !is_new)) return;
  out_.servo_ran = true;
  if (servo_stalled_) {
    ++stalled_periods_;
    return;
  }
  out_.servo = loop_->tick(now_ns_, stalled_periods_);
  stalled_periods_ = 0;
  if (instead_) loop_->publish_instead(instead_(out_.servo.command));
}

/// A period of the device; a report-clocked servo loop answers within the poll.
StackTick DeviceStack::step() {
  out_.servo_ran = false;
  out_.sent.clear();
  seen_ = mailbox_.states->published.load(std::memory_order_acquire);
  now_ns_ += period_ns_;
  if (link_) {
    bus_->step();
    in_poll_ = settings_.report_clocked;
    for (int k = 0; k < kPolls; ++k) static_cast<void>(link_->poll(0));
    in_poll_ = false;
  } else {
    model_.advance();
    direct_->poll();
  }
  const std::int64_t begin_ns = now_ns_;
  // Timer-clocked, later in the period; report-clocked where no report came.
  const std::int64_t loop_ns = settings_.limits.period_ns;
  for (std::int64_t at_ns = 0; at_ns + loop_ns <= period_ns_; at_ns += loop_ns) {
    if (!settings_.report_clocked) {
      const double phase_ns = settings_.servo_phase * static_cast<double>(loop_ns);
      now_ns_ = begin_ns + at_ns + static_cast<std::int64_t>(phase_ns);
      out_.servo_ran = false;
    }
    serve_servo(false);
    if (link_) static_cast<void>(link_->poll(0));
  }
  now_ns_ = begin_ns;

  out_.period += 1;
  out_.t_s = static_cast<double>(out_.period) * period_s();
  out_.device = model_.state();
  out_.acting = model_.acting();
  out_.drives_on = model_.drives_on();
  out_.cuts = model_.cuts();
  out_.link = link_ ? link_->state() : LinkState::kReady;
  return out_;
}

void DeviceStack::stop_link() {
  if (link_) link_->emergency_stop();
}

void DeviceStack::servo_lost() {
  if (link_) link_->servo_lost();
  if (direct_) direct_->servo_lost();
}

void DeviceStack::unplug() { bus_->unplug(); }

void DeviceStack::plug(bool power) {
  if (power) model_.power_up();
  link_->set_wrapped_fd(bus_->plug());
}

void DeviceStack::on_report(std::int64_t /*stamp_ns*/, std::span<const std::uint8_t> /*report*/,
                            hal::ReportVerdict /*verdict*/, std::uint64_t /*sequence*/) noexcept {}

void DeviceStack::on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
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

void DeviceStack::on_link(std::int64_t /*stamp_ns*/, LinkState /*state*/,
                          hal::HalStatus /*why*/) noexcept {}

}  // namespace haptic::sim
