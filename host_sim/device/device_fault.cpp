// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/device_fault.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "hal/drivers/reference_codec.hpp"
#include "tools/common/error.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/common/toml_file.hpp"

namespace haptic::sim {

namespace {

constexpr std::size_t kLargestScriptBytes = std::size_t{1} << 20;
constexpr double kLargestPeriod = 1.0e9;
constexpr double kLargestCount = 1.0e6;

std::string plain(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

// The script being read; every refusal names its file and line.
class ScriptReader {
 public:
  ScriptReader(const std::string& path, double rate_hz) : path_(path), rate_hz_(rate_hz) {}

  [[noreturn]] void refuse(const toml::source_region& place, const std::string& defect) const {
    throw tools::InputError(path_ + ":" + std::to_string(place.begin.line) + ": " + defect);
  }

  [[nodiscard]] std::vector<DeviceFaultEvent> events(const toml::table& root) const {
    for (const auto& [key, value] : root) {
      if (key.str() != "format" && key.str() != "fault")
        refuse(key.source(),
               "unknown key '" + std::string(key.str()) + "'; known here: format, [[fault]]");
    }
    const toml::node* format = root.get("format");
    if (format == nullptr || format->value_exact<std::int64_t>() != 1) {
      refuse(format == nullptr ? root.source() : format->source(),
             "not a fault script of this format; begin with format = 1");
    }
    const toml::node* faults = root.get("fault");
    std::vector<DeviceFaultEvent> list;
    if (faults == nullptr) return list;
    if (!faults->is_array_of_tables())
      refuse(faults->source(), "fault must be a list of tables; write [[fault]] above each");
    for (const toml::node& entry : *faults->as_array()) list.push_back(event(*entry.as_table()));
    std::stable_sort(list.begin(), list.end(),
                     [](const auto& a, const auto& b) { return a.report < b.report; });
    return list;
  }

 private:
  [[nodiscard]] const DeviceFaultRule& rule(const toml::table& table) const {
    const toml::node* kind = table.get("kind");
    if (kind == nullptr) refuse(table.source(), "the key 'kind' is missing; add it");
    const auto name = kind->value<std::string>();
    std::string names;
    for (const DeviceFaultRule& known : device_fault_kinds()) {
      if (name && *name == known.name) return known;
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    refuse(kind->source(), "no such kind of fault; use one of: " + names);
  }

  [[nodiscard]] double number(const toml::node& node, const char* key, double low, double high,
                              bool whole) const {
    const auto value = node.value<double>();
    if (!node.is_number() || !value || !(*value >= low && *value <= high) ||
        (whole && !node.is_integer())) {
      refuse(node.source(), std::string(key) + " must be a " + (whole ? "whole " : "") +
                                "number from " + plain(low) + " to " + plain(high));
    }
    return *value;
  }

  [[nodiscard]] std::uint64_t period(const toml::table& table) const {
    const toml::node* report = table.get("report");
    const toml::node* time = table.get("t_s");
    if ((report == nullptr) == (time == nullptr))
      refuse(table.source(), "give either report or t_s, for when it begins");
    if (report != nullptr)
      return static_cast<std::uint64_t>(number(*report, "report", 1, kLargestPeriod, true));
    const double t_s = number(*time, "t_s", 0, kLargestPeriod / rate_hz_, false);
    return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(t_s * rate_hz_)));
  }

  [[nodiscard]] DeviceFaultEvent event(const toml::table& table) const {
    const DeviceFaultRule& allowed = rule(table);
    DeviceFaultEvent out;
    out.kind = allowed.kind;
    out.amount = allowed.usual;
    out.report = period(table);
    for (const auto& [key, node] : table) {
      const std::string_view name = key.str();
      if (name == "kind" || name == "report" || name == "t_s") continue;
      if (name == "count" && allowed.counted) {
        out.count = static_cast<unsigned>(number(node, "count", 1, kLargestCount, true));
      } else if (name == "amount" && allowed.low < allowed.high) {
        // Metres may be any number; bytes, bits and periods are whole.
        const bool whole = allowed.kind != DeviceFaultKind::kEncoderJump;
        out.amount = number(node, "amount", allowed.low, allowed.high, whole);
      } else if (name == "endpoint" && allowed.has_endpoint) {
        const auto which = node.value<std::string>();
        if (!which || (*which != "in" && *which != "out"))
          refuse(node.source(), "endpoint must be \"in\" or \"out\"");
        out.out_endpoint = *which == "out";
      } else {
        refuse(key.source(), "the key '" + std::string(name) + "' means nothing for a " +
                                 allowed.name + "; remove it");
      }
    }
    return out;
  }

  const std::string& path_;
  double rate_hz_;
};

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

const std::vector<DeviceFaultRule>& device_fault_kinds() {
  using Kind = DeviceFaultKind;
  static const std::vector<DeviceFaultRule> kRules = {
      {"unplug", Kind::kUnplug, false, false, 0, 0, 0},
      {"unplug_at_resubmit", Kind::kUnplugAtResubmit, false, false, 0, 0, 0},
      {"replug", Kind::kReplug, false, false, 0, 1, 0},
      {"stall", Kind::kStall, true, true, 0, 0, 0},
      {"babble", Kind::kBabble, true, false, 0, 0, 0},
      {"bus_error", Kind::kBusError, true, true, 0, 0, 0},
      {"submit_refused", Kind::kSubmitRefused, true, true, 0, 0, 0},
      {"short", Kind::kShort, true, false, 1, 96, 1},
      {"long", Kind::kLong, true, false, 1, 1024, 1},
      {"corrupt", Kind::kCorrupt, true, false, 1, 768, 1},
      {"lost", Kind::kLost, true, false, 0, 0, 0},
      {"doubled", Kind::kDoubled, true, false, 0, 0, 0},
      {"reordered", Kind::kReordered, true, false, 0, 0, 0},
      {"late", Kind::kLate, true, false, 1, 1000, 1},
      {"frozen", Kind::kFrozen, true, false, 0, 0, 0},
      {"encoder_jump", Kind::kEncoderJump, false, false, -1, 1, 0.001},
      {"emergency_stop", Kind::kEmergencyStop, true, false, 0, 0, 0},
      {"deaf", Kind::kDeaf, true, false, 0, 0, 0}};
  return kRules;
}

const char* to_text(DeviceFaultKind kind) {
  for (const DeviceFaultRule& rule : device_fault_kinds()) {
    if (rule.kind == kind) return rule.name;
  }
  return "unknown";
}

std::vector<DeviceFaultEvent> read_fault_script(const std::string& path, double rate_hz) {
  const ScriptReader reader(path, rate_hz);
  const toml::table root = tools::read_toml_file(path, kLargestScriptBytes, "the fault script");
  return reader.events(root);
}

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
