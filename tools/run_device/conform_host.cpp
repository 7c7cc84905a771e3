// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/conform_host.hpp"

#include <algorithm>
#include <array>

#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/reference_short.hpp"

namespace haptic::tools {
namespace {

constexpr std::int64_t kNsPerUs = 1000;
constexpr std::int64_t kLeastPatience_ns = 300'000'000;
// Reports in which a command has to show, and how often one that does not show is sent: a device in
// another process never sees one that it looks at too late.
constexpr int kReportsToShow = 6;
constexpr unsigned kMostSends = 4;

const char* words_of(hal::CodecVerdict verdict) {
  switch (verdict) {
    case hal::CodecVerdict::kOk:
      return "is right";
    case hal::CodecVerdict::kBadLength:
      return "has a wrong length";
    case hal::CodecVerdict::kBadMagic:
      return "has a wrong magic";
    case hal::CodecVerdict::kBadVersion:
      return "has another version";
    case hal::CodecVerdict::kBadCheck:
      return "has a wrong CRC-32";
    case hal::CodecVerdict::kBadReserved:
      return "has reserved bytes or bits that are not 0";
    case hal::CodecVerdict::kBadNumber:
      return "has an orientation that is no unit quaternion";
    case hal::CodecVerdict::kBadText:
      return "has a name or serial number that is not printable ASCII with a zero behind it";
  }
  return "cannot be read";
}

}  // namespace

std::string ConformHost::ask(std::size_t room, hal::ReferenceLongBlock& read, bool& stalled) {
  std::array<std::uint8_t, hal::kReferenceLongBlockBytes> bytes{};
  const std::string who = "the capability block for " + std::to_string(room) + " bytes ";
  std::size_t moved = 0;
  const hal::HalStatus status = carrier_.control(
      {hal::kReferenceBlockRequestType, hal::kReferenceBlockRequest, hal::kReferenceVersion, 0},
      std::span(bytes).first(room), moved);
  stalled = status == hal::HalStatus::kTransferFailed;
  if (status != hal::HalStatus::kOk) return who + "is not answered: " + hal::to_text(status);
  const hal::CodecVerdict verdict =
      hal::decode_either(std::span(bytes).first(std::min(moved, room)), read);
  if (verdict != hal::CodecVerdict::kOk) return who + words_of(verdict);
  if (!hal::is_plausible(hal::capabilities_of(read)))
    return who + "has a number outside of the ranges of section 5";
  return "";
}

std::string ConformHost::ask_block() {
  hal::ReferenceLongBlock read;
  bool stalled = false;
  std::string defect = ask(hal::kReferenceLongBlockBytes, read, stalled);
  if (stalled) defect = ask(hal::kReferenceBlockBytes, read, stalled);
  if (defect.empty()) block_ = read;
  return defect;
}

std::string ConformHost::ask_old_block() {
  hal::ReferenceLongBlock read;
  bool stalled = false;
  const std::string defect = ask(hal::kReferenceBlockBytes, read, stalled);
  if (!defect.empty()) return defect;
  return read.first == block_.first
             ? ""
             : "the blocks for hosts of 1.0 and of 1.1 differ in bytes 3 to 59";
}

std::uint32_t ConformHost::slew_us() const {
  const hal::ReferenceBlock& b = block();
  const auto time_us = [&](double limit, double rate) {
    return rate > 0 ? 1e6 * limit / rate : 0.5 * watchdog_us();
  };
  const double force_us =
      time_us(b.max_force * hal::kReferenceForceUnit_n, b.max_force_rate_mn_per_s * 1e-3);
  const double torque_us =
      time_us(b.max_torque * hal::kReferenceTorqueUnit_nm, b.max_torque_rate_mnm_per_s * 1e-3);
  const double longest_us = std::max((b.driven_dof & hal::kDofTranslation) != 0 ? force_us : 0.0,
                                     (b.driven_dof & hal::kDofRotation) != 0 ? torque_us : 0.0);
  return static_cast<std::uint32_t>(std::min(longest_us, 1e9));
}

/// A report of a device uses what 1.1 adds only where that speaks it.
std::string ConformHost::defect_of_version(std::size_t size) const {
  const bool has_gripper = block_.largest_gap_um != 0;
  if (!speaks_1_1() && (report_.gripper != 0 || says(hal::kReferenceSlewing)))
    return "has what version 1.1 adds, and the device answers as one of 1.0";
  if (report_.gripper != 0 && !has_gripper) return "has a gap, and the block has no gripper";
  if (report_.gripper > block_.largest_gap_um + 1) return "has a gap beyond the block's largest";
  if (size == hal::kReferenceShortReportBytes && has_gripper) return "has no room for the gap";
  return size == hal::kReferenceShortGripperBytes && !has_gripper
             ? "is 62 bytes long, and the block has no gripper"
             : "";
}

bool ConformHost::next() {
  std::array<std::uint8_t, 128> bytes{};
  const std::int64_t patience_ns = std::max(kLeastPatience_ns, 50 * kNsPerUs * period_us());
  const std::size_t size = carrier_.receive(bytes, patience_ns);
  if (size == 0) {
    trouble_ = "no report came for " + std::to_string(patience_ns / 1'000'000) + " ms";
    return false;
  }
  const hal::CodecVerdict verdict =
      hal::decode_either(std::span(bytes).first(std::min(size, bytes.size())), report_);
  if (verdict != hal::CodecVerdict::kOk) {
    trouble_ = std::string("a report of ") + std::to_string(size) + " bytes " + words_of(verdict);
    return false;
  }
  short_ = size != hal::kReferenceReportBytes;
  if (const std::string defect = defect_of_version(size); !defect.empty()) {
    trouble_ = "a report of " + std::to_string(size) + " bytes " + defect;
    return false;
  }
  time_before_us_ = time_us_;
  time_us_ = static_cast<std::uint32_t>(report_.time_us & 0xffff'ffffu);
  return true;
}

ConformHost::Bytes ConformHost::command(std::uint32_t sequence, bool drives_on) {
  Bytes bytes(hal::kReferenceCommandBytes);
  hal::encode(hal::ReferenceCommand{drives_on, sequence, sequence, {}, {}},
              std::span<std::uint8_t, hal::kReferenceCommandBytes>(bytes));
  return bytes;
}

ConformHost::Outcome ConformHost::exchange(std::span<const std::uint8_t> bytes,
                                           std::uint32_t sequence) {
  Outcome outcome;
  const std::uint32_t accepted = report_.accepted_sequence, rejected = report_.rejected;
  while (outcome.sent < kMostSends && !outcome.accepted && outcome.counted == 0) {
    if (!carrier_.send(bytes)) break;
    ++outcome.sent;
    for (int k = 0; k < kReportsToShow && !outcome.accepted && outcome.counted == 0; ++k) {
      if (!next()) return outcome;
      outcome.counted = (report_.rejected - rejected) & (short_ ? 0xffu : 0xffff'ffffu);
      outcome.accepted =
          report_.accepted_sequence != accepted && report_.accepted_sequence == sequence;
    }
  }
  return outcome;
}

bool ConformHost::accept(bool drives_on) {
  trouble_.clear();
  const std::uint32_t sequence = report_.accepted_sequence + 1;
  const Outcome outcome = exchange(command(sequence, drives_on), sequence);
  fed_us_ = time_us_;
  return outcome.accepted && outcome.counted < outcome.sent;
}

std::string ConformHost::refuse(const Bytes& bytes) {
  const hal::ReferenceReport before = report_;
  const bool drove = says(hal::kReferenceDrivesOn);
  trouble_.clear();
  // No sequence shows its acceptance, which bytes 76 and 84 do.
  const Outcome outcome = exchange(bytes, before.accepted_sequence);
  if (!trouble_.empty()) return trouble_;
  if (report_.accepted_sequence != before.accepted_sequence) return "was accepted";
  if (report_.accepted_tick != before.accepted_tick) return "changed byte 76";
  if (outcome.counted == 0) return "was not counted as rejected";
  if (outcome.counted > outcome.sent) return "was counted more than once";
  if (drove && !says(hal::kReferenceDrivesOn)) return "took the drives off";
  if (!drove && says(hal::kReferenceDrivesOn)) return "put the drives on";
  return "";
}

std::string ConformHost::bring_up() {
  const auto because = [this](const char* defect) {
    return trouble_.empty() ? std::string(defect) : trouble_;
  };
  if (!accept(false)) return because("a command with bit 0 clear is not accepted");
  if (!says(hal::kReferenceCalibrated)) return "it is not calibrated";
  if (says(hal::kReferenceEmergencyStop)) return "its emergency stop is pressed";
  if (says(hal::kReferenceWatchdogCut)) return "a command with bit 0 clear leaves the cut";
  if (!accept(true)) return because("a command with bit 0 set is not accepted");
  return says(hal::kReferenceDrivesOn) ? "" : "the drives do not go on";
}

void ConformHost::feed() {
  if (says(hal::kReferenceDrivesOn) && time_us_ - fed_us_ > watchdog_us() / 4) (void)accept(true);
}

}  // namespace haptic::tools
