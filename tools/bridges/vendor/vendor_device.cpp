// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/vendor/vendor_device.hpp"

#include <thread>
#include <utility>

#include "hal/clock/servo_clock.hpp"

namespace haptic::tools {
namespace {

constexpr std::int64_t kMs_ns = 1'000'000;

}  // namespace

hal::BridgeRead VendorDevice::read(std::int64_t now_ns, hal::BridgeSample& sample) {
  return exchange_ ? exchange_->read(now_ns, sample) : hal::BridgeRead::kLost;
}

bool VendorDevice::write(std::int64_t now_ns, const Wrench& wrench_d) {
  return exchange_ && exchange_->write(now_ns, wrench_d);
}

bool VendorDevice::release(std::int64_t now_ns) { return exchange_ && exchange_->release(now_ns); }

pollfd VendorDevice::watched() const noexcept {
  return exchange_ ? exchange_->watched() : pollfd{-1, 0, 0};
}

bool VendorDevice::wait_for_sample(hal::BridgeSample& sample) {
  const std::int64_t until_ns = hal::monotonic_ns() + kLongestCall_ns;
  for (std::int64_t now_ns = hal::monotonic_ns(); now_ns < until_ns; now_ns = hal::monotonic_ns()) {
    const hal::BridgeRead read = exchange_->read(now_ns, sample);
    if (read == hal::BridgeRead::kNew) return true;
    if (read == hal::BridgeRead::kLost) return false;
    (void)hal::sleep_until(now_ns + kMs_ns);
  }
  return false;
}

void VendorDevice::end_by(std::function<void()> work) noexcept {
  const auto ended = std::make_shared<std::atomic<bool>>(false);
  has_ended_ = ended;
  std::thread([ended, work = std::move(work)]() mutable {
    work();
    work = nullptr;  // what it holds goes first
    ended->store(true);
  }).detach();
  const std::int64_t until_ns = hal::monotonic_ns() + kLongestCall_ns;
  while (!ended->load() && hal::monotonic_ns() < until_ns)
    (void)hal::sleep_until(hal::monotonic_ns() + kMs_ns);
}

bool VendorDevice::is_free(std::string& why) const {
  if (!has_ended_ || has_ended_->load()) return true;
  why =
      "a call of the vendor's library has not returned since the device was closed; unplug the "
      "device, or end this program and start it again";
  return false;
}

}  // namespace haptic::tools
