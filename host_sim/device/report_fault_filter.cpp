// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/report_fault_filter.hpp"

#include <algorithm>
#include <utility>

#include "hal/drivers/reference_codec.hpp"
#include "tools/common/split_mix.hpp"

namespace haptic::sim {
namespace {

/// Number of periods that an event has an effect in.
std::uint64_t lasts(const DeviceFaultEvent& event) {
  switch (event.kind) {
    case DeviceFaultKind::kLate:  // and one more, in which the last report held back goes out
      return event.count * static_cast<std::uint64_t>(event.amount) + 1;
    case DeviceFaultKind::kReordered:
      return 2 * std::uint64_t{event.count};
    default:
      return event.count;
  }
}

bool is_of_reports(DeviceFaultKind kind) {
  return kind >= DeviceFaultKind::kShort && kind <= DeviceFaultKind::kFrozen;
}

}  // namespace

void ReportFaultFilter::add(const DeviceFaultEvent& event) {
  if (is_of_reports(event.kind) && event.count > 0) entries_.push_back({event, {}});
}

std::vector<std::vector<std::uint8_t>> ReportFaultFilter::pass(
    std::uint64_t period, std::span<const std::uint8_t> report) {
  for (Entry& entry : entries_) {
    if (entry.event.report == 0) entry.event.report = period;
  }
  std::erase_if(entries_, [period](const Entry& entry) {
    return entry.event.report + lasts(entry.event) <= period;
  });
  const auto active = [period](const Entry& entry) { return entry.event.report <= period; };

  std::vector<Bytes> sent{Bytes(report.begin(), report.end())};
  bool frozen = false;
  for (const Entry& entry : entries_)
    frozen = frozen || (active(entry) && entry.event.kind == DeviceFaultKind::kFrozen);
  if (frozen) {
    freeze(sent.front());
  } else {
    hal::ReferenceReport plain;
    if (hal::decode(report, plain) == hal::CodecVerdict::kOk) sequence_ = plain.sequence;
  }
  // The bytes first, then what becomes of them.
  for (const Entry& entry : entries_) {
    if (active(entry)) damage(entry, period, sent.front());
  }
  for (Entry& entry : entries_) {
    if (!active(entry)) continue;
    const std::uint64_t since = period - entry.event.report;
    if (entry.event.kind == DeviceFaultKind::kLost) sent.clear();
    if (entry.event.kind == DeviceFaultKind::kDoubled && !sent.empty()) sent.push_back(sent.back());
    if (entry.event.kind == DeviceFaultKind::kReordered) reorder(entry, since, sent);
    if (entry.event.kind == DeviceFaultKind::kLate) delay(entry, since, sent);
  }
  return sent;
}

// The sequence of the report before, and a check sum that is right for it.
void ReportFaultFilter::freeze(Bytes& bytes) {
  hal::ReferenceReport plain;
  if (hal::decode(bytes, plain) != hal::CodecVerdict::kOk) return;
  plain.sequence = sequence_;
  hal::encode(plain, std::span<std::uint8_t, hal::kReferenceReportBytes>(bytes));
}

void ReportFaultFilter::damage(const Entry& entry, std::uint64_t period, Bytes& bytes) const {
  const auto amount = static_cast<std::size_t>(std::max(entry.event.amount, 1.0));
  switch (entry.event.kind) {
    case DeviceFaultKind::kShort:
      bytes.resize(bytes.size() - std::min(amount, bytes.size()));
      return;
    case DeviceFaultKind::kLong:
      bytes.resize(bytes.size() + amount);
      return;
    case DeviceFaultKind::kCorrupt: {
      if (bytes.empty()) return;
      // Neighbouring bits from a scattered begin: never the same one twice, so never undone.
      const std::size_t bits = 8 * bytes.size(), begin = tools::hashed(period) % bits;
      for (std::size_t k = 0; k < std::min(amount, bits); ++k) {
        const std::size_t bit = (begin + k) % bits;
        bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
      }
      return;
    }
    default:
      return;
  }
}

// Blocks of `amount` periods: the first report of a block goes out when the next block begins.
void ReportFaultFilter::delay(Entry& entry, std::uint64_t since, std::vector<Bytes>& sent) {
  const auto block = static_cast<std::uint64_t>(std::max(entry.event.amount, 1.0));
  std::vector<Bytes> out;
  if (since % block == 0 && since > 0) out.push_back(std::exchange(entry.held, {}));
  const bool over = since >= entry.event.count * block;
  if (over) {
    out.insert(out.end(), sent.begin(), sent.end());
  } else if (since % block == 0 && !sent.empty()) {
    entry.held = std::move(sent.front());
  }
  std::erase_if(out, [](const Bytes& bytes) { return bytes.empty(); });
  sent = std::move(out);
}

void ReportFaultFilter::reorder(Entry& entry, std::uint64_t since, std::vector<Bytes>& sent) {
  if (since % 2 == 0) {
    if (!sent.empty()) entry.held = std::move(sent.front());
    sent.clear();
  } else if (!entry.held.empty()) {
    sent.push_back(std::exchange(entry.held, {}));
  }
}

}  // namespace haptic::sim
