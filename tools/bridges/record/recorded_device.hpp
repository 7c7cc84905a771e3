// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device whose calls by the bridge are kept beside what it says to its device.

#include <memory>
#include <string>

#include "hal/bridge/bridged_device.hpp"

namespace haptic::tools {

class RecordedDevice final : public hal::BridgedDevice {
 public:
  /// `recorder` becomes the device's tap too.
  RecordedDevice(std::unique_ptr<hal::BridgedDevice> device,
                 std::shared_ptr<hal::DeviceTap> recorder);

  [[nodiscard]] bool open(std::string& why) override;
  [[nodiscard]] const hal::BridgeFacts& facts() const override { return device_->facts(); }
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override;
  [[nodiscard]] bool write(std::int64_t now_ns, const Wrench& wrench_d) override;
  [[nodiscard]] bool release(std::int64_t now_ns) override;
  void close() noexcept override;
  [[nodiscard]] pollfd watched() const noexcept override { return device_->watched(); }
  [[nodiscard]] bool can_be_confined() const noexcept override {
    return device_->can_be_confined();
  }

 private:
  std::unique_ptr<hal::BridgedDevice> device_;
  bool is_open_ = false;
};

}  // namespace haptic::tools
