// SPDX-License-Identifier: Apache-2.0
/// The Falcon's driver against any bytes. The first byte chooses: the stream of packets while the
/// firmware runs, or the dialogue that loads the firmware.
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/falcon_firmware.hpp"
#include "tests/fuzz/report_stream.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using haptic::fuzz::ReportStream;
using haptic::fuzz::require;

void run_reports(ReportStream input) {
  FalconDriver driver{FalconSettings{}};
  DeviceState state;
  while (!input.empty()) {
    const std::uint8_t what = input.byte();
    if ((what & 1u) == 0) {
      const DeviceState before = state;
      const ReportVerdict verdict = driver.read(input.report(), 0, state);
      if (verdict != ReportVerdict::kState) fuzz::require_same(before, state);
      fuzz::require_usable(state);
      require(vec3_of(state.pose_dh.p_m).norm() <= 0.1001_r,
              "positions are within the arm's reach");
      continue;
    }
    std::array<std::uint8_t, kFalconPacketBytes> bytes{};
    Wrench delivered;
    require(driver.write(input.wrench(), 1, bytes, delivered) == bytes.size(), "a packet is sent");
    FalconCommand command;
    require(decode(bytes, command), "what is sent is a packet");
    require(is_finite(delivered), "the force delivered is finite");
    require(delivered.torque_w.isZero(), "no torque is delivered");
    for (const std::int16_t motor : command.motors) {
      require(std::abs(int{motor}) <= kFalconMaxMotor, "motor values are within their limit");
      if (state.link != LinkState::kReady) require(motor == 0, "no force before homing");
    }
  }
}

/// Echoes, changes, cuts or refuses as the input says.
class HostilePort : public UsbPort {
 public:
  explicit HostilePort(ReportStream input) : input_(input) {}

  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned timeout_ms) noexcept override {
    moved = 0;
    count(timeout_ms);
    require(request.request_type == 0x40 && bytes.empty(), "a vendor request without bytes");
    return (input_.byte() & 0x3fu) == 0x3f ? HalStatus::kTransferFailed : HalStatus::kOk;
  }
  HalStatus write(std::span<const std::uint8_t> bytes, unsigned timeout_ms) noexcept override {
    count(timeout_ms);
    require(bytes.size() <= kFalconBlockBytes, "a write is one block at most");
    std::copy(bytes.begin(), bytes.end(), sent_.begin());
    sent_bytes_ = bytes.size();
    return HalStatus::kOk;
  }
  HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                 unsigned timeout_ms) noexcept override {
    count(timeout_ms);
    moved = 0;
    const std::uint8_t what = input_.byte();
    if (what == 0xff) return HalStatus::kDeviceGone;
    if (what == 0xfe) return HalStatus::kTimeout;
    if (what == 0xfd) {  // says that it moved more than there is room for
      moved = bytes.size() + 5;
      return HalStatus::kOk;
    }
    // What was sent comes back; or the loader's answer; or the input's own bytes.
    static constexpr std::array<std::uint8_t, 4> kReply{0x0a, 0x44, 0x2c, 0x0d};
    std::span<const std::uint8_t> answer(sent_.data(), sent_bytes_);
    if (sent_bytes_ == 3) answer = kReply;
    if ((what & 0x80u) != 0) answer = input_.take(what & 0x3fu);
    bytes[0] = 0x01;
    bytes[1] = 0x60;
    const std::size_t n = std::min(answer.size(), bytes.size() - 2);
    std::copy_n(answer.begin(), n, bytes.begin() + 2);
    moved = n + 2;
    return HalStatus::kOk;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

 private:
  void count(unsigned timeout_ms) noexcept {
    require(timeout_ms <= 1000, "no call waits longer than a second");
    require(++calls_ < 20000, "the dialogue ends");
  }

  ReportStream input_;
  std::array<std::uint8_t, 64> sent_{};
  std::size_t sent_bytes_ = 0;
  int calls_ = 0;
};

/// A file of kFalconLeastImageBytes and some, in memory.
const std::string& image_path() {
  static const std::string path = [] {
    const int file = ::memfd_create("falcon_image", 0);
    std::array<std::uint8_t, kFalconLeastImageBytes + 100> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 7);
    if (file < 0 || ::write(file, bytes.data(), bytes.size()) != ssize_t{bytes.size()})
      std::abort();
    return "/proc/self/fd/" + std::to_string(file);
  }();
  return path;
}

void run_dialogue(ReportStream input) {
  FalconSettings settings;
  settings.firmware_path = image_path();
  settings.accept_unknown_firmware = true;
  FalconDriver driver(settings);
  HostilePort port(input);
  const HalStatus status = driver.start(port);
  require(status == HalStatus::kOk || status == HalStatus::kStartFailed ||
              status == HalStatus::kDeviceGone || status == HalStatus::kTransferFailed,
          "a start succeeds, fails, or tells the port's trouble");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReportStream input(std::span(data, size));
  if ((input.byte() & 1u) == 0) {
    run_reports(input);
  } else {
    run_dialogue(input);
  }
  return 0;
}
