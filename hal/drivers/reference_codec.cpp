// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/reference_codec.hpp"

#include <concepts>

namespace haptic::hal {
namespace {

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

/// Shifts instead of copies: the bytes are the same on a host of either byte order.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <std::unsigned_integral T>
  void put(T value) noexcept {
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      bytes_[at_++] = static_cast<std::uint8_t>(value >> (8 * k) & 0xff);
    }
  }
  template <std::size_t N>
  void put(const std::array<std::int32_t, N>& values) noexcept {
    for (const std::int32_t value : values) put(static_cast<std::uint32_t>(value));
  }
  void put_zeros(std::size_t count) noexcept {
    for (std::size_t k = 0; k < count; ++k) bytes_[at_++] = 0;
  }
  void put_check() noexcept { put(crc32(bytes_.first(at_))); }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

class ByteReader {
 public:
  ByteReader(std::span<const std::uint8_t> bytes, std::size_t at) noexcept
      : bytes_(bytes), at_(at) {}

  template <std::unsigned_integral T>
  void take(T& value) noexcept {
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      sum |= std::uint64_t{bytes_[at_++]} << (8 * k);
    }
    value = static_cast<T>(sum);
  }
  template <std::size_t N>
  void take(std::array<std::int32_t, N>& values) noexcept {
    for (std::int32_t& value : values) {
      std::uint32_t bits = 0;
      take(bits);
      value = static_cast<std::int32_t>(bits);  // modulo 2^32: two's complement
    }
  }
  [[nodiscard]] bool take_zeros(std::size_t count) noexcept {
    std::uint8_t any = 0;
    for (std::size_t k = 0; k < count; ++k) any |= bytes_[at_++];
    return any == 0;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_;
};

/// What all three kinds share: length, magic, version, check sum.
CodecVerdict check_frame(std::span<const std::uint8_t> bytes, std::size_t length,
                         std::uint16_t magic) noexcept {
  if (bytes.size() != length) return CodecVerdict::kBadLength;
  ByteReader head(bytes, 0);
  std::uint16_t found = 0;
  std::uint8_t version = 0;
  head.take(found);
  head.take(version);
  if (found != magic) return CodecVerdict::kBadMagic;
  if (version != kReferenceVersion) return CodecVerdict::kBadVersion;
  std::uint32_t check = 0;
  ByteReader(bytes, length - 4).take(check);
  return check == crc32(bytes.first(length - 4)) ? CodecVerdict::kOk : CodecVerdict::kBadCheck;
}

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
  ByteWriter out(bytes);
  out.put(kReferenceReportMagic);
  out.put(kReferenceVersion);
  out.put(report.status);
  out.put(report.sequence);
  out.put(report.time_us);
  out.put(report.position);
  out.put(report.orientation);
  out.put(report.velocity);
  out.put(report.angular_velocity);
  out.put(report.switches);
  out.put(report.faults);
  out.put(report.accepted_tick);
  out.put(report.rejected);
  out.put(report.accepted_sequence);
  out.put_zeros(4);
  out.put_check();
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceReport& report) noexcept {
  const CodecVerdict frame = check_frame(bytes, kReferenceReportBytes, kReferenceReportMagic);
  if (frame != CodecVerdict::kOk) return frame;
  ReferenceReport read;
  ByteReader in(bytes, 3);
  in.take(read.status);
  in.take(read.sequence);
  in.take(read.time_us);
  in.take(read.position);
  in.take(read.orientation);
  in.take(read.velocity);
  in.take(read.angular_velocity);
  in.take(read.switches);
  in.take(read.faults);
  in.take(read.accepted_tick);
  in.take(read.rejected);
  in.take(read.accepted_sequence);
  const bool zeros = in.take_zeros(4);
  if (!zeros || (read.status & ~unsigned{kReferenceStatusBits}) != 0 ||
      (read.faults & ~kReferenceFaultBits) != 0) {
    return CodecVerdict::kBadReserved;
  }
  if (!is_unit(read.orientation)) return CodecVerdict::kBadNumber;
  report = read;
  return CodecVerdict::kOk;
}

void encode(const ReferenceCommand& command,
            std::span<std::uint8_t, kReferenceCommandBytes> bytes) noexcept {
  ByteWriter out(bytes);
  out.put(kReferenceCommandMagic);
  out.put(kReferenceVersion);
  out.put(static_cast<std::uint8_t>(command.drives_on ? 1 : 0));
  out.put(command.sequence);
  out.put(command.tick);
  out.put(command.force);
  out.put(command.torque);
  out.put_zeros(16);
  out.put_check();
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceCommand& command) noexcept {
  const CodecVerdict frame = check_frame(bytes, kReferenceCommandBytes, kReferenceCommandMagic);
  if (frame != CodecVerdict::kOk) return frame;
  ReferenceCommand read;
  std::uint8_t bits = 0;
  ByteReader in(bytes, 3);
  in.take(bits);
  in.take(read.sequence);
  in.take(read.tick);
  in.take(read.force);
  in.take(read.torque);
  const bool zeros = in.take_zeros(16);
  if (!zeros || bits > 1) return CodecVerdict::kBadReserved;
  read.drives_on = bits == 1;
  command = read;
  return CodecVerdict::kOk;
}

void encode(const ReferenceBlock& block,
            std::span<std::uint8_t, kReferenceBlockBytes> bytes) noexcept {
  ByteWriter out(bytes);
  out.put(kReferenceBlockMagic);
  out.put(kReferenceVersion);
  out.put(static_cast<std::uint8_t>(block.twist_sensed ? 1 : 0));
  out.put(block.sensed_dof);
  out.put(block.driven_dof);
  out.put(block.report_period_us);
  out.put(block.watchdog_ms);
  out.put_zeros(2);
  for (const std::uint32_t value :
       {block.max_force, block.max_torque, block.max_force_rate_mn_per_s,
        block.max_torque_rate_mnm_per_s, block.max_stiffness_mn_per_m, block.max_damping_mns_per_m,
        block.mass_mg, block.damping_uns_per_m, block.friction, block.encoder_step_nm,
        block.encoder_step_nrad, block.workspace_radius_um}) {
    out.put(value);
  }
  out.put_check();
}

CodecVerdict decode(std::span<const std::uint8_t> bytes, ReferenceBlock& block) noexcept {
  const CodecVerdict frame = check_frame(bytes, kReferenceBlockBytes, kReferenceBlockMagic);
  if (frame != CodecVerdict::kOk) return frame;
  ReferenceBlock read;
  std::uint8_t bits = 0;
  ByteReader in(bytes, 3);
  in.take(bits);
  in.take(read.sensed_dof);
  in.take(read.driven_dof);
  in.take(read.report_period_us);
  in.take(read.watchdog_ms);
  const bool zeros = in.take_zeros(2);
  for (std::uint32_t* const value :
       {&read.max_force, &read.max_torque, &read.max_force_rate_mn_per_s,
        &read.max_torque_rate_mnm_per_s, &read.max_stiffness_mn_per_m, &read.max_damping_mns_per_m,
        &read.mass_mg, &read.damping_uns_per_m, &read.friction, &read.encoder_step_nm,
        &read.encoder_step_nrad, &read.workspace_radius_um}) {
    in.take(*value);
  }
  if (!zeros || bits > 1 || ((read.sensed_dof | read.driven_dof) & ~0x3f) != 0) {
    return CodecVerdict::kBadReserved;
  }
  read.twist_sensed = bits == 1;
  block = read;
  return CodecVerdict::kOk;
}

}  // namespace haptic::hal
