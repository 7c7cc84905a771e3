// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/hid_descriptor.hpp"

#include <algorithm>

namespace haptic::hal {
namespace {

constexpr std::size_t kDeepest = 8;      // pushes; collections are only counted
constexpr std::size_t kMostUsages = 64;  // of one main item; more are dropped
constexpr std::size_t kMostReports = 32;
constexpr std::uint32_t kMostBits = 1u << 20;
constexpr std::uint32_t kDesktopPage = 0x01, kFirstAxis = 0x30;

/// One short item: its kind (tag and type, the size bits cleared) and its data both ways.
struct Item {
  std::uint8_t kind = 0;
  std::size_t size = 0;
  std::uint32_t value = 0;
  std::int32_t signed_value = 0;
};

enum ItemKind : std::uint8_t {
  kInput = 0x80,
  kOutput = 0x90,
  kFeature = 0xb0,
  kCollection = 0xa0,
  kEndCollection = 0xc0,
  kUsagePage = 0x04,
  kLogicalMin = 0x14,
  kLogicalMax = 0x24,
  kReportSize = 0x74,
  kReportId = 0x84,
  kReportCount = 0x94,
  kPush = 0xa4,
  kPop = 0xb4,
  kUsage = 0x08,
  kUsageMin = 0x18,
  kUsageMax = 0x28
};

/// Lengths of input reports so far, by report number.
class ReportLengths {
 public:
  /// Null when there are more reports than are followed.
  std::uint32_t* of(std::uint8_t id) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      if (entries_[i].id == id) return &entries_[i].bits;
    }
    if (count_ == kMostReports) return nullptr;
    entries_[count_] = {id, 0};
    return &entries_[count_++].bits;
  }

 private:
  struct Entry {
    std::uint8_t id;
    std::uint32_t bits;
  };
  std::array<Entry, kMostReports> entries_{};
  std::size_t count_ = 0;
};

class Reader {
 public:
  explicit Reader(HidAxes& axes) noexcept : axes_(axes) {}

  HidVerdict read(std::span<const std::uint8_t> bytes) noexcept {
    std::size_t at = 0;
    while (at < bytes.size()) {
      const std::uint8_t prefix = bytes[at++];
      if (prefix == 0xfe) {  // long item: length, tag, data; none is defined
        if (bytes.size() - at < 2 || bytes.size() - at - 2 < bytes[at]) {
          return HidVerdict::kTruncated;
        }
        at += 2u + bytes[at];
        continue;
      }
      Item item;
      item.kind = prefix & 0xfcu;
      item.size = (prefix & 3u) == 3u ? 4u : prefix & 3u;
      if (bytes.size() - at < item.size) return HidVerdict::kTruncated;
      for (std::size_t i = 0; i < item.size; ++i) {
        item.value |= static_cast<std::uint32_t>(bytes[at + i]) << (8 * i);
      }
      at += item.size;
      item.signed_value = sign_extended(item);
      if (!take(item)) return HidVerdict::kBadNesting;
    }
    return collections_ == 0 ? HidVerdict::kOk : HidVerdict::kBadNesting;
  }

 private:
  struct Globals {
    std::uint32_t usage_page = 0, size_bits = 0, count = 0;
    Item logical_min, logical_max;
    std::uint8_t report_id = 0;
  };

  static std::int32_t sign_extended(const Item& item) noexcept {
    if (item.size == 1) return static_cast<std::int8_t>(item.value);
    if (item.size == 2) return static_cast<std::int16_t>(item.value);
    return static_cast<std::int32_t>(item.value);
  }

  /// False where nesting breaks.
  bool take(const Item& item) noexcept {
    switch (item.kind) {
      case kInput:
        take_input(item);
        return forget_usages();
      case kOutput:
      case kFeature:
        return forget_usages();
      case kCollection:
        ++collections_;
        return forget_usages() && collections_ <= 64;
      case kEndCollection:
        if (collections_ == 0) return false;
        --collections_;
        return forget_usages();
      case kPush:
        if (depth_ == kDeepest) return false;
        saved_[depth_++] = now_;
        return true;
      case kPop:
        if (depth_ == 0) return false;
        now_ = saved_[--depth_];
        return true;
      default:
        take_global(item);
        take_local(item);
        return true;
    }
  }

  void take_global(const Item& item) noexcept {
    if (item.kind == kUsagePage) now_.usage_page = item.value;
    if (item.kind == kLogicalMin) now_.logical_min = item;
    if (item.kind == kLogicalMax) now_.logical_max = item;
    if (item.kind == kReportSize) now_.size_bits = item.value;
    if (item.kind == kReportCount) now_.count = item.value;
    if (item.kind == kReportId) now_.report_id = static_cast<std::uint8_t>(item.value);
  }

  /// A usage of four bytes carries its page in the upper half.
  std::uint32_t full_usage(const Item& item) const noexcept {
    return item.size == 4 ? item.value : (now_.usage_page << 16 | (item.value & 0xffffu));
  }

  void take_local(const Item& item) noexcept {
    if (item.kind == kUsage) add_usage(full_usage(item));
    if (item.kind == kUsageMin) usage_min_ = full_usage(item);
    if (item.kind == kUsageMax) {
      const std::uint32_t last = full_usage(item);
      for (std::uint32_t i = 0; i < kMostUsages && usage_min_ <= last; ++i) {
        add_usage(usage_min_);
        if (usage_min_++ == last) break;
      }
    }
  }

  void add_usage(std::uint32_t usage) noexcept {
    if (usage_count_ < kMostUsages) usages_[usage_count_++] = usage;
  }

  bool forget_usages() noexcept {
    usage_count_ = 0;
    usage_min_ = 0;
    return true;
  }

  void take_input(const Item& item) noexcept {
    std::uint32_t* length = lengths_.of(now_.report_id);
    if (length == nullptr || now_.size_bits > kMostBits || now_.count > kMostBits) return;
    const std::uint64_t bits = std::uint64_t{now_.size_bits} * now_.count;
    if (*length > kMostBits || bits > kMostBits) {
      *length = kMostBits + 1;  // positions behind it are not known any more
      return;
    }
    const bool is_constant = (item.value & 1u) != 0;
    const bool is_array = (item.value & 2u) == 0;
    if (!is_constant && !is_array && usage_count_ > 0) {
      // Fields beyond the list of usages have the last one: of an axis only the first counts.
      const std::uint32_t fields = std::min(now_.count, static_cast<std::uint32_t>(usage_count_));
      for (std::uint32_t i = 0; i < fields; ++i) {
        note_axis(usages_[i], *length + i * now_.size_bits);
      }
    }
    *length += static_cast<std::uint32_t>(bits);
  }

  void note_axis(std::uint32_t usage, std::uint32_t bit_offset) noexcept {
    const std::uint32_t axis = usage - (kDesktopPage << 16 | kFirstAxis);
    if (axis >= kHidAxes || axes_.axes[axis].found) return;
    // The largest value is unsigned where the smallest is not negative.
    const std::int64_t least = now_.logical_min.signed_value;
    const std::int64_t most = least < 0 ? std::int64_t{now_.logical_max.signed_value}
                                        : std::int64_t{now_.logical_max.value};
    if (least >= most || most > INT32_MAX) return;
    if (now_.size_bits < 1 || now_.size_bits > 32) return;
    axes_.axes[axis] = {true,
                        now_.report_id,
                        bit_offset,
                        now_.size_bits,
                        static_cast<std::int32_t>(least),
                        static_cast<std::int32_t>(most)};
  }

  HidAxes& axes_;
  Globals now_;
  std::array<Globals, kDeepest> saved_{};
  std::size_t depth_ = 0;
  std::size_t collections_ = 0;
  std::array<std::uint32_t, kMostUsages> usages_{};
  std::size_t usage_count_ = 0;
  std::uint32_t usage_min_ = 0;
  ReportLengths lengths_;
};

}  // namespace

HidVerdict find_hid_axes(std::span<const std::uint8_t> descriptor, HidAxes& axes) noexcept {
  axes = HidAxes{};
  if (descriptor.size() > kMaxHidDescriptorBytes) return HidVerdict::kTooLong;
  return Reader(axes).read(descriptor);
}

double full_scale(const HidAxis& axis) noexcept {
  if (!axis.found) return 0.0;
  return std::max(static_cast<double>(axis.logical_max), -static_cast<double>(axis.logical_min));
}

}  // namespace haptic::hal
