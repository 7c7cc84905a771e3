// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/zip_entry.hpp"

#include <zlib.h>

#include <algorithm>
#include <optional>

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr const char* kExport = "export the file again";
constexpr const char* kDamaged = "the ZIP archive is damaged";

/// Little-endian numbers of an archive, each within its bytes.
class ZipBytes {
 public:
  ZipBytes(std::span<const char> bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  std::uint64_t wide(std::uint64_t at, std::size_t count) const {
    std::uint64_t value = 0;
    const std::span<const char> part = piece(at, count);
    for (std::size_t k = 0; k < count; ++k) {
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(part[k])) << (8 * k);
    }
    return value;
  }
  /// A number of at most four bytes.
  std::uint32_t number(std::uint64_t at, std::size_t count) const {
    return static_cast<std::uint32_t>(wide(at, count));
  }
  std::span<const char> piece(std::uint64_t at, std::uint64_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at) {
      refuse_file(file_, "the ZIP archive ends early", kExport);
    }
    return bytes_.subspan(static_cast<std::size_t>(at), static_cast<std::size_t>(count));
  }

 private:
  std::span<const char> bytes_;
  const std::string& file_;
};

constexpr std::uint32_t kEnd = 0x06054b50, kEntry = 0x02014b50, kLocal = 0x04034b50,
                        kWideEnd = 0x06064b50, kWideEndPlace = 0x07064b50;
/// Values of a field of ZIP that say that ZIP64 gives the number elsewhere.
constexpr std::uint32_t kElsewhere = 0xFFFFFFFF, kCountElsewhere = 0xFFFF;
constexpr std::uint64_t kEntrySize = 46;

char lower_of(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

bool ends_with_any_case(std::string_view name, std::string_view ending) {
  if (name.size() < ending.size()) return false;
  return std::ranges::equal(name.substr(name.size() - ending.size()), ending, {}, lower_of,
                            lower_of);
}

/// Deflate unpacks a byte to no more than these.
constexpr std::size_t kMostOfByte = 1032;

std::string inflated(std::span<const char> packed, std::size_t size, const std::string& file) {
  if (size / kMostOfByte > packed.size()) refuse_file(file, kDamaged, kExport);
  std::string text(size, '\0');
  z_stream stream{};
  // Raw deflate, without a header of zlib's.
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) {
    refuse_file(file, "zlib does not start", kExport);
  }
  std::string input(packed.begin(), packed.end());
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  const int status = inflate(&stream, Z_FINISH);
  const bool whole = status == Z_STREAM_END && stream.total_out == size;
  inflateEnd(&stream);
  if (!whole) refuse_file(file, kDamaged, kExport);
  return text;
}

/// Where the end record is: last, before a comment of up to 65535 bytes.
std::size_t end_of(const ZipBytes& bytes, std::size_t size, const std::string& file) {
  constexpr std::size_t kEndSize = 22, kLongestComment = 65535;
  constexpr const char* kNone = "the content is no ZIP archive, or it ends early";
  if (size < kEndSize) refuse_file(file, kNone, kExport);
  std::size_t end = size - kEndSize;
  const std::size_t first = end > kLongestComment ? end - kLongestComment : 0;
  while (bytes.number(end, 4) != kEnd) {
    if (end == first) refuse_file(file, kNone, kExport);
    --end;
  }
  return end;
}

/// Puts the numbers that ZIP64 keeps in the extra field of an entry into their places.
void widen(ZipEntry& entry, const ZipBytes& bytes, std::uint64_t extra_at, std::uint64_t extra_size,
           const std::string& file) {
  std::uint64_t* const fields[] = {&entry.size, &entry.packed_size, &entry.local_at};
  const auto is_elsewhere = [](const std::uint64_t* field) { return *field == kElsewhere; };
  if (std::ranges::none_of(fields, is_elsewhere)) return;
  const std::uint64_t extra_end = extra_at + extra_size;
  while (extra_at + 4 <= extra_end) {
    std::uint64_t at = extra_at + 4;
    const std::uint64_t end = at + bytes.number(extra_at + 2, 2);
    if (end > extra_end) break;
    if (bytes.number(extra_at, 2) != 1) {
      extra_at = end;
      continue;
    }
    for (std::uint64_t* field : fields) {
      if (!is_elsewhere(field)) continue;
      if (at + 8 > end) refuse_file(file, kDamaged, kExport);
      *field = bytes.wide(at, 8);
      at += 8;
    }
    return;
  }
  refuse_file(file, kDamaged, kExport);
}

}  // namespace

ZipArchive::ZipArchive(std::span<const char> archive, const std::string& file)
    : bytes_(archive), file_(file) {
  const ZipBytes bytes(archive, file);
  const std::size_t end = end_of(bytes, archive.size(), file);
  std::uint64_t count = bytes.number(end + 10, 2), at = bytes.number(end + 16, 4);
  const bool is_wide = count == kCountElsewhere || at == kElsewhere;
  constexpr std::size_t kPlaceSize = 20;
  if (is_wide && end >= kPlaceSize && bytes.number(end - kPlaceSize, 4) == kWideEndPlace) {
    const std::uint64_t wide_end = bytes.wide(end - kPlaceSize + 8, 8);
    if (bytes.number(wide_end, 4) != kWideEnd) refuse_file(file, kDamaged, kExport);
    count = bytes.wide(wide_end + 32, 8);
    at = bytes.wide(wide_end + 48, 8);
  } else if (bytes.number(end + 4, 2) != 0) {
    refuse_file(file, "the ZIP archive is one of several volumes", "join them to one archive");
  }
  if (count > archive.size() / kEntrySize) refuse_file(file, kDamaged, kExport);
  entries_.reserve(static_cast<std::size_t>(count));
  for (std::uint64_t k = 0; k < count; ++k) {
    if (bytes.number(at, 4) != kEntry) refuse_file(file, kDamaged, kExport);
    const std::uint64_t name_size = bytes.number(at + 28, 2), extra_size = bytes.number(at + 30, 2);
    const std::span<const char> name = bytes.piece(at + kEntrySize, name_size);
    ZipEntry& entry = entries_.emplace_back();
    entry.name = {name.data(), name.size()};
    entry.flags = bytes.number(at + 8, 2);
    entry.method = bytes.number(at + 10, 2);
    entry.check_sum = bytes.number(at + 16, 4);
    entry.packed_size = bytes.number(at + 20, 4);
    entry.size = bytes.number(at + 24, 4);
    entry.local_at = bytes.number(at + 42, 4);
    widen(entry, bytes, at + kEntrySize + name_size, extra_size, file);
    at += kEntrySize + name_size + extra_size + bytes.number(at + 32, 2);
  }
}

std::string ZipArchive::unpacked(const ZipEntry& entry, std::size_t limit) const {
  const ZipBytes bytes(bytes_, file_);
  if ((entry.flags & 1U) != 0) refuse_file(file_, "the ZIP archive is encrypted", kExport);
  if (entry.size > limit) {
    refuse_file(file_,
                "the archive unpacks to " + std::to_string(entry.size) + " bytes, limit " +
                    std::to_string(limit),
                "simplify the part");
  }
  const auto size = static_cast<std::size_t>(entry.size);
  const std::uint64_t local = entry.local_at;
  if (bytes.number(local, 4) != kLocal) refuse_file(file_, kDamaged, kExport);
  const std::uint64_t begin =
      local + 30 + bytes.number(local + 26, 2) + bytes.number(local + 28, 2);
  const std::span<const char> content = bytes.piece(begin, entry.packed_size);
  std::string text;
  if (entry.method == 0) {
    if (content.size() != size) refuse_file(file_, kDamaged, kExport);
    text.assign(content.begin(), content.end());
  } else if (entry.method == Z_DEFLATED) {
    text = inflated(content, size, file_);
  } else {
    refuse_file(file_, "the ZIP archive is packed by method " + std::to_string(entry.method),
                "pack it by deflate");
  }
  const uLong sum = crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size());
  if (sum != entry.check_sum) {
    refuse_file(file_,
                "the ZIP archive is damaged: the check sum of " + shown_word(entry.name) +
                    " is not that of its bytes",
                kExport);
  }
  return text;
}

std::string zip_entry(std::span<const char> archive, std::string_view ending, std::size_t limit,
                      const std::string& file) {
  const ZipArchive zip(archive, file);
  for (const ZipEntry& entry : zip.entries()) {
    if (ends_with_any_case(entry.name, ending)) return zip.unpacked(entry, limit);
  }
  refuse_file(file, "the archive holds no file '*" + std::string(ending) + "'", kExport);
}

}  // namespace haptic::tools
