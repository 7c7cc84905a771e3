// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Descriptors of a device, read once, and the standard requests (USB 2.0, chapter 9) that they
/// answer. Every carrier uses them, so a host sees the same device on each.

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace haptic::sim {

/// Standard request codes that both sides of a carrier name.
enum StandardRequest : std::uint8_t {
  kGetStatus = 0,
  kClearFeature = 1,
  kGetDescriptor = 6,
  kGetConfiguration = 8,
  kSetConfiguration = 9,
  kGetInterface = 10,
  kSetInterface = 11
};

/// The eight bytes that begin a control transfer.
inline constexpr std::size_t kSetupBytes = 8;

/// Immutable; any thread.
class UsbDescriptors {
 public:
  struct Endpoint {
    unsigned type = 0;  ///< bmAttributes: 0 control, 2 bulk, 3 interrupt
    unsigned interface = 0;
  };

  /// `bytes`: device descriptor, then the configurations, of which the first is the active one.
  /// @throws tools::InputError  no descriptors, or lengths that contradict each other.
  explicit UsbDescriptors(std::vector<std::uint8_t> bytes);

  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }
  [[nodiscard]] std::uint8_t configuration() const { return configuration_; }
  /// By address; address 0 is always there.
  [[nodiscard]] const std::map<std::uint8_t, Endpoint>& endpoints() const { return endpoints_; }
  [[nodiscard]] bool has_setting(unsigned interface, unsigned alternate) const {
    return settings_.count({interface, alternate}) != 0;
  }

  /// Answer to a request to the host: GET_DESCRIPTOR of device and configuration,
  /// GET_CONFIGURATION, GET_INTERFACE, GET_STATUS. Returns the bytes moved, or -1: a matter for the
  /// function.
  [[nodiscard]] long answer(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                            std::uint16_t index, std::span<std::uint8_t> bytes) const;

 private:
  [[nodiscard]] std::span<const std::uint8_t> active() const;

  std::vector<std::uint8_t> bytes_;
  std::uint8_t configuration_ = 0;
  std::map<std::uint8_t, Endpoint> endpoints_;
  std::set<std::pair<unsigned, unsigned>> settings_;  ///< interface, alternate setting
};

}  // namespace haptic::sim
