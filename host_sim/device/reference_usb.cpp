// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/reference_usb.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <utility>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::sim {
namespace {

// In lock-step no report may be overwritten: the host is never late, it is only not there yet.
constexpr unsigned kLockStepRoom = 1u << 16;
// Bounds what passes between two reports that reach the host; beyond, the device stands still.
constexpr unsigned kMostQuietPeriods = 1'000'000;
// A device thread that slept longer than this goes on from now, else it makes up for it.
constexpr std::chrono::milliseconds kLongestSleep{100};

}  // namespace

std::unique_ptr<BusCarrier> make_usbfs_carrier(UsbFunction& function, unsigned room) {
  return std::make_unique<UsbfsCarrier>(function, room);
}

ReferenceUsb::ReferenceUsb(ReferenceModel& model, DevicePace pace, CarrierMaker maker)
    : model_(model), pace_(pace), maker_(std::move(maker)) {}

// A carrier's thread may be in a call of ours: no replug may come from it now, and it must have
// left before anything is destroyed.
ReferenceUsb::~ReferenceUsb() {
  stop();
  {
    const std::lock_guard lock(mutex_);
    events_.clear();
  }
  for (const auto& each : carriers_) each->close();
}

std::vector<std::uint8_t> ReferenceUsb::descriptors() const { return reference_descriptors(); }

std::vector<std::uint8_t> reference_descriptors() {
  return {0x12, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x40, 0x09, 0x12, 0x01, 0x00, 0x00,
          0x01, 0x00, 0x00, 0x00, 0x01, 0x09, 0x02, 0x20, 0x00, 0x01, 0x01, 0x00, 0xc0,
          0x00, 0x09, 0x04, 0x00, 0x00, 0x02, 0xff, 0x00, 0x00, 0x00, 0x07, 0x05, 0x81,
          0x03, 0x60, 0x00, 0x01, 0x07, 0x05, 0x01, 0x03, 0x38, 0x00, 0x01};
}

int ReferenceUsb::control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                          std::uint16_t index, std::span<std::uint8_t> bytes) {
  constexpr std::uint8_t kClearFeature = 1, kSetConfiguration = 9, kSetInterface = 11;
  const std::lock_guard lock(mutex_);
  if (request_type == hal::kReferenceBlockRequestType && request == hal::kReferenceBlockRequest) {
    if (value != hal::kReferenceVersion || index != 0) return -EPIPE;
    const std::size_t moved = model_.answer_into(bytes);
    return moved > 0 ? static_cast<int>(moved) : -EPIPE;
  }
  const bool standard = (request_type & 0x60u) == 0;
  if (standard && (request == kSetConfiguration || request == kSetInterface)) {
    model_.bus_event();
    return 0;
  }
  return standard && request == kClearFeature ? 0 : -EPIPE;
}

int ReferenceUsb::out(std::uint8_t, std::span<const std::uint8_t> bytes) {
  int before = -1;
  {
    const std::lock_guard lock(mutex_);
    before = carriers_.back()->descriptor();
    if (period_ >= deaf_until_ && model_.command(bytes) && command_seen_) command_seen_(model_);
    if (pace_ == DevicePace::kLockStep) step_to_next_report();
  }
  settle(before);
  return static_cast<int>(bytes.size());
}

int ReferenceUsb::plug() {
  drop_retired();
  const std::lock_guard lock(mutex_);
  plug_locked();
  if (pace_ == DevicePace::kLockStep) step_to_next_report();
  return carriers_.back()->descriptor();
}

// Does what the kernel does with a new device: sets the configuration, which takes the drives off.
void ReferenceUsb::plug_locked() {
  if (!carriers_.empty()) carriers_.back()->unplug();
  model_.bus_event();
  failing_ = 0;
  if (carriers_.size() > kKeptCarriers) {
    retired_.push_back(std::move(carriers_.front()));
    carriers_.erase(carriers_.begin());
  }
  carriers_.push_back(
      maker_(*this, pace_ == DevicePace::kLockStep ? kLockStepRoom : BusCarrier::kRoom));
}

void ReferenceUsb::unplug() { carrier().unplug(); }

int ReferenceUsb::descriptor() const {
  const std::lock_guard lock(mutex_);
  return carriers_.empty() ? -1 : carriers_.back()->descriptor();
}

void ReferenceUsb::on_replug(std::function<void(int)> told) { told_ = std::move(told); }

BusCarrier& ReferenceUsb::carrier() {
  const std::lock_guard lock(mutex_);
  return *carriers_.back();
}

void ReferenceUsb::on_period(std::function<void(const ReferenceModel&)> seen) {
  period_seen_ = std::move(seen);
}

void ReferenceUsb::on_command(std::function<void(const ReferenceModel&)> seen) {
  command_seen_ = std::move(seen);
}

// Without the lock, for which the thread of an old bus may be waiting.
void ReferenceUsb::drop_retired() {
  std::vector<std::unique_ptr<BusCarrier>> retired;
  const std::lock_guard lock(mutex_);
  retired.swap(retired_);
}

// Tells of a replug that happened meanwhile.
void ReferenceUsb::settle(int descriptor_before) {
  drop_retired();
  const int now = descriptor();
  if (now != descriptor_before && told_) told_(now);
}

void ReferenceUsb::step() {
  const int before = descriptor();
  {
    const std::lock_guard lock(mutex_);
    step_locked();
  }
  settle(before);
}

std::uint64_t ReferenceUsb::periods() const {
  const std::lock_guard lock(mutex_);
  return period_;
}

void ReferenceUsb::add(const DeviceFaultEvent& event) {
  const std::lock_guard lock(mutex_);
  events_.push_back(event);
  events_.back().report = std::max(event.report, period_ + 1);
}

bool ReferenceUsb::replug_to_come() const {
  return std::any_of(events_.begin(), events_.end(), [](const DeviceFaultEvent& event) {
    return event.kind == DeviceFaultKind::kReplug;
  });
}

void ReferenceUsb::step_to_next_report() {
  for (unsigned k = 0; k < kMostQuietPeriods; ++k) {
    if (step_locked()) return;
    if (!carriers_.back()->plugged() && !replug_to_come()) return;
  }
}

// Returns whether a report is on its way to the host.
bool ReferenceUsb::step_locked() {
  ++period_;
  std::vector<DeviceFaultEvent> due;
  for (const DeviceFaultEvent& event : events_) {
    if (event.report <= period_) due.push_back(event);
  }
  std::erase_if(events_, [this](const DeviceFaultEvent& event) { return event.report <= period_; });
  for (const DeviceFaultEvent& event : due) begin(event);
  if (stopped_until_ != 0 && period_ >= stopped_until_) {
    model_.press_emergency_stop(false);
    stopped_until_ = 0;
  }
  model_.advance();
  if (period_seen_) period_seen_(model_);
  bool under_way = false;
  for (const std::vector<std::uint8_t>& bytes : filter_.pass(period_, model_.report())) {
    BusCarrier& bus = *carriers_.back();
    if (!bus.plugged()) continue;
    bus.push(kInEndpoint, bytes);
    under_way = under_way || failing_ == 0;
    if (failing_ > 0) --failing_;
  }
  return under_way;
}

void ReferenceUsb::begin(const DeviceFaultEvent& event) {
  BusCarrier& bus = *carriers_.back();
  const std::uint8_t endpoint = event.out_endpoint ? kOutEndpoint : kInEndpoint;
  const auto fail = [&](int negative_errno) {
    bus.fail_next(endpoint, negative_errno, event.count);
    if (!event.out_endpoint) failing_ += event.count;
  };
  switch (event.kind) {
    case DeviceFaultKind::kUnplug:
      return bus.unplug();
    case DeviceFaultKind::kUnplugAtResubmit:
      return bus.unplug_at_next_resubmit();
    case DeviceFaultKind::kReplug:
      if (event.amount > 0) model_.power_up();
      return plug_locked();
    case DeviceFaultKind::kStall:
      return fail(-EPIPE);
    case DeviceFaultKind::kBabble:
      return fail(-EOVERFLOW);
    case DeviceFaultKind::kBusError:
      return fail(-EPROTO);
    case DeviceFaultKind::kSubmitRefused:
      return bus.refuse_submit(endpoint, -ENOMEM, event.count);
    case DeviceFaultKind::kEncoderJump:
      return model_.jump_encoders(Vector(event.amount, 0, 0));
    case DeviceFaultKind::kEmergencyStop:
      stopped_until_ = std::max(stopped_until_, period_ + event.count);
      return model_.press_emergency_stop(true);
    case DeviceFaultKind::kDeaf:
      deaf_until_ = std::max(deaf_until_, period_ + event.count);
      return;
    default:
      return filter_.add(event);
  }
}

void ReferenceUsb::start() {
  if (pace_ != DevicePace::kRealTime || run_.exchange(true)) return;
  thread_ = std::thread([this] { run_paced(run_); });
}

void ReferenceUsb::stop() {
  run_ = false;
  if (thread_.joinable()) thread_.join();
}

void ReferenceUsb::run_paced(const std::atomic<bool>& run) {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(with_model([](const auto& m) { return m.period_s(); })));
  Clock::time_point next = Clock::now() + period;
  while (run) {
    std::this_thread::sleep_until(next);
    step();
    next += period;
    if (Clock::now() - next > kLongestSleep) next = Clock::now() + period;
  }
}

}  // namespace haptic::sim
