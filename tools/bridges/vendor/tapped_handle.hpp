// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Keeps what a device behind a vendor's library said in each turn, beside the calls by which it
/// said it.

#include <array>
#include <memory>
#include <utility>

#include "hal/bridge/device_tap.hpp"
#include "tools/bridges/record/sample_bytes.hpp"
#include "tools/bridges/vendor/vendor_exchange.hpp"

namespace haptic::tools {

/// Settings of a device, by which a replay makes it.
using VendorNumbers = std::array<double, 4>;
inline void note_settings(const std::shared_ptr<hal::DeviceTap>& tap, const VendorNumbers& n) {
  if (tap != nullptr) tap->note(hal::TapKind::kSettings, 0, {}, std::as_bytes(std::span(n)));
}

class TappedHandle final : public VendorHandle {
 public:
  /// @param handle  outlives this
  TappedHandle(VendorHandle& handle, std::shared_ptr<hal::DeviceTap> tap)
      : handle_(handle), tap_(std::move(tap)) {}

  [[nodiscard]] VendorResult sense(hal::BridgeSample& sample) noexcept override {
    if (tap_ == nullptr) return handle_.sense(sample);
    tap_->note(hal::TapKind::kSense, 0, {}, {});
    const VendorResult result = handle_.sense(sample);
    const SampleBytes bytes = bytes_of(sample);
    tap_->note(hal::TapKind::kSensed, static_cast<std::int64_t>(result), {},
               std::span(bytes).first(result == VendorResult::kDone ? bytes.size() : 0));
    return result;
  }
  [[nodiscard]] VendorResult exert(bool drives, const Wrench& wrench_d) noexcept override {
    if (tap_ == nullptr) return handle_.exert(drives, wrench_d);
    tap_->note(hal::TapKind::kExert, drives ? 1 : 0, bytes_of(wrench_d), {});
    const VendorResult result = handle_.exert(drives, wrench_d);
    tap_->note(hal::TapKind::kExerted, static_cast<std::int64_t>(result), {}, {});
    return result;
  }

 private:
  VendorHandle& handle_;
  const std::shared_ptr<hal::DeviceTap> tap_;
};

}  // namespace haptic::tools
