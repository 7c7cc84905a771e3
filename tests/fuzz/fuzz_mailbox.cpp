// SPDX-License-Identifier: Apache-2.0
/// The servo's half of the mailbox with any bytes in it, written between reads and during them: the
/// device side reads no further than the half, never writes to it, and ends; and what the output
/// guard makes of such commands is within the limits, step by step.
///
/// Steps, a byte each: 0 publish, 1 scribble (two bytes where, length, bytes), 2 read, 3 read a
/// hundred times while another thread scribbles what follows (length, bytes).
#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "hal/device_limits.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/usb/output_guard.hpp"
#include "tests/fuzz/report_stream.hpp"
#include "tests/support/force_monitor.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using haptic::fuzz::ReportStream;
using haptic::fuzz::require;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::size_t kHalfBytes = sizeof(CommandHalf);

/// Halves of their own on the heap, so that a read beyond one is seen.
struct Halves {
  std::unique_ptr<StateHalf> states = std::make_unique<StateHalf>();
  std::unique_ptr<CommandHalf> commands = std::make_unique<CommandHalf>();
  [[nodiscard]] DeviceMailbox mailbox() const { return {states.get(), commands.get()}; }
  [[nodiscard]] unsigned char* bytes() const {
    return reinterpret_cast<unsigned char*>(commands.get());
  }
};

class Session {
 public:
  explicit Session(ReportStream input) : input_(input) {}

  void run() {
    while (!input_.empty()) {
      switch (input_.byte() % 4u) {
        case 0:
          publish();
          break;
        case 1:
          scribble();
          break;
        case 2:
          read_whole();
          break;
        default:
          read_meanwhile();
          break;
      }
    }
  }

 private:
  void publish() {
    DeviceCommand command;
    command.tick = ++tick_;
    command.stamp_ns = now_ns_;
    command.arming = 1 + input_.byte() % 4u;
    command.wrench_d = record_of(input_.wrench());
    servo_.publish(command);
  }
  void scribble() {
    const std::size_t where = input_.byte() + 256u * input_.byte();
    const auto bytes = input_.take(input_.byte());
    for (std::size_t i = 0; i < bytes.size(); ++i) half()[(where + i) % kHalfBytes] = bytes[i];
  }
  void read_whole() {
    std::array<unsigned char, kHalfBytes> before{};
    std::memcpy(before.data(), half(), kHalfBytes);
    read();
    require(std::memcmp(before.data(), half(), kHalfBytes) == 0, "a reader writes nothing");
  }
  void read_meanwhile() {
    const auto bytes = input_.take(input_.byte());
    std::atomic<bool> run = true;
    std::thread scribbler([&] {
      std::size_t at = 0;
      while (run.load(std::memory_order_relaxed)) {
        for (const std::uint8_t byte : bytes)
          std::atomic_ref(half()[at++ % kHalfBytes]).store(byte, std::memory_order_relaxed);
      }
    });
    try {
      for (int k = 0; k < 100; ++k) read();
    } catch (...) {
      run = false;
      scribbler.join();
      throw;
    }
    run = false;
    scribbler.join();
  }
  void read() {
    now_ns_ += kPeriod_ns;
    const DeviceCommand command = device_.command();
    device_.publish(DeviceState{}, false);
    test::SentCommand sent;
    sent.stamp_ns = now_ns_;
    sent.wrench_d = guard_.update(now_ns_, command).wrench_d;
    sent.ready = sent.drives_on = true;
    sent.fading = command.tick == 0 || !is_finite(wrench_of(command.wrench_d));
    const std::string broken = monitor_.on_send(sent);
    require(broken.empty(), broken.c_str());
  }
  [[nodiscard]] unsigned char* half() const { return halves_.bytes(); }

  ReportStream input_;
  Halves halves_;
  DeviceSide device_{halves_.mailbox()};
  ServoSide servo_{halves_.mailbox()};
  DeviceCapabilities capabilities_ = reference_capabilities();
  SafetyLimits limits_ = limits_of(capabilities_, kPeriod_ns);
  OutputGuard guard_{limits_};
  test::ForceMonitor monitor_{test::ForceBlock::of(capabilities_, limits_)};
  std::int64_t now_ns_ = 1'000'000'000;
  std::uint64_t tick_ = 0;
};

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Session(ReportStream(std::span(data, size))).run();
  return 0;
}
