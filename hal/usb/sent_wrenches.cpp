// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/sent_wrenches.hpp"

#include <algorithm>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::hal {
namespace {

void raise(HeldWrench& to, const HeldWrench& by) noexcept {
  to.force_n = std::max(to.force_n, by.force_n);
  to.torque_nm = std::max(to.torque_nm, by.torque_nm);
}

}  // namespace

void SentWrenches::begin() noexcept { *this = SentWrenches(); }

void SentWrenches::sent(const Wrench& wrench_d, const CommandReceipt& receipt) noexcept {
  last_ = {static_cast<double>(wrench_d.force_w.norm()),
           static_cast<double>(wrench_d.torque_w.norm())};
  if (!receipt.told) return;
  if (count_ == kRemembered) {
    first_ = (first_ + 1) % kRemembered;
    count_ -= 1;
    forgot_ = true;
  }
  ring_[(first_ + count_++) % kRemembered] = {receipt.sent, last_, wrench_d};
  raise(largest_, last_);
}

void SentWrenches::told(const CommandReceipt& receipt) noexcept {
  if (!receipt.told) return;
  const bool advanced = !tells_ || receipt.accepted != told_;
  tells_ = true;
  told_ = receipt.accepted;
  if (advanced) {
    bool known = false;
    while (count_ > 0 && !is_newer(ring_[first_].sequence, receipt.accepted)) {
      accepted_ = ring_[first_].wrench;
      accepted_d_ = ring_[first_].wrench_d;
      known = ring_[first_].sequence == receipt.accepted;
      first_ = (first_ + 1) % kRemembered;
      count_ -= 1;
    }
    // One that is newer than all of ours is the zero command of who holds it; one that is older
    // than what is remembered can have been any of those sent.
    if (!known && count_ == 0) {
      accepted_ = {};
      accepted_d_ = {};
    }
    is_known_ = known || count_ == 0;
    if (!known && count_ > 0 && forgot_) {
      accepted_ = largest_;
    } else {
      forgot_ = false;
      largest_ = {};
      for (std::size_t k = 0; k < count_; ++k)
        raise(largest_, ring_[(first_ + k) % kRemembered].wrench);
    }
  }
  if (!receipt.drives_on) {
    accepted_ = {};
    accepted_d_ = {};
    is_known_ = true;
  }
}

HeldWrench SentWrenches::held() const noexcept {
  if (!tells_) return last_;
  HeldWrench most = accepted_;
  raise(most, largest_);
  return most;
}

}  // namespace haptic::hal
