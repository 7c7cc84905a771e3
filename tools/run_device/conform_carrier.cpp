// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/conform_carrier.hpp"

#include <algorithm>
#include <atomic>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/process_peer.hpp"

namespace haptic::tools {
namespace {

constexpr unsigned kAnswer_ms = 100;
constexpr std::int64_t kNsPerMs = 1'000'000;

void sleep_for(std::int64_t time_ns) { (void)hal::sleep_until(hal::monotonic_ns() + time_ns); }

unsigned whole_ms(std::int64_t time_ns) {
  return static_cast<unsigned>(std::clamp<std::int64_t>(time_ns / kNsPerMs, 1, 10'000));
}

class UsbCarrier final : public ConformCarrier {
 public:
  explicit UsbCarrier(const hal::UsbAddress& address) : address_(address) {}

  std::string connect() override {
    std::string trouble;
    (void)connection_.open(hal::ReferenceDriver().profile(), address_, -1, trouble);
    return trouble;
  }
  void disconnect() noexcept override { connection_.close(); }
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved) override {
    return connection_.control(request, bytes, moved, kAnswer_ms);
  }
  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) override {
    std::size_t moved = 0;
    const hal::HalStatus status = connection_.read(bytes, moved, whole_ms(wait_ns));
    return status == hal::HalStatus::kOk ? moved : 0;
  }
  bool send(std::span<const std::uint8_t> bytes) override {
    return connection_.write(bytes, kAnswer_ms) == hal::HalStatus::kOk;
  }
  void pass(std::int64_t time_ns) override { sleep_for(time_ns); }
  std::optional<Endpoints> endpoints() const override {
    return Endpoints{connection_.in(), connection_.out()};
  }
  bool tells_of_its_end() const override { return false; }

 private:
  hal::UsbAddress address_;
  std::atomic<bool> cancelled_{false};
  hal::UsbContext context_;
  hal::UsbConnection connection_{context_, cancelled_};
};

class SocketCarrier final : public ConformCarrier {
 public:
  explicit SocketCarrier(const std::string& path) : peer_(path) {}

  std::string connect() override {
    const hal::HalStatus status = peer_.plug(hal::monotonic_ns());
    if (status == hal::HalStatus::kOk) return "";
    return std::string(peer_.name()) + ": " + hal::to_text(status) +
           "; start the program that serves it, and end the one that holds it";
  }
  void disconnect() noexcept override { peer_.unplug(); }
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved) override {
    return peer_.control(request, bytes, moved);
  }
  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) override {
    const std::int64_t end_ns = hal::monotonic_ns() + wait_ns;
    for (std::int64_t now = hal::monotonic_ns(); now < end_ns && !peer_.gone();
         now = hal::monotonic_ns()) {
      std::int64_t sampled_ns = now;
      if (const std::size_t size = peer_.report(now, bytes, sampled_ns); size > 0) return size;
      peer_.wait(end_ns);
    }
    return 0;
  }
  bool send(std::span<const std::uint8_t> bytes) override {
    peer_.command(hal::monotonic_ns(), bytes);
    return !peer_.gone();
  }
  void pass(std::int64_t time_ns) override { sleep_for(time_ns); }
  std::optional<Endpoints> endpoints() const override { return std::nullopt; }
  bool tells_of_its_end() const override { return true; }

 private:
  hal::ProcessPeer peer_;
};

}  // namespace

std::unique_ptr<ConformCarrier> conform_over_usb(const hal::UsbAddress& address) {
  return std::make_unique<UsbCarrier>(address);
}

std::unique_ptr<ConformCarrier> conform_over_socket(const std::string& path) {
  return std::make_unique<SocketCarrier>(path);
}

}  // namespace haptic::tools
