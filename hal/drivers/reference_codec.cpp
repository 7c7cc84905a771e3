// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/reference_codec.hpp"

#include "hal/drivers/reference_bytes.hpp"

namespace haptic::hal {
namespace reference_bytes {

// The bytes of each kind between its head and its check sum, in their order: written by a
// ByteWriter from a const record, read by a ByteReader into one that is not.
template <typename Bytes, RecordOf<ReferenceReport> Report>
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
  bytes.field(r.accepted_tick);
  bytes.field(r.rejected);
  bytes.field(r.accepted_sequence);
  bytes.field(r.gripper);
}

template <typename Bytes, RecordOf<ReferenceCommand> Command>
void layout(Bytes& bytes, Command& c) noexcept {
  bytes.bit(c.drives_on);
  bytes.field(c.sequence);
  bytes.field(c.tick);
  bytes.field(c.force);
  bytes.field(c.torque);
  bytes.reserved(16);
}

template <typename Bytes, RecordOf<ReferenceBlock> Block>
void layout(Bytes& bytes, Block& b) noexcept {
  bytes.bit(b.twist_sensed);
  bytes.field(b.sensed_dof);
  bytes.field(b.driven_dof);
  bytes.field(b.report_period_us);
  bytes.field(b.watchdog_ms);
  bytes.reserved(2);
  bytes.field(b.max_force);
  bytes.field(b.max_torque);
  bytes.field(b.max_force_rate_mn_per_s);
  bytes.field(b.max_torque_rate_mnm_per_s);
  bytes.field(b.max_stiffness_mn_per_m);
  bytes.field(b.max_damping_mns_per_m);
  bytes.field(b.mass_mg);
  bytes.field(b.damping_uns_per_m);
  bytes.field(b.friction);
  bytes.field(b.encoder_step_nm);
  bytes.field(b.encoder_step_nrad);
  bytes.field(b.workspace_radius_um);
}

template <typename Bytes, RecordOf<ReferenceLongBlock> Block>
void layout(Bytes& bytes, Block& b) noexcept {
  layout(bytes, b.first);
  bytes.field(b.minor);
  bytes.bit(b.is_displacement);
  bytes.reserved(2);
  bytes.field(b.latency_us);
  bytes.field(b.largest_gap_um);
  bytes.reserved(4);
  bytes.text(b.name);
  bytes.text(b.serial);
}

}  // namespace reference_bytes

namespace {

using reference_bytes::read_record;
using reference_bytes::write_record;

constexpr std::array<std::uint32_t, 256> crc_table() noexcept {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t rest = byte;
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest & 1u) != 0 ? rest >> 1 ^ 0xedb88320u : rest >> 1;
    }
    table[byte] = rest;
  }
  return table;
}
constexpr std::array<std::uint32_t, 256> kCrcTable = crc_table();

/// In floating point: four squares of 32-bit numbers pass 64 bits.
bool is_unit(const std::array<std::int32_t, 4>& q) noexcept {
  double square = 0;
  for (const std::int32_t component : q) {
    const double x = component * kReferenceOrientationUnit;
    square += x * x;
  }
  constexpr double kSlack = 1.0e-3;
  return square >= (1 - kSlack) * (1 - kSlack) && square <= (1 + kSlack) * (1 + kSlack);
}

bool has_known_dof(const ReferenceBlock& block) noexcept {
  return ((block.sensed_dof | block.driven_dof) & ~0x3f) == 0;
}

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept {
  std::uint32_t rest = 0xffff'ffffu;
  for (const std::uint8_t byte : bytes) {
    rest = kCrcTable[(rest ^ byte) & 0xffu] ^ rest >> 8;
  }
  return ~rest;
}

void encode(const ReferenceReport& report,
            std::span<std::uint8_t, kReferenceReportBytes> bytes) noexcept {
  write_record(report, kReferenceReportMagic, bytes);
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceReport& report) noexcept {
  ReferenceReport read;
  const CodecVerdict verdict =
      read_record(bytes, kReferenceReportBytes, kReferenceReportMagic, read);
  if (verdict != CodecVerdict::kOk) return verdict;
  if ((read.status & ~unsigned{kReferenceStatusBits}) != 0 ||
      (read.faults & ~kReferenceFaultBits) != 0) {
    return CodecVerdict::kBadReserved;
  }
  if (!is_unit(read.orientation)) return CodecVerdict::kBadNumber;
  report = read;
  return CodecVerdict::kOk;
}

void encode(const ReferenceCommand& command,
            std::span<std::uint8_t, kReferenceCommandBytes> bytes) noexcept {
  write_record(command, kReferenceCommandMagic, bytes);
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceCommand& command) noexcept {
  ReferenceCommand read;
  const CodecVerdict verdict =
      read_record(bytes, kReferenceCommandBytes, kReferenceCommandMagic, read);
  if (verdict == CodecVerdict::kOk) command = read;
  return verdict;
}

void encode(const ReferenceBlock& block,
            std::span<std::uint8_t, kReferenceBlockBytes> bytes) noexcept {
  write_record(block, kReferenceBlockMagic, bytes);
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceBlock& block) noexcept {
  ReferenceBlock read;
  const CodecVerdict verdict = read_record(bytes, kReferenceBlockBytes, kReferenceBlockMagic, read);
  if (verdict != CodecVerdict::kOk) return verdict;
  if (!has_known_dof(read)) return CodecVerdict::kBadReserved;
  block = read;
  return CodecVerdict::kOk;
}

void encode(const ReferenceLongBlock& block,
            std::span<std::uint8_t, kReferenceLongBlockBytes> bytes) noexcept {
  ReferenceLongBlock written = block;
  written.minor = kReferenceMinor;
  write_record(written, kReferenceBlockMagic, bytes);
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceLongBlock& block) noexcept {
  ReferenceLongBlock read;
  const CodecVerdict verdict =
      read_record(bytes, kReferenceLongBlockBytes, kReferenceBlockMagic, read);
  if (verdict != CodecVerdict::kOk) return verdict;
  if (read.minor != kReferenceMinor) return CodecVerdict::kBadVersion;
  if (!has_known_dof(read.first)) return CodecVerdict::kBadReserved;
  if (!is_text(read.name) || !is_text(read.serial)) return CodecVerdict::kBadText;
  block = read;
  return CodecVerdict::kOk;
}

CodecVerdict decode_either(std::span<const std::uint8_t> bytes,
                           ReferenceLongBlock& block) noexcept {
  if (bytes.size() != kReferenceBlockBytes) return decode(bytes, block);
  ReferenceLongBlock read;
  read.minor = 0;
  const CodecVerdict verdict = decode(bytes, read.first);
  if (verdict == CodecVerdict::kOk) block = read;
  return verdict;
}

}  // namespace haptic::hal
