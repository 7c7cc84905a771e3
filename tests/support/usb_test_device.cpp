// SPDX-License-Identifier: Apache-2.0
#include "tests/support/usb_test_device.hpp"

#include <cerrno>
#include <cmath>

namespace haptic::test {
namespace {

constexpr std::uint32_t kCheck = 0x5a17c0de;
constexpr double kForceUnit_n = 1.0e-6, kPositionUnit_m = 1.0e-6;

std::uint32_t check_of(const Words& words) { return words[0] ^ words[1] ^ words[2] ^ kCheck; }

}  // namespace

std::array<std::uint8_t, 16> packed(Words words) {
  words[3] ^= check_of(words);  // a caller's non-zero last word damages the check
  std::array<std::uint8_t, 16> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(words[i / 4] >> (8 * (i % 4)));
  return bytes;
}

Words unpacked(std::span<const std::uint8_t> bytes) {
  Words words{};
  for (std::size_t i = 0; i < 16; ++i)
    words[i / 4] |= static_cast<std::uint32_t>(bytes[i]) << (8 * (i % 4));
  return words;
}

bool checks(const Words& words) { return words[3] == check_of(words); }

std::vector<std::uint8_t> UsbTestDevice::descriptors() const {
  const std::uint8_t ends = interrupt_out ? 2 : 1;
  const auto total = static_cast<std::uint8_t>(9 + 9 + 7 * ends);
  const std::uint8_t all[] = {18,   1,    0x00,
                              2,    0xff, 0,
                              0,    64,   0x09,
                              0x12, 0x0f, 0,
                              0,    1,    0,
                              0,    0,    1,  // device
                              9,    2,    total,
                              0,    1,    1,
                              0,    0x80, 50,  // configuration
                              9,    4,    0,
                              0,    ends, 0xff,
                              0,    0,    0,  // interface
                              7,    5,    kInEndpoint,
                              3,    16,   0,
                              1,  //
                              7,    5,    kOutEndpoint,
                              3,    16,   0,
                              1};
  return {all, all + 18 + total};
}

// Vendor request 7 answers with its value; CLEAR_FEATURE to an endpoint clears a halt.
int UsbTestDevice::control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                           std::uint16_t /*index*/, std::span<std::uint8_t> bytes) {
  if (request_type == 0xc0 && request == 7) {
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(value);
    return static_cast<int>(bytes.size());
  }
  if (request_type == 0x02 && request == 1) ++halts_cleared;
  return (request_type & 0x60u) == 0 ? 0 : -EPIPE;
}

int UsbTestDevice::out(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> bytes) {
  const Words words = bytes.size() == kCommandBytes ? unpacked(bytes) : Words{};
  if (checks(words) && words[2] == 1) {
    ++released;
    force_before_release_n = forces_n.empty() ? 0.0 : forces_n.back();
  } else if (checks(words)) {
    forces_after_release += released > 0 ? 1 : 0;
    forces_n.push_back(static_cast<double>(static_cast<std::int32_t>(words[0])) * kForceUnit_n);
    ticks.push_back(words[1]);
  } else {
    ++damaged;
  }
  if (on_command) on_command();
  return static_cast<int>(bytes.size());
}

UsbTestDriver::UsbTestDriver() {
  profile_.name = "test device";
  profile_.vendor_id = 0x1209;
  profile_.product_id = 0x000f;
  profile_.in_endpoint = kInEndpoint;
  profile_.out_endpoint = kOutEndpoint;
  profile_.in_bytes = kReportBytes;
  profile_.out_bytes = kCommandBytes;
  capabilities_.sensed_dof = capabilities_.driven_dof = hal::kDofX;
  // Stronger than every limit that a test sets: those of the link count.
  capabilities_.max_force_n = 100;
  capabilities_.max_torque_nm = 10;
  capabilities_.watchdog_ns = 100'000'000;
}

hal::HalStatus UsbTestDriver::start(hal::UsbPort& port) noexcept {
  ++starts;
  last_ = 0;
  return on_start ? on_start(port) : hal::HalStatus::kOk;
}

hal::ReportVerdict UsbTestDriver::read(std::span<const std::uint8_t> report,
                                       std::int64_t /*stamp_ns*/, DeviceState& state) noexcept {
  if (report.size() != kReportBytes) return hal::ReportVerdict::kBadLength;
  const Words words = unpacked(report);
  if (!checks(words)) return hal::ReportVerdict::kBadCheck;
  if (words[0] <= last_) return hal::ReportVerdict::kNotAdvancing;
  last_ = words[0];
  state.pose_dh = PoseRecord{};
  state.pose_dh.p_m[0] = static_cast<Real>(static_cast<std::int32_t>(words[1]) * kPositionUnit_m);
  state.link = words[2] == 1 ? LinkState::kReady : LinkState::kStarting;
  state.faults = 0;
  return hal::ReportVerdict::kState;
}

std::size_t UsbTestDriver::write(const Wrench& wrench_d, std::uint64_t tick,
                                 std::span<std::uint8_t> report, Wrench& delivered_d) noexcept {
  const auto units = std::lround(static_cast<double>(wrench_d.force_w.x()) / kForceUnit_n);
  delivered_d = Wrench{};
  delivered_d.force_w.x() = static_cast<Real>(static_cast<double>(units) * kForceUnit_n);
  const auto bytes = packed({static_cast<std::uint32_t>(units), static_cast<std::uint32_t>(tick)});
  std::copy(bytes.begin(), bytes.end(), report.begin());
  return bytes.size();
}

std::size_t UsbTestDriver::release(std::uint64_t tick, std::span<std::uint8_t> report) noexcept {
  if (!releases) return 0;
  const auto bytes = packed({0, static_cast<std::uint32_t>(tick), 1});
  std::copy(bytes.begin(), bytes.end(), report.begin());
  return bytes.size();
}

}  // namespace haptic::test
