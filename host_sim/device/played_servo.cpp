// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/played_servo.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <utility>

#include "tools/common/formatted.hpp"

namespace haptic::sim {

namespace {

using hal::LinkEvent;
using hal::LinkEventKind;

constexpr std::array<const char*, hal::kMostLinkEventKind + 1> kKinds{"nothing",
                                                                      "turn of the link",
                                                                      "look at the clock",
                                                                      "control request",
                                                                      "report",
                                                                      "end of a send",
                                                                      "loss of the device",
                                                                      "command taken",
                                                                      "loss of the servo",
                                                                      "send",
                                                                      "refused send",
                                                                      "change of the link",
                                                                      "orderly end",
                                                                      "end of a halt",
                                                                      "emergency stop",
                                                                      "sleep of the machine",
                                                                      "change of switches"};
constexpr std::array<const char*, 6> kVerdicts{"state",     "nothing",    "bad length",
                                               "bad check", "bad number", "not advancing"};

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  char two[4];
  for (const std::uint8_t byte : bytes) {
    std::snprintf(two, sizeof two, "%02x", static_cast<unsigned>(byte));
    text += two;
  }
  return text;
}

std::string exact(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

void compare_wrench(std::string& text, const std::array<double, 6>& expected,
                    const std::array<double, 6>& found) {
  constexpr std::array<const char*, 6> kNames{"force x",  "force y",  "force z",
                                              "torque x", "torque y", "torque z"};
  for (std::size_t k = 0; k < 6; ++k) {
    if (expected[k] == found[k]) continue;
    text += std::string("\n  command's ") + kNames[k] + ": expected " + exact(expected[k]) +
            ", found " + exact(found[k]);
  }
}

using hal::RecordedTick;

/// Commands computed ahead of the link that takes them; more wait for it.
constexpr std::size_t kMostCommandsAhead = 4096;

bool same_bits(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  });
}

/// True for the state that a tick saw, by what distinguishes it from the others that the link
/// published.
bool is_seen(const RecordedTick& tick, const haptic::DeviceState& state) {
  ServoInput input;
  input.state = state;
  const RecordedTick of = hal::recorded(input, ServoResult{});
  return of.sequence == tick.sequence && of.stamp_ns == tick.stamp_ns && of.link == tick.link &&
         of.twist_valid == tick.twist_valid && of.device_faults == tick.device_faults &&
         of.accepted_tick == tick.accepted_tick && same_bits(of.accepted_d, tick.accepted_d);
}

bool is_made(const RecordedTick& expected, const RecordedTick& found) {
  return expected.tick == found.tick && expected.state_content == found.state_content &&
         expected.state_hash == found.state_hash &&
         same_bits(expected.command_d, found.command_d) &&
         expected.command_sequence == found.command_sequence && expected.arming == found.arming &&
         expected.faults == found.faults && expected.limiter_flags == found.limiter_flags &&
         expected.arming_state == found.arming_state;
}

}  // namespace

void EventTrack::advance() {
  if (++clock_ < clocks_) {
    event_.stamp_ns = hal::clock_of(record_, clock_);
    return;
  }
  clock_ = clocks_ = 0;
  do {
    has_next_ = reader_.next(record_);
  } while (has_next_ && !record_.is_event());
  if (!has_next_) return;
  if (record_.kind != static_cast<std::uint8_t>(LinkEventKind::kClock)) {
    event_ = hal::event_of(record_);
    return;
  }
  clocks_ = hal::clock_count(record_);
  event_ = LinkEvent{};
  event_.kind = LinkEventKind::kClock;
  event_.stamp_ns = hal::clock_of(record_, 0);
}

void TickTrack::advance() {
  given_.clear();
  while ((has_next_ = reader_.next(record_)) && record_.kind != hal::kTickRecord) {
    if (record_.is_given()) given_.push_back(hal::given_of(record_));
  }
  if (has_next_) tick_ = hal::tick_of(record_);
}

std::string text_of(const LinkEvent& event) {
  std::string text =
      kKinds[std::min<std::size_t>(static_cast<std::size_t>(event.kind), kKinds.size() - 1)];
  if (event.kind == LinkEventKind::kReport && event.code < kVerdicts.size())
    text += std::string(", verdict ") + kVerdicts[event.code];
  else if (event.code != 0)
    text += ", code " + std::to_string(event.code);
  if (event.number != 0) text += ", number " + std::to_string(event.number);
  if (event.stamp_ns != 0) text += ", stamp " + std::to_string(event.stamp_ns) + " ns";
  if (!event.bytes.empty()) text += ", " + std::to_string(event.bytes.size()) + " bytes";
  return text;
}

/// "a pose of driven part 2", for a message.
std::string text_of(const hal::RecordedGiven& given) {
  using Kind = hal::RecordedGiven::Kind;
  const std::string number = std::to_string(given.number);
  if (given.kind == Kind::kRelease) return "that the hand lets its part go";
  if (given.kind == Kind::kTake) return "that the hand takes part " + number;
  return given.number == 0 ? "a pose of the fixed parts" : "a pose of driven part " + number;
}

std::string difference(const LinkEvent& expected, const LinkEvent& found) {
  std::string text = "\n  expected " + text_of(expected) + "\n  found    " + text_of(found);
  if (expected.kind != found.kind || std::ranges::equal(expected.bytes, found.bytes)) return text;
  return text + "\n  bytes expected " + hex(expected.bytes) + "\n  bytes found    " +
         hex(found.bytes);
}

std::string difference(const hal::RecordedTick& expected, const hal::RecordedTick& found) {
  std::string text;
  const auto compare = [&](const char* name, std::uint64_t a, std::uint64_t b) {
    if (a == b) return;
    text += std::string("\n  ") + name + ": expected " + std::to_string(a) + ", found " +
            std::to_string(b);
  };
  compare("tick", expected.tick, found.tick);
  if (expected.state_content != found.state_content)
    text += "\n  pose, twist or switches of its state: expected hash " +
            tools::hash_text(expected.state_content) + ", found " +
            tools::hash_text(found.state_content);
  if (expected.state_hash != found.state_hash)
    text += "\n  hash of the core's state: expected " + tools::hash_text(expected.state_hash) +
            ", found " + tools::hash_text(found.state_hash);
  compare_wrench(text, expected.command_d, found.command_d);
  compare("state answered", expected.command_sequence, found.command_sequence);
  compare("count of armings", expected.arming, found.arming);
  compare("arming", expected.arming_state, found.arming_state);
  compare("faults", expected.faults, found.faults);
  compare("limiter's flags", expected.limiter_flags, found.limiter_flags);
  return text;
}

std::string reports_around(std::span<const std::uint8_t> file, std::size_t first,
                           std::uint64_t sequence) {
  std::string text;
  hal::BusRecordReader reader(file, first);
  hal::BusRecord record;
  while (reader.next(record)) {
    if (record.kind != static_cast<std::uint8_t>(LinkEventKind::kReport)) continue;
    const LinkEvent report = hal::event_of(record);
    if (report.number + 1 < sequence) continue;
    if (report.number > sequence + 1) break;
    text += "\n  record " + std::to_string(record.number) + ", byte " +
            std::to_string(record.offset) + ": " + text_of(report) + "\n    " + hex(report.bytes);
  }
  return text;
}

PlayedServo::PlayedServo(CoreSession& session, const hal::BusSession& header,
                         std::span<const std::uint8_t> file, std::size_t first, PlayWatch watch)
    : session_(session), parameters_(header.servo), track_(file, first), watch_(std::move(watch)) {
  states_.emplace_back();  // what a mailbox holds before the first
  restart();
}

void PlayedServo::restart() {
  if (Hands* const hands = session_.hands(); hands != nullptr) {
    hands->reset();
    tick_ = std::make_unique<ServoTick>(hands->hand(0), parameters_, nullptr);
    return;
  }
  session_.core().reset();
  tick_ = std::make_unique<ServoTick>(session_.core(), parameters_,
                                      session_.view().header().capacity, nullptr);
}

bool PlayedServo::give(const hal::RecordedGiven& given) {
  using Kind = hal::RecordedGiven::Kind;
  const std::size_t driven = session_.parts() == nullptr ? 0 : session_.parts()->driven().size();
  if (given.kind == Kind::kFrame) {
    if (given.number > driven) return false;
    (given.number == 0 ? frame_ : driven_[given.number - 1]) = given.frame;
    return true;
  }
  if (session_.hand() == nullptr) return false;
  if (given.kind == Kind::kTake) return session_.hand()->prepare(given.number) == RtStatus::kOk;
  session_.hand()->release();
  return true;
}

bool PlayedServo::step() {
  if (!track_.has_next() || !difference_.empty()) return false;
  const RecordedTick& expected = track_.next();
  const auto state = std::ranges::find_if(
      states_, [&](const haptic::DeviceState& s) { return is_seen(expected, s); });
  if (state == states_.end()) return false;
  states_.erase(states_.begin(), state);
  if (expected.tick == 1 && ticks_ > 0) restart();
  for (const hal::RecordedGiven& given : track_.given()) {
    if (give(given)) continue;
    difference_ = "\n  " + text_of(given) + ", which the scene does not have or is not free";
    return false;
  }
  ServoInput input;
  input.state = states_.front();
  input.frame = frame_;
  if (session_.parts() != nullptr)
    input.driven = std::span(driven_).first(session_.parts()->driven().size());
  input.now_ns = expected.now_ns;
  input.late_periods = expected.late_periods;
  input.emergency_stop = expected.emergency_stop;
  const ServoResult result = tick_->step(input);
  const RecordedTick found = hal::recorded(input, result);
  if (!is_made(expected, found)) {
    difference_ = difference(expected, found);
    return false;
  }
  if (watch_) watch_(parameters_, input, result);
  commands_.push_back(result.command);
  ++ticks_;
  track_.advance();
  return true;
}

void PlayedServo::run() {
  while (commands_.size() < kMostCommandsAhead && step()) {
  }
}

const DeviceCommand* PlayedServo::command(std::uint64_t tick, std::int64_t stamp_ns) {
  for (;;) {
    while (!commands_.empty()) {
      const DeviceCommand& oldest = commands_.front();
      if (oldest.tick == tick && oldest.stamp_ns == stamp_ns) return &oldest;
      commands_.pop_front();
    }
    if (!step()) return nullptr;
  }
}

void PlayedServo::run_to_end() {
  while (step()) commands_.clear();
}

}  // namespace haptic::sim
