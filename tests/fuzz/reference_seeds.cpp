// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_reference: one of each record, and sessions of the driver.
#include <array>
#include <bit>

#include "hal/drivers/reference_short.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

using namespace haptic::hal;

template <std::size_t N, typename Record>
std::string text_of(const Record& record) {
  std::array<std::uint8_t, N> bytes{};
  encode(record, bytes);
  return {bytes.begin(), bytes.end()};
}

std::string text_of(float number) {
  const auto bits = std::bit_cast<std::uint32_t>(number);
  std::string text;
  for (unsigned k = 0; k < 4; ++k) text += static_cast<char>(bits >> (8 * k) & 0xff);
  return text;
}

/// What fuzz_reference.cpp does by these numbers: see run_session there.
std::string raw_report(const ReferenceReport& report) {
  return std::string{'\0', static_cast<char>(kReferenceReportBytes)} +
         text_of<kReferenceReportBytes>(report);
}
std::string composed_report(const ReferenceReport& report) {
  return '\2' + text_of<kReferenceReportBytes>(report);
}
std::string push(float force_n) {
  return '\3' + text_of(force_n) + text_of(0.0f) + text_of(-force_n) + text_of(0.01f) +
         text_of(0.0f) + text_of(0.0f);
}
constexpr char kZeroWrench = '\4';

/// From power-up to a push, a stop of the given kind, and a push again.
std::string session(std::uint8_t stop) {
  ReferenceReport report;
  std::string text(1, '\0');
  text += composed_report(report);
  text += kZeroWrench;
  report.status = kReferenceCalibrated | kReferenceTwistValid;
  report.velocity = {1000, -1000, 0};
  text += composed_report(report) + kZeroWrench;
  report.status |= kReferenceDrivesOn;
  for (int k = 0; k < 3; ++k) text += composed_report(report) + kZeroWrench;
  text += push(2.0f) + composed_report(report) + push(40.0f);
  ReferenceReport stopped = report;
  stopped.status = stop;
  text += composed_report(stopped) + push(2.0f) + composed_report(report) + push(2.0f);
  for (int k = 0; k < 2; ++k) text += composed_report(report) + kZeroWrench;
  return text + push(2.0f);
}

/// A board of full speed: power-up to a push.
std::string short_session() {
  ReferenceShortReport report;
  const auto composed = [&] { return '\5' + text_of<kReferenceShortReportBytes>(report); };
  std::string text(1, '\0');
  text += composed() + kZeroWrench;
  report.status = kReferenceCalibrated;
  report.velocity = {1000, -1000, 0};
  text += composed() + kZeroWrench;
  report.status |= kReferenceDrivesOn;
  for (int k = 0; k < 3; ++k) text += composed() + kZeroWrench;
  text += push(2.0f) + composed() + push(40.0f);
  report.rejected = 1;
  return text + composed() + push(2.0f);
}

std::string block_session() {
  ReferenceBlock block;
  block.driven_dof = 7;
  block.max_torque = 0;
  ReferenceReport report;
  report.status = kReferenceCalibrated;
  report.sequence = 0xffff'ffff;
  std::string text = '\1' + text_of<kReferenceBlockBytes>(block) + raw_report(report);
  report.sequence = 0;
  text += kZeroWrench + raw_report(report);
  report.accepted_sequence = 0x4000'0000;
  return text + push(1.0f) + raw_report(report);
}

/// A device of 1.1 with a gripper.
std::string long_block_session() {
  ReferenceLongBlock block;
  block.latency_us = 400;
  block.largest_gap_um = 70'000;
  block.name = device_text("Desk arm");
  block.serial = device_text("007");
  ReferenceReport report;
  report.status = kReferenceCalibrated | kReferenceSlewing;
  report.sequence = 1;
  report.gripper = 25'001;
  std::string text = '\3' + text_of<kReferenceLongBlockBytes>(block) + raw_report(report);
  report.sequence = 2;
  report.gripper = 70'002;
  return text + kZeroWrench + raw_report(report) + composed_report(report);
}

}  // namespace

std::vector<Seed> seeds() {
  ReferenceCommand command;
  command.drives_on = true;
  command.force = {1, -2, 3};
  const auto cut = static_cast<std::uint8_t>(kReferenceCalibrated | kReferenceWatchdogCut);
  const auto stop = static_cast<std::uint8_t>(kReferenceCalibrated | kReferenceEmergencyStop);
  return {{"report", text_of<kReferenceReportBytes>(ReferenceReport{})},
          {"short_report", text_of<kReferenceShortReportBytes>(ReferenceShortReport{})},
          {"command", text_of<kReferenceCommandBytes>(command)},
          {"block", text_of<kReferenceBlockBytes>(ReferenceBlock{})},
          {"session_cut", session(cut)},
          {"session_stop", session(stop)},
          {"session_drop", session(kReferenceCalibrated)},
          {"session_lost", session(0)},
          {"session_short", short_session()},
          {"session_block", block_session()},
          {"long_block", text_of<kReferenceLongBlockBytes>(ReferenceLongBlock{})},
          {"short_gripper", text_of<kReferenceShortGripperBytes>(ReferenceShortReport{})},
          {"session_long_block", long_block_session()}};
}

}  // namespace haptic::fuzz
