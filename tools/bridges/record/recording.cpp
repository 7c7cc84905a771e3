// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/record/recording.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <system_error>
#include <utility>

#include "hal/drivers/reference_codec.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "entries are written as they lie");

template <typename Number>
Number number_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  Number number;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

template <typename Number>
void put(Number number, std::span<std::byte> bytes, std::size_t at) noexcept {
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

}  // namespace

void put_entry_head(hal::TapKind kind, std::int64_t time_ns, std::int64_t result, std::size_t sent,
                    std::size_t received, std::span<std::byte> room) noexcept {
  put(static_cast<std::uint32_t>(kLeastEntry_bytes + sent + received), room, 0);
  put(static_cast<std::uint32_t>(kind), room, 4);
  put(time_ns, room, 8);
  put(result, room, 16);
  put(static_cast<std::uint32_t>(sent), room, 24);
  put(static_cast<std::uint32_t>(received), room, 28);
}

Recording::Recording(std::filesystem::path path)
    : path_(std::move(path)), stream_(path_, std::ios::binary) {
  std::error_code error;
  if (!stream_ || !std::filesystem::is_regular_file(path_, error))
    throw InputError(path_.string() + ": cannot be read as a file; check the path and its rights");
  size_ = std::filesystem::file_size(path_, error);
  if (size_ > kMostRecording_bytes)
    throw InputError(path_.string() + ": has " + std::to_string(size_) +
                     " bytes, and a recording has 1 GiB at most; record again with a smaller "
                     "record_mb");
  std::array<char, kRecordingMagic.size()> magic{};
  stream_.read(magic.data(), magic.size());
  const std::string_view found(magic.data(), static_cast<std::size_t>(stream_.gcount()));
  if (found == kRecordingMagic) {
    at_ = last_ = found.size();
    return;
  }
  const bool is_other = found.size() == kRecordingMagic.size() &&
                        found.starts_with(kRecordingMagic.substr(0, kRecordingMagic.size() - 1));
  throw InputError(path_.string() + ": byte 0: " +
                   (is_other ? "a recording of another version of this program; replay it with that"
                             : "no recording of a bridge; give a file that device_bridge NAME "
                               "--record FILE has written"));
}

std::string Recording::place() const {
  return path_.string() + ": byte " + std::to_string(last_) + ": ";
}

void Recording::refuse(const std::string& defect) const {
  throw InputError(place() + defect + "; what is before it can be kept: head -c " +
                   std::to_string(last_) + " " + path_.string() + " > NEW");
}

bool Recording::next(RecordEntry& entry) {
  last_ = at_;
  if (at_ == size_) return false;
  const std::uint64_t left = size_ - at_;
  if (left < kLeastEntry_bytes) refuse("the file ends in the middle of an entry");
  bytes_.resize(kEntryHead_bytes);
  stream_.read(reinterpret_cast<char*>(bytes_.data()), kEntryHead_bytes);
  if (!stream_) refuse("the file cannot be read on");
  const std::size_t size = number_at<std::uint32_t>(bytes_, 0);
  const std::uint32_t kind = number_at<std::uint32_t>(bytes_, 4);
  const std::uint64_t sent = number_at<std::uint32_t>(bytes_, 24);
  const std::uint64_t received = number_at<std::uint32_t>(bytes_, 28);
  if (size < kLeastEntry_bytes || size > kMostEntry_bytes ||
      size != kLeastEntry_bytes + sent + received)
    refuse("an entry of " + std::to_string(size) + " bytes cannot be; the file is damaged");
  if (size > left) refuse("the file ends in the middle of an entry");
  bytes_.resize(size);
  stream_.read(reinterpret_cast<char*>(bytes_.data()) + kEntryHead_bytes,
               static_cast<std::streamsize>(size - kEntryHead_bytes));
  if (!stream_) refuse("the file cannot be read on");
  const std::span<const std::uint8_t> checked(reinterpret_cast<const std::uint8_t*>(bytes_.data()),
                                              size - 4);
  if (hal::crc32(checked) != number_at<std::uint32_t>(bytes_, size - 4))
    refuse("the check sum of an entry is wrong; the file is damaged");
  if (kind == 0 || kind > hal::kLastTapKind)
    refuse("an entry of kind " + std::to_string(kind) + " is of a newer version of this program");
  entry.kind = static_cast<hal::TapKind>(kind);
  entry.time_ns = number_at<std::int64_t>(bytes_, 8);
  entry.result = number_at<std::int64_t>(bytes_, 16);
  const auto first = bytes_.begin() + kEntryHead_bytes;
  const auto middle = first + static_cast<std::ptrdiff_t>(sent);
  entry.sent.assign(first, middle);
  entry.received.assign(middle, middle + static_cast<std::ptrdiff_t>(received));
  entry.at = at_;
  at_ += size;
  return true;
}

}  // namespace haptic::tools
