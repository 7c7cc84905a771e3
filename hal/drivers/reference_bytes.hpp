// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Records of the reference protocol as bytes: magic, version, the members by one `layout` a kind
/// for both directions, check sum. For the codecs of this folder alone.

#include <array>
#include <concepts>
#include <type_traits>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::hal::reference_bytes {

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
  template <std::signed_integral T, std::size_t N>
  void field(const std::array<T, N>& values) noexcept {
    for (const T value : values) field(static_cast<std::make_unsigned_t<T>>(value));
  }
  template <std::size_t N>
  void text(const std::array<char, N>& letters) noexcept {
    for (const char letter : letters) bytes_[at_++] = static_cast<std::uint8_t>(letter);
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
  template <std::signed_integral T, std::size_t N>
  void field(std::array<T, N>& values) noexcept {
    for (T& value : values) {
      std::make_unsigned_t<T> bits = 0;
      field(bits);
      value = static_cast<T>(bits);  // modulo 2^n: two's complement
    }
  }
  template <std::size_t N>
  void text(std::array<char, N>& letters) noexcept {
    for (char& letter : letters) letter = static_cast<char>(bytes_[at_++]);
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

template <typename Record, typename Kind>
concept RecordOf = std::same_as<std::remove_const_t<Record>, Kind>;

/// The checks that all kinds share: length, magic, version, check sum.
inline CodecVerdict check_frame(std::span<const std::uint8_t> bytes, std::size_t length,
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

}  // namespace haptic::hal::reference_bytes
