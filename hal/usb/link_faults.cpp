// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/link_faults.hpp"

#include <algorithm>

namespace haptic::hal {

void LinkFaults::begin(std::int64_t now_ns) noexcept {
  set_present(kLinkLost | kLinkSilent | kLinkCorrupt | kLinkFrozen | kLinkSendFailed | kLinkDeaf,
              false);
  heard_ns_ = now_ns;
  corrupt_ = frozen_ = 0;
}

void LinkFaults::expect_reports_every(std::int64_t report_period_ns) noexcept {
  silence_ns_ = std::max(limits_.silence_ns, kMissedReports * report_period_ns);
}

void LinkFaults::note(ReportVerdict verdict, std::int64_t now_ns) noexcept {
  switch (verdict) {
    case ReportVerdict::kState:
    case ReportVerdict::kNothing:
      corrupt_ = frozen_ = 0;
      break;
    case ReportVerdict::kNotAdvancing:
      corrupt_ = 0;
      ++frozen_;
      break;
    default:
      ++corrupt_;
      break;
  }
  // A frozen device is not a silent one.
  if (corrupt_ == 0) heard_ns_ = now_ns;
  set_present(kLinkCorrupt, corrupt_ >= limits_.corrupt_in_a_row);
  set_present(kLinkFrozen, frozen_ >= limits_.frozen_in_a_row);
  check_silence(now_ns);
}

void LinkFaults::check_silence(std::int64_t now_ns) noexcept {
  set_present(kLinkSilent, now_ns - heard_ns_ > silence_ns_);
}

void LinkFaults::set_present(std::uint32_t bits, bool present) noexcept {
  if (!present) {
    present_ &= ~bits;
    return;
  }
  raise(bits);
  present_ |= bits;
}

void LinkFaults::raise(std::uint32_t bits) noexcept {
  if ((bits & ~unanswered_) == 0) return;
  unanswered_ |= bits;
  carried_from_ = 0;
}

void LinkFaults::carried(std::uint64_t sequence) noexcept {
  if (carried_from_ == 0) carried_from_ = sequence;
}

void LinkFaults::answered(const DeviceCommand& command) noexcept {
  const bool knows = command.tick != 0 && carried_from_ != 0 && command.sequence >= carried_from_;
  if (knows) unanswered_ &= present_;
}

}  // namespace haptic::hal
