// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/reference_short.hpp"

#include <cmath>

#include "hal/drivers/reference_bytes.hpp"

namespace haptic::hal {
namespace reference_bytes {

template <typename Bytes, RecordOf<ReferenceShortReport> Report>
void layout(Bytes& bytes, Report& r) noexcept {
  bytes.field(r.status);
  bytes.field(r.sequence);
  bytes.field(r.time_us);
  bytes.field(r.position);
  bytes.field(r.orientation);
  bytes.field(r.velocity);
  bytes.field(r.angular_velocity);
  bytes.field(r.switches);
  bytes.field(r.faults);
  bytes.field(r.rejected);
  bytes.field(r.accepted_sequence);
}

/// The longer form.
template <typename Report>
struct WithGripper {
  Report& report;
};

template <typename Bytes, typename Report>
void layout(Bytes& bytes, const WithGripper<Report>& r) noexcept {
  layout(bytes, r.report);
  bytes.field(r.report.gripper);
}

}  // namespace reference_bytes

namespace {

constexpr std::int64_t kUnit = std::int64_t{1} << 30;
constexpr std::int32_t kVelocityStep_um_per_s = 100, kTurnStep_urad_per_s = 1000;

/// x y z squared, in units of 2^-60; exact: three squares of 32-bit numbers stay below 2^64.
std::uint64_t square_of(const std::array<std::int32_t, 3>& v) noexcept {
  std::uint64_t square = 0;
  for (const std::int64_t x : v) square += static_cast<std::uint64_t>(x * x);
  return square;
}

std::array<std::int32_t, 3> scaled_up(const std::array<std::int16_t, 3>& v,
                                      std::int32_t step) noexcept {
  return {v[0] * step, v[1] * step, v[2] * step};
}

}  // namespace

void encode(const ReferenceShortReport& report,
            std::span<std::uint8_t, kReferenceShortReportBytes> bytes) noexcept {
  reference_bytes::write_record(report, kReferenceShortReportMagic, bytes);
}

void encode(const ReferenceShortReport& report,
            std::span<std::uint8_t, kReferenceShortGripperBytes> bytes) noexcept {
  const reference_bytes::WithGripper<const ReferenceShortReport> whole{report};
  reference_bytes::write_record(whole, kReferenceShortReportMagic, bytes);
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceShortReport& report) noexcept {
  ReferenceShortReport read;
  reference_bytes::WithGripper<ReferenceShortReport> whole{read};
  const CodecVerdict verdict =
      bytes.size() == kReferenceShortGripperBytes
          ? reference_bytes::read_record(bytes, kReferenceShortGripperBytes,
                                         kReferenceShortReportMagic, whole)
          : reference_bytes::read_record(bytes, kReferenceShortReportBytes,
                                         kReferenceShortReportMagic, read);
  if (verdict != CodecVerdict::kOk) return verdict;
  if ((read.status & ~unsigned{kReferenceStatusBits}) != 0 ||
      (read.faults & ~kReferenceFaultBits) != 0) {
    return CodecVerdict::kBadReserved;
  }
  constexpr auto kLongest = static_cast<std::uint64_t>(kUnit + kUnit / 1000);
  if (square_of(read.orientation) > kLongest * kLongest) return CodecVerdict::kBadNumber;
  report = read;
  return CodecVerdict::kOk;
}

ReferenceReport in_full(const ReferenceShortReport& report) noexcept {
  ReferenceReport r;
  r.status = report.status;
  r.sequence = report.sequence;
  r.time_us = report.time_us;
  r.position = report.position;
  constexpr auto kOne = static_cast<std::uint64_t>(kUnit * kUnit);
  const std::uint64_t square = square_of(report.orientation);
  const double w = square < kOne ? std::sqrt(static_cast<double>(kOne - square)) : 0;
  const std::array<std::int32_t, 3>& v = report.orientation;
  r.orientation = {v[0], v[1], v[2], static_cast<std::int32_t>(w + 0.5)};
  r.velocity = scaled_up(report.velocity, kVelocityStep_um_per_s);
  r.angular_velocity = scaled_up(report.angular_velocity, kTurnStep_urad_per_s);
  r.switches = report.switches;
  r.faults = report.faults;
  r.rejected = report.rejected;
  r.accepted_sequence = report.accepted_sequence;
  if (report.gripper != 0) r.gripper = 1 + (report.gripper - 1u) * kReferenceShortGap_um;
  return r;
}

CodecVerdict decode_either(std::span<const std::uint8_t> bytes, ReferenceReport& report) noexcept {
  if (bytes.size() != kReferenceShortReportBytes && bytes.size() != kReferenceShortGripperBytes)
    return decode(bytes, report);
  ReferenceShortReport read;
  const CodecVerdict verdict = decode(bytes, read);
  if (verdict == CodecVerdict::kOk) report = in_full(read);
  return verdict;
}

}  // namespace haptic::hal
