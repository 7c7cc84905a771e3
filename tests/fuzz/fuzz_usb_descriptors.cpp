// SPDX-License-Identifier: Apache-2.0
/// Any bytes as what a device says it is. The first four are a request to the device half; the rest
/// are its descriptors, which the device half refuses or answers requests from, and which a host
/// with the real libusb then opens and polls.
#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <span>

#include "hal/drivers/reference_driver.hpp"
#include "hal/usb/usb_link.hpp"
#include "host_sim/device/usb_descriptors.hpp"
#include "host_sim/device/usbfs_carrier.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/error.hpp"

namespace {

using namespace haptic;
using haptic::fuzz::require;

void check_requests(const sim::UsbDescriptors& device, std::array<std::uint8_t, 4> request) {
  require(device.endpoints().count(0) == 1, "the control endpoint is always there");
  std::array<std::uint8_t, 512> room{};
  constexpr std::uint8_t kUntouched = 0xa5;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{9}, room.size() - 1}) {
    for (const unsigned recipient : {0u, 1u, 2u, unsigned{request[0]}}) {
      for (const std::uint16_t value : {std::uint16_t{0x0100}, std::uint16_t{0x0200},
                                        static_cast<std::uint16_t>(request[2] << 8)}) {
        for (const std::uint8_t code :
             {std::uint8_t{0}, std::uint8_t{6}, std::uint8_t{8}, std::uint8_t{10}, request[1]}) {
          room.fill(kUntouched);
          const long moved = device.answer(static_cast<std::uint8_t>(0x80u | recipient), code,
                                           value, request[3], std::span(room).first(size));
          require(moved >= -1 && moved <= static_cast<long>(size), "an answer fits its room");
          const auto behind =
              std::span(room).subspan(static_cast<std::size_t>(std::max(moved, 0L)));
          require(std::all_of(behind.begin(), behind.end(),
                              [](std::uint8_t byte) { return byte == kUntouched; }),
                  "nothing is written behind an answer");
        }
      }
    }
  }
}

class SayingFunction final : public sim::UsbFunction {
 public:
  explicit SayingFunction(std::span<const std::uint8_t> bytes)
      : bytes_(bytes.begin(), bytes.end()) {}
  [[nodiscard]] std::vector<std::uint8_t> descriptors() const override { return bytes_; }
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t, std::uint16_t, std::uint16_t,
              std::span<std::uint8_t>) override {
    return (request_type & 0x60u) == 0 ? 0 : -EPIPE;
  }
  int out(std::uint8_t, std::span<const std::uint8_t> bytes) override {
    require(bytes.size() <= hal::kReferenceCommandBytes, "no more goes out than a command");
    return static_cast<int>(bytes.size());
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

void poll_with_libusb(std::span<const std::uint8_t> descriptors) {
  SayingFunction function(descriptors);
  sim::UsbfsCarrier carrier(function);
  hal::ReferenceSettings its;
  its.ask_device = false;
  hal::ReferenceDriver driver(its);
  hal::MailboxMemory mailbox;
  hal::LinkSettings settings;
  settings.address.wrapped_fd = carrier.descriptor();
  hal::UsbLink link(driver, mailbox, settings);
  const hal::HalStatus status = link.poll(0);
  require(status == hal::HalStatus::kOk || link.state() == LinkState::kAbsent,
          "a device that is refused is absent");
  require(status == hal::HalStatus::kOk || !link.trouble().empty(), "and why is said");
  if (status != hal::HalStatus::kOk) return;
  const sim::UsbDescriptors said({descriptors.begin(), descriptors.end()});
  std::array<std::uint8_t, hal::kReferenceReportBytes> report{};
  hal::ReferenceReport plain;
  plain.sequence = 1;
  hal::encode(plain, report);
  for (const auto& each : said.endpoints()) {
    if (each.first >= 0x80) (void)carrier.push(each.first, report);
  }
  for (int turn = 0; turn < 3; ++turn) (void)link.poll(0);
  carrier.unplug();
  for (int turn = 0; turn < 3; ++turn) (void)link.poll(0);
  require(link.state() == LinkState::kAbsent, "an unplugged device is absent");
}

}  // namespace

/// For the leak sanitizer: libusb 1.0.26 loses 40 bytes for an interface that ends within its
/// endpoints.
// NOLINTNEXTLINE(readability-identifier-naming,bugprone-reserved-identifier): its name is given.
extern "C" const char* __lsan_default_suppressions() { return "leak:libusb-1.0"; }

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span<const std::uint8_t> input(data, size);
  std::array<std::uint8_t, 4> request{};
  std::copy_n(input.begin(), std::min(input.size(), request.size()), request.begin());
  input = input.subspan(std::min(input.size(), request.size()));
  try {
    check_requests(sim::UsbDescriptors({input.begin(), input.end()}), request);
  } catch (const tools::InputError&) {
    return 0;
  }
  poll_with_libusb(input);
  return 0;
}
