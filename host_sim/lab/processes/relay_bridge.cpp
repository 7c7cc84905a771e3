// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/relay_bridge.hpp"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <system_error>

#include "hal/bridge/bridge_service.hpp"
#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/process_peer.hpp"

namespace haptic::sim {
namespace {

constexpr std::int64_t kAgain_ns = 50'000'000;
constexpr int kBridgePriority = 80;  // between the device, which stands for hardware, and the rest
// Reports by which the device may be behind its newest command: that of a period is on its way.
constexpr std::uint32_t kMostUnanswered = 3;

std::atomic<bool> g_stop{false}, g_deaf{false};
extern "C" void stop_relay(int /*signal*/) { g_stop.store(true); }
extern "C" void turn_deaf(int signal) { g_deaf.store(signal == SIGUSR1); }

/// The device at another socket, spoken to as by a host.
class RelayedDevice final : public hal::BridgedDevice, private hal::UsbPort {
 public:
  explicit RelayedDevice(const std::string& path) : peer_(path) {}

  bool open(std::string& why) override {
    why = "the device of the relay is not there";
    is_through_ = false;
    if (peer_.plug(hal::monotonic_ns()) != hal::HalStatus::kOk) return false;
    if (driver_.start(*this) != hal::HalStatus::kOk) return false;
    facts_.name = "relayed device";
    facts_.capabilities = driver_.capabilities();
    return true;
  }
  const hal::BridgeFacts& facts() const override { return facts_; }

  hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override {
    std::array<std::uint8_t, hal::kMaxReportBytes> bytes{};
    std::int64_t sampled_ns = now_ns;
    const std::size_t size = peer_.report(now_ns, bytes, sampled_ns);
    if (size == 0) {
      peer_.wait(now_ns);
      return peer_.gone() ? hal::BridgeRead::kLost : hal::BridgeRead::kSilent;
    }
    if (driver_.read(std::span(bytes).first(size), sampled_ns, state_) !=
        hal::ReportVerdict::kState)
      return hal::BridgeRead::kSilent;
    sample.sampled_ns = sampled_ns;
    sample.pose_dh = state_.pose_dh;
    sample.twist_d = state_.twist_d;
    sample.twist_valid = state_.twist_valid;
    sample.calibrated = state_.link == LinkState::kReady;
    sample.emergency_stop = (state_.faults & kDeviceEmergencyStop) != 0;
    sample.switches = state_.switches;
    return hal::BridgeRead::kNew;
  }

  /// Until the device has its drives on it is asked for them with nothing.
  bool write(std::int64_t now_ns, const Wrench& wrench_d) override {
    const bool is_on = driver_.receipt().drives_on;
    if (g_deaf.load()) return false;
    send(now_ns, is_on && is_through_ ? wrench_d : Wrench{});
    is_through_ = is_on;
    return driver_.receipt().unanswered <= kMostUnanswered;
  }

  bool release(std::int64_t now_ns) override {
    is_through_ = false;
    if (g_deaf.load()) return false;
    std::array<std::uint8_t, hal::kMaxReportBytes> bytes{};
    const std::size_t size = driver_.release(++tick_, bytes);
    if (size > 0) peer_.command(now_ns, std::span(bytes).first(size));
    return !driver_.receipt().drives_on;
  }

  void close() noexcept override { peer_.unplug(); }

 private:
  void send(std::int64_t now_ns, const Wrench& wrench_d) {
    std::array<std::uint8_t, hal::kMaxReportBytes> bytes{};
    Wrench delivered_d;
    const std::size_t size = driver_.write(wrench_d, ++tick_, bytes, delivered_d);
    if (size > 0) peer_.command(now_ns, std::span(bytes).first(size));
  }

  // Port of the driver's start.
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned /*timeout_ms*/) noexcept override {
    return peer_.control(request, bytes, moved);
  }
  hal::HalStatus write(std::span<const std::uint8_t> /*bytes*/,
                       unsigned /*timeout_ms*/) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus read(std::span<std::uint8_t> /*bytes*/, std::size_t& /*moved*/,
                      unsigned /*timeout_ms*/) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  bool cancelled() const noexcept override { return false; }

  hal::ProcessPeer peer_;
  hal::ReferenceDriver driver_;
  haptic::DeviceState state_;
  hal::BridgeFacts facts_;
  std::uint64_t tick_ = 0;
  bool is_through_ = false;
};

[[noreturn]] void relay(const std::string& listen, const std::string& device) {
  (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
  struct sigaction action {};
  action.sa_handler = stop_relay;
  (void)sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = turn_deaf;
  for (const int number : {SIGUSR1, SIGUSR2}) (void)sigaction(number, &action, nullptr);
  (void)hal::set_fifo_priority(kBridgePriority);
  RelayedDevice relayed(device);
  hal::BridgeSettings settings;
  settings.path = listen;
  settings.again_ns = kAgain_ns;
  _exit(hal::serve_bridge(relayed, settings, g_stop));
}

}  // namespace

RelayBridge::RelayBridge(const std::string& listen, const std::string& device) : pid_(fork()) {
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0) relay(listen, device);
}

void RelayBridge::be_deaf(bool deaf) { (void)kill(pid_, deaf ? SIGUSR1 : SIGUSR2); }

RelayBridge::~RelayBridge() {
  (void)kill(pid_, SIGKILL);
  (void)waitpid(pid_, nullptr, 0);
}

}  // namespace haptic::sim
