// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/device_stack.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Time of the first period: a stamp of 0 means "not stamped".
constexpr std::int64_t kFirst_ns = 1'000'000'000;

std::vector<StackDevice> one(const StackSettings& settings,
                             std::function<HandAction(double t_s)> hand) {
  std::vector<StackDevice> devices(1);
  devices[0] = {settings, std::move(hand)};
  return devices;
}

/// As the device's line has them: the period of the servo loop, and the grip point of the hand.
StackSettings in_line(StackSettings settings, const SceneView& scene) {
  const std::int64_t period_ns = std::llround(1e9 / settings.model.report_rate_hz);
  settings.limits.period_ns = period_ns / std::max(settings.ticks_per_report, 1u);
  const double* grip = scene.bodies()[0].reference_m;
  for (int k = 0; k < 3; ++k) settings.map.grip_a[k] = static_cast<Real>(grip[k]);
  return settings;
}

}  // namespace

DeviceStack::DeviceStack(CoreSession& session, const StackSettings& settings,
                         std::function<HandAction(double t_s)> hand)
    : DeviceStack(session, one(settings, std::move(hand))) {}

DeviceStack::DeviceStack(CoreSession& session, std::vector<StackDevice> devices)
    : session_(session),
      recorder_memory_(
          FlightRecorder::bytes_for(devices.empty() ? 0 : devices[0].settings.recorded_ticks)) {
  const std::size_t hands = session.hands() != nullptr ? session.hands()->count() : 1;
  if (devices.size() != hands)
    throw tools::InputError("the scene has " + std::to_string(hands) + " hands, and " +
                            std::to_string(devices.size()) +
                            " devices are given; give each its own");
  clock_.now_ns = kFirst_ns;
  clock_.serve = [this] { serve_servo(true); };
  for (std::size_t k = 0; k < hands; ++k) {
    StackDevice& device = devices[k];
    const StackSettings& first = devices[0].settings;
    const bool has_one_clock = device.settings.model.report_rate_hz == first.model.report_rate_hz &&
                               device.settings.ticks_per_report == first.ticks_per_report;
    if (hands > 1 && (device.settings.report_clocked || !has_one_clock))
      throw tools::InputError(
          "two devices have one rate and one number of ticks for a report, and are not "
          "report-clocked");
    const SceneView& scene =
        hands > 1 ? session.hands()->hand(static_cast<std::uint32_t>(k)).scene() : session.view();
    lines_.push_back(std::make_unique<DeviceLine>(clock_, in_line(device.settings, scene),
                                                  std::move(device.hand)));
  }
  for (std::size_t k = 0; k < driven_.size(); ++k) driven_writers_[k].emplace(driven_[k]);
  recorder_ = std::make_unique<FlightRecorder>(recorder_memory_.span());
  restart_servo();
}

ServoParameters DeviceStack::servo_parameters(std::size_t hand) const {
  const StackSettings& settings = lines_[hand]->settings();
  ServoParameters parameters;
  parameters.map = settings.map;
  parameters.limits = settings.limits;
  parameters.envelope = settings.envelope;
  return parameters;
}

hal::BusSession DeviceStack::bus_session() const {
  const DeviceLine& line = *lines_[0];
  hal::BusSession session;
  session.scene_hash = session_.view().header().content_hash;
  session.driver = line.driver().profile().name;
  session.vendor_id = line.driver().profile().vendor_id;
  session.product_id = line.driver().profile().product_id;
  session.period_ns = line.period_ns();
  session.report_clocked = line.settings().report_clocked;
  session.servo = servo_parameters();
  session.link = line.link_settings();
  return session;
}

void DeviceStack::record(hal::LinkTape* tape, hal::TickWatch watch, void* watch_context) {
  lines_[0]->tape(tape);
  watch_ = watch;
  watch_context_ = watch_context;
}

void DeviceStack::make_tick() {
  Hands* const hands = session_.hands();
  if (hands != nullptr) hands->reset();
  if (hands != nullptr && hands->count() > 1) {
    two_tick_ = std::make_unique<TwoHandTick>(
        *hands, std::array{servo_parameters(0), servo_parameters(1)},
        std::array<FlightRecorder*, kMostHands>{recorder_.get(), nullptr});
  } else if (hands != nullptr) {
    tick_ = std::make_unique<ServoTick>(hands->hand(0), servo_parameters(), recorder_.get());
  } else {
    session_.core().reset();
    tick_ = std::make_unique<ServoTick>(session_.core(), servo_parameters(),
                                        session_.view().header().capacity, recorder_.get());
  }
}

void DeviceStack::restart_servo() {
  make_tick();
  hal::ServoLoopSettings loop;
  loop.report_goal_contact = true;
  if (session_.parts() != nullptr)
    loop.driven = std::span(driven_).first(session_.parts()->driven().size());
  loop.period_ns = lines_[0]->settings().limits.period_ns;
  if (two_tick_) {
    loop_ = std::make_unique<hal::ServoLoop>(
        *two_tick_, std::array{&lines_[0]->mailbox(), &lines_[1]->mailbox()}, loop);
    loop_->watch(&DeviceStack::saw_second, this, 1);
  } else {
    loop_ = std::make_unique<hal::ServoLoop>(*tick_, lines_[0]->mailbox(), loop);
  }
  loop_->watch(&DeviceStack::saw, this);
  stalled_periods_ = 0;
}

void DeviceStack::drive(std::size_t driven, const FrameRecord& record) {
  driven_writers_[driven]->publish(record);
}

double DeviceStack::period_s() const { return 1e-9 * static_cast<double>(lines_[0]->period_ns()); }

std::vector<StepTrace> DeviceStack::flight() const {
  std::vector<StepTrace> records(lines_[0]->settings().recorded_ticks);
  records.resize(FlightRecorder::copy_newest(recorder_memory_.span(), records));
  return records;
}

void DeviceStack::saw(void* self, const ServoInput& input, const ServoResult& result) {
  auto& stack = *static_cast<DeviceStack*>(self);
  stack.lines_[0]->tick().state = input.state;
  if (stack.watch_ != nullptr) stack.watch_(stack.watch_context_, input, result);
}

void DeviceStack::saw_second(void* self, const ServoInput& input, const ServoResult& /*result*/) {
  static_cast<DeviceStack*>(self)->lines_[1]->tick().state = input.state;
}

void DeviceStack::serve_servo(bool by_report) {
  if (servo_ran_ || (by_report && !lines_[0]->has_new_state())) return;
  servo_ran_ = true;
  for (const auto& line : lines_) line->tick().servo_ran = true;
  if (servo_stalled_) {
    ++stalled_periods_;
    return;
  }
  static_cast<void>(loop_->tick(clock_.now_ns, stalled_periods_));
  stalled_periods_ = 0;
  for (std::size_t k = 0; k < lines_.size(); ++k) {
    StackTick& tick = lines_[k]->tick();
    tick.servo = loop_->result(k);
    if (instead_[k]) loop_->publish_instead(instead_[k](tick.servo.command), k);
  }
}

/// A period of the devices; a report-clocked servo loop answers within the poll.
const StackTick& DeviceStack::step() {
  const StackSettings& settings = lines_[0]->settings();
  const std::int64_t period_ns = lines_[0]->period_ns();
  servo_ran_ = false;
  for (const auto& line : lines_) line->begin_period();
  clock_.now_ns += period_ns;
  for (const auto& line : lines_) line->report();
  const std::int64_t begin_ns = clock_.now_ns;
  // Timer-clocked, later in the period; report-clocked where no report came.
  const std::int64_t loop_ns = settings.limits.period_ns;
  for (std::int64_t at_ns = 0; at_ns + loop_ns <= period_ns; at_ns += loop_ns) {
    if (!settings.report_clocked) {
      const double phase_ns = settings.servo_phase * static_cast<double>(loop_ns);
      clock_.now_ns = begin_ns + at_ns + static_cast<std::int64_t>(phase_ns);
      servo_ran_ = false;
    }
    serve_servo(false);
    for (const auto& line : lines_) line->send();
  }
  clock_.now_ns = begin_ns;
  for (const auto& line : lines_) line->end_period();
  return tick();
}

void DeviceStack::servo_lost() {
  for (const auto& line : lines_) line->servo_lost();
}

}  // namespace haptic::sim
