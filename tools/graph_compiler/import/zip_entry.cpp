// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/zip_entry.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr const char* kExport = "export the file again";
constexpr const char* kDamaged = "the ZIP archive is damaged";

/// Little-endian numbers of an archive, each within its bytes.
class ZipBytes {
 public:
  ZipBytes(std::span<const char> bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  std::uint32_t number(std::size_t at, std::size_t count) const {
    std::uint32_t value = 0;
    const std::span<const char> part = piece(at, count);
    for (std::size_t k = 0; k < count; ++k) {
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(part[k])) << (8 * k);
    }
    return value;
  }
  std::span<const char> piece(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at) {
      refuse_file(file_, "the ZIP archive ends early", kExport);
    }
    return bytes_.subspan(at, count);
  }

 private:
  std::span<const char> bytes_;
  const std::string& file_;
};

constexpr std::uint32_t kEnd = 0x06054b50, kEntry = 0x02014b50, kLocal = 0x04034b50;

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

}  // namespace

std::string zip_entry(std::span<const char> archive, std::string_view ending, std::size_t limit,
                      const std::string& file) {
  const ZipBytes bytes(archive, file);
  // The end record is last, before a comment of up to 65535 bytes.
  constexpr std::size_t kEndSize = 22, kLongestComment = 65535;
  if (archive.size() < kEndSize) refuse_file(file, "the content is no ZIP archive", kExport);
  std::size_t end = archive.size() - kEndSize;
  const std::size_t first = end > kLongestComment ? end - kLongestComment : 0;
  while (bytes.number(end, 4) != kEnd) {
    if (end == first) refuse_file(file, "the content is no ZIP archive", kExport);
    --end;
  }
  const std::uint32_t count = bytes.number(end + 10, 2);
  std::size_t at = bytes.number(end + 16, 4);
  for (std::uint32_t k = 0; k < count; ++k) {
    if (bytes.number(at, 4) != kEntry) refuse_file(file, kDamaged, kExport);
    const std::size_t name_size = bytes.number(at + 28, 2);
    const std::span<const char> name = bytes.piece(at + 46, name_size);
    if (!ends_with_any_case({name.data(), name.size()}, ending)) {
      at += 46 + name_size + bytes.number(at + 30, 2) + bytes.number(at + 32, 2);
      continue;
    }
    const std::uint32_t flags = bytes.number(at + 8, 2), method = bytes.number(at + 10, 2);
    const std::size_t packed = bytes.number(at + 20, 4), size = bytes.number(at + 24, 4);
    const std::size_t local = bytes.number(at + 42, 4);
    if ((flags & 1U) != 0) refuse_file(file, "the ZIP archive is encrypted", kExport);
    if (size > limit) {
      refuse_file(file,
                  "the archive unpacks to " + std::to_string(size) + " bytes, limit " +
                      std::to_string(limit),
                  "simplify the part");
    }
    if (bytes.number(local, 4) != kLocal) refuse_file(file, kDamaged, kExport);
    const std::size_t begin =
        local + 30 + bytes.number(local + 26, 2) + bytes.number(local + 28, 2);
    const std::span<const char> content = bytes.piece(begin, packed);
    if (method == 0 && packed == size) return {content.begin(), content.end()};
    if (method == Z_DEFLATED) return inflated(content, size, file);
    refuse_file(file, "the ZIP archive is packed by method " + std::to_string(method),
                "pack it by deflate");
  }
  refuse_file(file, "the archive holds no file '*" + std::string(ending) + "'", kExport);
}

}  // namespace haptic::tools
