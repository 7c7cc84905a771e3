// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/bus_recorder.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

namespace haptic::hal {
namespace {

constexpr std::chrono::milliseconds kDrainPeriod{5};
constexpr std::size_t kMostUnwritten = 64 * 1024;

}  // namespace

BusRecorder::BusRecorder(const std::string& path, const BusSession& session, RecorderDrain drain)
    : path_(path), part_(path + ".part"), rings_(std::make_unique<Rings>()) {
  file_ = std::fopen(part_.c_str(), "wb");
  if (file_ == nullptr) os_error_ = errno;
  append_header(bytes_, session);
  write();
  if (drain == RecorderDrain::kThread) thread_ = std::thread([this] { run(); });
}

BusRecorder::~BusRecorder() {
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
  if (file_ == nullptr) return;
  (void)drain();
  std::fclose(file_);
}

void BusRecorder::watch(void* self, const ServoInput& input, const ServoResult& result) {
  auto& recorder = *static_cast<BusRecorder*>(self);
  recorder.push_given(input);
  ServoEntry entry;
  entry.tick = recorded(input, result);
  recorder.rings_->ticks.push(entry);
}

/// All that is newer than in the last tick.
void BusRecorder::push_given(const ServoInput& input) noexcept {
  push_frame(0, input.frame);
  const std::size_t driven = std::min(input.driven.size(), std::size_t{kMostDriven});
  for (std::size_t k = 0; k < driven; ++k)
    push_frame(static_cast<std::uint32_t>(k + 1), input.driven[k]);
  if (hand_ == nullptr) return;
  const PartHand::Phase before = stepped_as_;
  stepped_as_ = hand_->stepped_as();
  ServoEntry entry;
  entry.is_tick = false;
  if (stepped_as_ == PartHand::Phase::kLettingGo && before != stepped_as_) {
    entry.given.kind = RecordedGiven::Kind::kRelease;
  } else if (stepped_as_ == PartHand::Phase::kPrepared) {
    entry.given.kind = RecordedGiven::Kind::kTake;
    entry.given.number = hand_->part();
  } else {
    return;
  }
  rings_->ticks.push(entry);
}

void BusRecorder::push_frame(std::uint32_t number, const FrameRecord& frame) noexcept {
  if (frame.number == frame_numbers_[number]) return;
  frame_numbers_[number] = frame.number;
  ServoEntry entry;
  entry.is_tick = false;
  entry.given = {RecordedGiven::Kind::kFrame, number, frame};
  rings_->ticks.push(entry);
}

void BusRecorder::on_event(const LinkEvent& event) noexcept {
  if (closed_) return;
  if (event.kind == LinkEventKind::kClock) {
    clocks_[clock_count_++] = event.stamp_ns;
    if (clock_count_ == clocks_.size()) push_clocks();
    return;
  }
  push_clocks();
  closed_ = event.kind == LinkEventKind::kClose;
  Event entry;
  entry.kind = event.kind;
  entry.code = event.code;
  entry.why = event.why;
  entry.stamp_ns = event.stamp_ns;
  entry.number = event.number;
  const std::size_t size = std::min(event.bytes.size(), entry.bytes.size());
  if (size < event.bytes.size()) too_long_.fetch_add(1, std::memory_order_relaxed);
  entry.size = static_cast<std::uint16_t>(size);
  if (size > 0) std::memcpy(entry.bytes.data(), event.bytes.data(), size);
  rings_->events.push(entry);
}

// Times are many and small: they travel together, in front of what comes next.
void BusRecorder::push_clocks() noexcept {
  if (clock_count_ == 0) return;
  static_assert(sizeof(clocks_) <= kMostEventBytes);
  Event entry;
  entry.kind = LinkEventKind::kClock;
  entry.size = static_cast<std::uint16_t>(clock_count_);
  std::memcpy(entry.bytes.data(), clocks_.data(), clock_count_ * sizeof(clocks_[0]));
  rings_->events.push(entry);
  clock_count_ = 0;
}

void BusRecorder::put_event(const Event& event) {
  if (event.kind == LinkEventKind::kClock) {
    std::array<std::int64_t, kMostClocks> stamps{};
    std::memcpy(stamps.data(), event.bytes.data(), event.size * sizeof(stamps[0]));
    append_clocks(bytes_, std::span(stamps).first(event.size));
  } else {
    LinkEvent out{event.kind, event.code, event.why, event.stamp_ns, event.number, {}};
    out.bytes = std::span(event.bytes).first(event.size);
    append_event(bytes_, out);
  }
  ++records_;
}

bool BusRecorder::drain() {
  while (rings_->events.pop(event_)) {
    put_event(event_);
    if (bytes_.size() > kMostUnwritten) write();
  }
  ServoEntry entry;
  while (rings_->ticks.pop(entry)) {
    if (entry.is_tick) {
      append_tick(bytes_, entry.tick);
    } else {
      append_given(bytes_, entry.given);
    }
    ++records_;
    if (bytes_.size() > kMostUnwritten) write();
  }
  write();
  return os_error_ == 0;
}

// Once refused, the file gets no more: a hole in it would be worse than its end.
void BusRecorder::write() {
  if (os_error_ == 0 && std::fwrite(bytes_.data(), 1, bytes_.size(), file_) != bytes_.size())
    os_error_ = errno != 0 ? errno : EIO;
  bytes_.clear();
}

void BusRecorder::run() {
  while (!stop_.load()) {
    // Out of the process: a crash of it loses a few milliseconds, not a buffer.
    if (drain() && std::fflush(file_) != 0) os_error_ = errno;
    std::this_thread::sleep_for(kDrainPeriod);
  }
}

RecorderEnd BusRecorder::finish() {
  if (finished_) return end_;
  finished_ = true;
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
  if (!closed_) push_clocks();
  (void)drain();
  end_.counts.records = records_;
  end_.counts.dropped_events = rings_->events.dropped() + too_long_.load();
  end_.counts.dropped_ticks = rings_->ticks.dropped();
  append_end(bytes_, end_.counts);
  write();
  if (file_ != nullptr) {
    if (os_error_ == 0 && (std::fflush(file_) != 0 || fsync(fileno(file_)) != 0)) os_error_ = errno;
    if (std::fclose(file_) != 0 && os_error_ == 0) os_error_ = errno;
    file_ = nullptr;
  }
  if (os_error_ == 0 && std::rename(part_.c_str(), path_.c_str()) != 0) os_error_ = errno;
  end_.os_error = os_error_;
  if (os_error_ != 0) end_.status = HalStatus::kOsRefused;
  return end_;
}

}  // namespace haptic::hal
