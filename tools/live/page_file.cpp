// SPDX-License-Identifier: Apache-2.0
#include "tools/live/page_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

#if HAPTIC_HAS_ZLIB
#include <zlib.h>
#endif

namespace haptic::tools {
namespace {

constexpr std::size_t kLargestPage_bytes = std::size_t{64} << 20;
constexpr char kRecordingMagic[8] = {'R', 'T', 'V', 'I', 'E', 'W', '3', '\0'};

/// Head of the recording in the page; the columns follow.
struct RecordingHead {
  char magic[8] = {};
  std::uint32_t ticks = 0;
  std::uint32_t has = 0;  ///< kHasAccepted, kHasDevice, kHasDriven
};
constexpr std::uint32_t kHasAccepted = 1, kHasDevice = 2, kHasDriven = 4;
static_assert(sizeof(RecordingHead) == 16);

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

/// Puts `text` in the place of `mark`, which stands in the page once.
void fill(std::string& page, const std::string& mark, const std::string& text) {
  const std::size_t at = page.find(mark);
  if (at == std::string::npos)
    throw InputError("the page has no place for " + mark + "; build it again: tools/view");
  page.replace(at, mark.size(), text);
}

/// Columns of a tick: stamp, position, orientation, hash; the accepted wrench, what a device adds,
/// and clock and feeling of driven parts where they are there.
constexpr std::size_t kHashColumn = 8, kColumns = 9, kAcceptedColumns = 6, kDeviceColumns = 7,
                      kDrivenColumns = 2;
/// Those of a given pose: the words of GivenPose.
constexpr std::size_t kGivenColumns = sizeof(GivenPose) / 8;
constexpr std::size_t kNoColumn = ~std::size_t{0};

std::uint64_t column_of(const RecordedTick& tick, std::size_t column, std::uint32_t has) {
  if (column == 0) return static_cast<std::uint64_t>(tick.stamp_ns);
  if (column < 4) return std::bit_cast<std::uint64_t>(tick.p_wa_m[column - 1]);
  if (column < kHashColumn) return std::bit_cast<std::uint64_t>(tick.q_wa_xyzw[column - 4]);
  if (column == kHashColumn) return tick.state_hash;
  std::size_t k = column - kColumns;
  if ((has & kHasAccepted) != 0) {
    if (k < kAcceptedColumns) return std::bit_cast<std::uint64_t>(tick.accepted_w[k]);
    k -= kAcceptedColumns;
  }
  constexpr std::uint64_t kOfDriven = kMarkDriven | kMarkFelt;
  if ((has & kHasDevice) != 0) {
    if (k < 6) return std::bit_cast<std::uint64_t>(tick.twist_w[k]);
    if (k == 6) return tick.marks & ~kOfDriven;
    k -= kDeviceColumns;
  }
  if (k == 0) return static_cast<std::uint64_t>(tick.driven_ns);
  return (tick.marks & kMarkFelt) != 0 ? 1 : 0;
}

std::size_t columns_with(std::uint32_t has) {
  return kColumns + ((has & kHasAccepted) != 0 ? kAcceptedColumns : 0) +
         ((has & kHasDevice) != 0 ? kDeviceColumns : 0) +
         ((has & kHasDriven) != 0 ? kDrivenColumns : 0);
}

/// Properties of these ticks that others lack. A page forgets all before the first tick in any
/// case.
std::uint32_t kinds_of(std::span<const RecordedTick> ticks) {
  if (ticks.empty()) return 0;
  std::uint64_t later = 0;
  for (const RecordedTick& tick : ticks.subspan(1)) later |= tick.marks & kMarkReset;
  for (const RecordedTick& tick : ticks) later |= tick.marks & (kMarkTwist | kMarkClutched);
  const bool accepted = (ticks.front().marks & kMarkAccepted) != 0;
  const bool driven = (ticks.front().marks & kMarkDriven) != 0;
  return (accepted ? kHasAccepted : 0) | (later != 0 ? kHasDevice : 0) | (driven ? kHasDriven : 0);
}

/// Small numbers of either sign as small ones.
std::uint64_t unsigned_of(std::uint64_t difference) {
  return difference << 1 ^ (difference >> 63 != 0 ? ~std::uint64_t{0} : 0);
}

/// Appends columns of `count` words each; `plain` has its words as they are.
template <typename Word>
void append_columns(std::vector<std::byte>& bytes, std::size_t columns, std::size_t count,
                    std::size_t plain, const Word& word) {
  bytes.reserve(bytes.size() + 8 * columns * count);
  std::vector<std::uint64_t> values(count);
  for (std::size_t column = 0; column < columns; ++column) {
    std::uint64_t before = 0, before_that = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint64_t value = word(k, column);
      // A motion goes on as it did; a hash does not.
      values[k] = column == plain ? value : unsigned_of(value - (2 * before - before_that));
      before_that = before;
      before = value;
    }
    for (unsigned byte = 0; byte < 8; ++byte)
      for (const std::uint64_t value : values)
        bytes.push_back(static_cast<std::byte>(value >> (8 * byte)));
  }
}

template <typename Plain>
void append_plain(std::vector<std::byte>& bytes, const Plain& value) {
  const auto of_value = std::as_bytes(std::span(&value, 1));
  bytes.insert(bytes.end(), of_value.begin(), of_value.end());
}

/// As gzip, where zlib is there.
std::vector<std::byte> zipped(std::span<const std::byte> bytes) {
#if HAPTIC_HAS_ZLIB
  z_stream stream{};
  constexpr int kGzip = 15 + 16, kMemory = 9;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) ==
      Z_OK) {
    std::vector<std::byte> out(deflateBound(&stream, static_cast<uLong>(bytes.size())));
    // zlib only reads it.
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    const int ended = deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    if (ended == Z_STREAM_END) return out;
  }
#endif
  return {bytes.begin(), bytes.end()};
}

constexpr const char* kConnect = "@CONNECT@";

std::string page_with_scene(const std::string& page, const SceneView& scene,
                            std::string_view about) {
  std::string filled = page;
  const SceneParameters& p = scene.parameters();
  fill(filled, "@TITLE@", escaped(scene.text(p.name_offset, p.name_bytes)));
  fill(filled, "@ABOUT@", escaped(about));
  fill(filled, "@SCENE@", packed_text(scene.blob()));
  return filled;
}

}  // namespace

RecordedTick recorded_tick(const StepInput& input, std::uint64_t state_hash) {
  const auto put = [](const Vec3& from, double* to) {
    for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<double>(from[axis]);
  };
  RecordedTick recorded;
  recorded.stamp_ns = input.stamp_ns;
  put(input.pose_wa.p_wa, recorded.p_wa_m);
  for (int k = 0; k < 4; ++k)
    recorded.q_wa_xyzw[k] = static_cast<double>(input.pose_wa.q_wa.coeffs()[k]);
  if (input.accepted_valid) {
    put(input.accepted_wrench_w.force_w, recorded.accepted_w);
    put(input.accepted_wrench_w.torque_w, recorded.accepted_w + 3);
    recorded.marks |= kMarkAccepted;
  }
  if (input.twist_valid) {
    put(input.twist_w.linear_w, recorded.twist_w);
    put(input.twist_w.angular_w, recorded.twist_w + 3);
    recorded.marks |= kMarkTwist;
  }
  if (input.clutched) recorded.marks |= kMarkClutched;
  recorded.state_hash = state_hash;
  return recorded;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t there = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i)
      group = group << 8 | (i < there ? std::to_integer<std::uint32_t>(bytes[k + i]) : 0u);
    for (std::size_t i = 0; i < 4; ++i)
      text += i <= there ? kDigits[group >> (18 - 6 * i) & 63u] : '=';
  }
  return text;
}

std::string packed_text(std::span<const std::byte> bytes) { return base64(zipped(bytes)); }

std::vector<std::byte> recording_bytes(std::span<const RecordedTick> ticks,
                                       std::span<const GivenPose> given) {
  RecordingHead head;
  std::memcpy(head.magic, kRecordingMagic, sizeof kRecordingMagic);
  head.ticks = static_cast<std::uint32_t>(ticks.size());
  head.has = kinds_of(ticks);
  std::vector<std::byte> bytes;
  append_plain(bytes, head);
  append_columns(
      bytes, columns_with(head.has), ticks.size(), kHashColumn,
      [&](std::size_t k, std::size_t column) { return column_of(ticks[k], column, head.has); });
  if ((head.has & kHasDriven) == 0) return bytes;
  append_plain(bytes, std::uint64_t{given.size()});
  append_columns(bytes, kGivenColumns, given.size(), kNoColumn,
                 [&](std::size_t k, std::size_t column) {
                   using Words = std::array<std::uint64_t, kGivenColumns>;
                   return std::bit_cast<Words>(given[k])[column];
                 });
  return bytes;
}

std::string read_page() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) throw OsError("/proc/self/exe: " + error.message());
  const std::filesystem::path page =
      self.parent_path().parent_path() / "share" / "haptic_view" / "page.html";
  if (!std::filesystem::exists(page)) {
    if (!std::filesystem::exists(self.parent_path().parent_path() / "CMakeCache.txt")) {
      throw OsError(page.string() +
                    ": this installation was made without the page; install again from a "
                    "build in which tools/view of the source has built it");
    }
    throw OsError(page.string() +
                  ": the page has not been built; run tools/view, which installs what it "
                  "needs: nodejs npm clang-16 llvm-16 lld-16 wasi-libc "
                  "libc++-16-dev-wasm32 libc++abi-16-dev-wasm32 libclang-rt-16-dev-wasm32");
  }
  return read_text_file(page, kLargestPage_bytes, "the page");
}

std::string filled_page(const std::string& page, const SceneView& scene,
                        std::span<const RecordedTick> ticks, std::string_view about,
                        std::span<const GivenPose> given) {
  std::string filled = page_with_scene(page, scene, about);
  fill(filled, kConnect, "'none'");
  fill(filled, "@LIVE@", "");
  fill(filled, "@RECORDING@", ticks.empty() ? "" : packed_text(recording_bytes(ticks, given)));
  return filled;
}

std::string live_page(const std::string& page, const SceneView& scene, const LivePage& live) {
  std::string filled = page_with_scene(page, scene, {});
  const nlohmann::json facts = {{"takesHand", live.takes_hand},
                                {"whyNotCompared", live.why_not_compared}};
  fill(filled, "@LIVE@", facts.dump());
  fill(filled, "@RECORDING@", "");
  return filled;
}

std::string connected_page(const std::string& live_page, const std::string& host) {
  std::string page = live_page;
  fill(page, kConnect, "'self' ws://" + host);
  return page;
}

}  // namespace haptic::tools
