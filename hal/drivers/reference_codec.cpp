// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/reference_codec.hpp"

#include <concepts>
#include <type_traits>

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
  void field(T value) noexcept {
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      bytes_[at_++] = static_cast<std::uint8_t>(value >> (8 * k) & 0xff);
    }
  }
  template <std::size_t N>
  void field(const std::array<std::int32_t, N>& values) noexcept {
    for (const std::int32_t value : values) field(static_cast<std::uint32_t>(value));
  }
  /// A byte of which only the lowest bit may be set.
  void bit(bool value) noexcept { bytes_[at_++] = value ? 1 : 0; }
  void reserved(std::size_t count) noexcept {
    for (std::size_t k = 0; k < count; ++k) bytes_[at_++] = 0;
  }
  void check_sum() noexcept { field(crc32(bytes_.first(at_))); }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// Its members have the names of the writer's, so that one `layout` serves both directions.
class ByteReader {
 public:
  ByteReader(std::span<const std::uint8_t> bytes, std::size_t at) noexcept
      : bytes_(bytes), at_(at) {}

  template <std::unsigned_integral T>
  requires(!std::same_as<T, bool>) void field(T& value) noexcept {
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      sum |= std::uint64_t{bytes_[at_++]} << (8 * k);
    }
    value = static_cast<T>(sum);
  }
  template <std::size_t N>
  void field(std::array<std::int32_t, N>& values) noexcept {
    for (std::int32_t& value : values) {
      std::uint32_t bits = 0;
      field(bits);
      value = static_cast<std::int32_t>(bits);  // modulo 2^32: two's complement
    }
  }
  void bit(bool& value) noexcept {
    const unsigned byte = bytes_[at_++];
    value = byte == 1;
    reserved_are_zero_ = reserved_are_zero_ && byte <= 1;
  }
  void reserved(std::size_t count) noexcept {
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint8_t byte = bytes_[at_++];
      reserved_are_zero_ = reserved_are_zero_ && byte == 0;
    }
  }
  /// No reserved byte or bit so far was set.
  [[nodiscard]] bool reserved_are_zero() const noexcept { return reserved_are_zero_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_;
  bool reserved_are_zero_ = true;
};

/// Bytes before those of `layout`: magic and version.
constexpr std::size_t kHeadBytes = 3;

// The bytes of each kind between its head and its check sum, in their order: written by a
// ByteWriter from a const record, read by a ByteReader into one that is not.
template <typename Record, typename Kind>
concept RecordOf = std::same_as<std::remove_const_t<Record>, Kind>;

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
  bytes.reserved(4);
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

/// The checks that all three kinds share: length, magic, version, check sum.
CodecVerdict check_frame(std::span<const std::uint8_t> bytes, std::size_t length,
                         std::uint16_t magic) noexcept {
  if (bytes.size() != length) return CodecVerdict::kBadLength;
  ByteReader head(bytes, 0);
  std::uint16_t found = 0;
  std::uint8_t version = 0;
  head.field(found);
  head.field(version);
  if (found != magic) return CodecVerdict::kBadMagic;
  if (version != kReferenceVersion) return CodecVerdict::kBadVersion;
  std::uint32_t check = 0;
  ByteReader(bytes, length - 4).field(check);
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

template <typename Record>
void write_record(const Record& record, std::uint16_t magic,
                  std::span<std::uint8_t> bytes) noexcept {
  ByteWriter out(bytes);
  out.field(magic);
  out.field(kReferenceVersion);
  layout(out, record);
  out.check_sum();
}

/// `record` is changed even where the verdict is not kOk.
template <typename Record>
CodecVerdict read_record(std::span<const std::uint8_t> bytes, std::size_t length,
                         std::uint16_t magic, Record& record) noexcept {
  const CodecVerdict frame = check_frame(bytes, length, magic);
  if (frame != CodecVerdict::kOk) return frame;
  ByteReader in(bytes, kHeadBytes);
  layout(in, record);
  return in.reserved_are_zero() ? CodecVerdict::kOk : CodecVerdict::kBadReserved;
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
  if (((read.sensed_dof | read.driven_dof) & ~0x3f) != 0) return CodecVerdict::kBadReserved;
  block = read;
  return CodecVerdict::kOk;
}

}  // namespace haptic::hal
