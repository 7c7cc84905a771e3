// SPDX-License-Identifier: Apache-2.0
#include "tests/hal/polhem_counterpart.hpp"

namespace haptic::test {

namespace {
constexpr std::int64_t kWatchdog_ns = 500'000'000;
}

void PolhemCounterpart::turn(const std::array<int, 6>& by) {
  for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += by[i];
}

void PolhemCounterpart::pass(std::int64_t ns) {
  since_report_ns_ += ns;
  if (since_report_ns_ >= kWatchdog_ns) {
    drives_on_ = false;
    currents_ma_ = {};
  }
}

hal::PolhemReport PolhemCounterpart::report() const {
  hal::PolhemReport said;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    said.counts[i] = static_cast<std::int16_t>(counts_[i]);  // its counters are wider: cut
  }
  said.switch_pressed = flagged_;
  return said;
}

bool PolhemCounterpart::on_out(std::span<const std::uint8_t> bytes) {
  hal::PolhemCommand command;
  if (hal::decode(bytes, command) != hal::PolhemVerdict::kOk) return true;
  since_report_ns_ = 0;
  drives_on_ = true;
  due_ = true;
  currents_ma_ = command.set_counts ? std::array<std::int16_t, 3>{} : command.currents_ma;
  if (!command.set_counts) return true;
  ++set_commands_;
  if (lost_set_commands > 0) {
    --lost_set_commands;
    return true;
  }
  under_way_ = report();
  old_left_ = old_reports;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    counts_[i] = command.counts[i] + (sets_wrong_counts ? 3000 : 0);
  }
  flagged_ = false;
  return true;
}

std::size_t PolhemCounterpart::on_in(std::span<std::uint8_t> bytes) {
  if (silent || !due_ || bytes.size() < hal::kPolhemReportBytes) return 0;
  due_ = false;
  hal::PolhemReport said = report();
  if (old_left_ > 0) {
    --old_left_;
    said = under_way_;
  }
  hal::encode(said, bytes.first<hal::kPolhemReportBytes>());
  return hal::kPolhemReportBytes;
}

}  // namespace haptic::test
