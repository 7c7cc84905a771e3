// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Common part of the devices that are reached through a vendor's library.

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "hal/bridge/bridged_device.hpp"
#include "tools/bridges/vendor/vendor_exchange.hpp"

namespace haptic::tools {

/// Answers from the exchange alone, so none of the calls waits for the library; `open` and `close`
/// wait, for at most kLongestCall_ns beyond what the library itself takes in `open`.
class VendorDevice : public hal::BridgedDevice {
 public:
  static constexpr std::int64_t kLongestCall_ns = 2'000'000'000;

  [[nodiscard]] const hal::BridgeFacts& facts() const override { return facts_; }
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override;
  [[nodiscard]] bool write(std::int64_t now_ns, const Wrench& wrench_d) override;
  [[nodiscard]] bool release(std::int64_t now_ns) override;
  [[nodiscard]] pollfd watched() const noexcept override;
  /// Nobody knows what closed code calls.
  [[nodiscard]] bool can_be_confined() const noexcept override { return false; }

 protected:
  /// The first sample since the device was opened; false: none within kLongestCall_ns.
  [[nodiscard]] bool wait_for_sample(hal::BridgeSample& sample);
  /// Runs `work` on a thread and waits for it; one that takes too long is left behind with what it
  /// holds, and the device cannot be opened again until it has come back.
  void end_by(std::function<void()> work) noexcept;
  /// False, with `why`: a call of the session before has not returned.
  [[nodiscard]] bool is_free(std::string& why) const;

  hal::BridgeFacts facts_;
  std::shared_ptr<VendorExchange> exchange_;  ///< while it is open

 private:
  std::shared_ptr<std::atomic<bool>> has_ended_;  ///< of the last `end_by`
};

}  // namespace haptic::tools
