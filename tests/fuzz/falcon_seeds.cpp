// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_falcon: streams whole, cut and broken, with homing gained and lost; dialogues that
/// load at once, after a wrong echo, and never.
#include <span>

#include "hal/drivers/falcon_codec.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

using hal::FalconReport;

std::string text_of(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

/// A step "read" with one transfer: status bytes, then `payload`.
std::string transfer(const std::string& payload) {
  std::string step(1, '\0');
  step += static_cast<char>(payload.size() + 2);
  step += "\x01\x60";
  return step + payload;
}

std::string packet(std::int16_t count, std::uint8_t homed) {
  FalconReport report;
  report.counts = {count, static_cast<std::int16_t>(count + 40), static_cast<std::int16_t>(-count)};
  report.homed = homed;
  report.buttons = 2;
  return text_of(hal::encode(report));
}

/// A step "write": force 1, -2, 3 N as floats, torque zero.
std::string force() {
  return std::string("\x01\0\0\x80\x3f\0\0\0\xc0\0\0\x40\x40", 13) + std::string(12, '\0');
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string reports(1, '\0'), dialogue(1, '\x01');
  const std::string whole = packet(300, 7);
  return {
      {"homes_and_pushes", reports + transfer(packet(0, 0)) + force() + transfer(packet(0, 3)) +
                               transfer(whole) + force() + transfer(packet(320, 7)) + force() +
                               transfer(packet(320, 1)) + force()},
      {"cut_and_joined", reports + transfer(whole.substr(0, 5)) + transfer("") +
                             transfer(whole.substr(5)) + transfer(whole + whole.substr(0, 9)) +
                             transfer(whole.substr(9)) + force()},
      {"broken", reports + transfer(whole.substr(0, 7) + whole) + transfer(">>" + whole.substr(1)) +
                     transfer(packet(30000, 7)) + transfer(packet(30000, 7)) +
                     transfer(packet(30000, 7)) + force() + transfer(whole)},
      {"runs_already", dialogue + std::string(4, '\0') + "\x90" + whole},
      {"loads", dialogue + std::string(4, '\0') + std::string(400, '\0')},
      {"wrong_echo", dialogue + std::string(4, '\0') + std::string(60, '\xfe') +
                         std::string(20, '\0') + "\x81x" + std::string(300, '\0')},
      {"gone", dialogue + std::string(4, '\0') + std::string(70, '\0') + "\xff"},
      {"mute", dialogue + std::string(4, '\0') + std::string(500, '\xfe')}};
}

}  // namespace haptic::fuzz
