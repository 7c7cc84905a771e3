// SPDX-License-Identifier: Apache-2.0
#include "tests/hal/falcon_counterpart.hpp"

#include <algorithm>

#include "hal/drivers/falcon_firmware.hpp"

namespace haptic::test {

void FalconCounterpart::reset_boot() {
  heard_.clear();
  image_.clear();
  greetings_ = 0;
}

void FalconCounterpart::power_cycle() {
  running_ = false;
  boot_ = Boot::kDeaf;
  homing_packets_ = packets_ = 0;
  baud_ = 0;
  dtr_ = false;
  rts_ = true;
  last_command_ = {};
  stream_.clear();
  to_host_.clear();
  reset_boot();
}

void FalconCounterpart::power_up_loaded() {
  power_cycle();
  running_ = true;
}

bool FalconCounterpart::move_to(const hal::Column3& position_f) {
  hal::FalconAngles angles{};
  if (!arm_.angles_at(position_f, angles)) return false;
  counts = arm_.counts_of(angles);
  return true;
}

void FalconCounterpart::on_modem(std::uint16_t value) {
  if (value == hal::kFtdiRtsLow) rts_ = false;
  if (value == hal::kFtdiDtrLow) {
    dtr_ = false;
    // DTR going down in the middle of a greeting is the step to the faster line.
    if (boot_ != Boot::kGreeted) boot_ = Boot::kDeaf;
  }
  if (value == hal::kFtdiDtrHigh) {
    if (!dtr_ && !running_) {  // the rising edge resets the processor into its loader
      boot_ = Boot::kGreeting;
      reset_boot();
    }
    dtr_ = true;
  }
}

bool FalconCounterpart::on_control(const hal::ControlRequest& request,
                                   std::span<std::uint8_t> /*bytes*/, std::size_t& moved) {
  moved = 0;
  if (request.request_type != 0x40 || request.index != 0) return false;
  switch (request.request) {
    case hal::kFtdiReset:
      if (request.value == 1) to_host_.clear();
      return request.value <= 2;
    case hal::kFtdiModem:
      on_modem(request.value);
      return true;
    case hal::kFtdiFlow:
      return request.value == 0;
    case hal::kFtdiBaud:
      baud_ = request.value;
      return true;
    case hal::kFtdiFormat:
      return request.value == 8;
    case hal::kFtdiLatency:
      latency_ms_ = request.value;
      return request.value >= 1 && request.value <= 255;
    default:
      return false;
  }
}

void FalconCounterpart::boot_byte(std::uint8_t byte) {
  if (boot_ == Boot::kGreeting && baud_ == hal::kFtdiBaud9600 && dtr_ && !rts_) {
    heard_.push_back(byte);
    const std::vector<std::uint8_t> greeting{0x0a, 0x43, 0x0d};
    if (heard_.size() < greeting.size()) return;
    const bool right = heard_ == greeting;
    heard_.clear();
    if (!right || ++greetings_ <= faults.deaf_greetings) return;
    if (faults.leading_zero) to_host_.push_back(0);
    for (const int b : {0x0a, 0x44, faults.wrong_greeting ? 0x2d : 0x2c, 0x0d}) {
      to_host_.push_back(static_cast<std::uint8_t>(b));
    }
    if (!faults.wrong_greeting) boot_ = Boot::kGreeted;
  } else if (boot_ == Boot::kGreeted && baud_ == hal::kFtdiBaudLoad && !dtr_) {
    to_host_.push_back(byte);
    if (byte == 0x41) {
      boot_ = Boot::kLoading;
      ++loads_;
    }
  } else if (boot_ == Boot::kLoading && baud_ == hal::kFtdiBaudLoad) {
    load_byte(byte);
  }
}

void FalconCounterpart::load_byte(std::uint8_t byte) {
  const auto at = static_cast<long>(image_.size());
  const bool spoilt = loads_ <= faults.bad_loads;
  image_.push_back(byte);
  if (spoilt && faults.silent_echo_at >= 0 && at >= faults.silent_echo_at) return;
  const bool wrong = spoilt && at == faults.wrong_echo_at;
  to_host_.push_back(static_cast<std::uint8_t>(wrong ? byte ^ 0x10 : byte));
  running_ = image_.size() == image_bytes_ && !faults.firmware_dead;
}

void FalconCounterpart::run_byte(std::uint8_t byte) {
  if (baud_ != hal::kFtdiBaudRun) return;  // noise on the line
  if (stream_.push(byte) != hal::FalconStream::Step::kPacket) return;
  hal::FalconCommand command;
  if (!hal::decode(stream_.packet(), command)) return;
  last_command_ = command;
  ++packets_;
  if (command.homing) ++homing_packets_;
  hal::FalconReport report;
  report.buttons = buttons;
  for (int leg = 0; leg < 3; ++leg) {  // one after the other
    if (homing_packets_ * 3 >= home_after * (leg + 1)) {
      report.homed = static_cast<std::uint8_t>(report.homed | 1u << leg);
    }
  }
  // Before homing the counters stand anywhere.
  report.counts = report.all_homed() ? counts : std::array<std::int16_t, 3>{-32768, 12345, 77};
  for (const std::uint8_t b : hal::encode(report)) to_host_.push_back(b);
}

bool FalconCounterpart::on_out(std::span<const std::uint8_t> bytes) {
  if (faults.silent) return true;
  for (const std::uint8_t byte : bytes) {
    if (running_) {
      run_byte(byte);
    } else {
      boot_byte(byte);
    }
  }
  return true;
}

std::size_t FalconCounterpart::on_in(std::span<std::uint8_t> bytes) {
  if (bytes.size() < hal::kFtdiStatusBytes) return 0;
  bytes[0] = 0x01;
  bytes[1] = 0x60;
  const std::size_t room = std::min(bytes.size(), hal::kFtdiPacketBytes) - hal::kFtdiStatusBytes;
  const std::size_t count = std::min({room, in_payload, to_host_.size()});
  for (std::size_t i = 0; i < count; ++i) {
    bytes[hal::kFtdiStatusBytes + i] = to_host_.front();
    to_host_.pop_front();
  }
  return hal::kFtdiStatusBytes + count;
}

bool FalconCounterpart::is_gone() {
  ++calls_;
  return gone || (faults.gone_after_calls >= 0 && calls_ > faults.gone_after_calls);
}

bool FalconCounterpart::cancelled() const noexcept {
  return faults.cancelled_after_calls >= 0 && calls_ >= faults.cancelled_after_calls;
}

}  // namespace haptic::test
