// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A call of a vendor's library, made through a tap: its name, its arguments and its outputs are
/// kept, or given back from a recording without the library.

#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>

#include "hal/bridge/device_tap.hpp"

namespace haptic::tools {

template <typename Value>
[[nodiscard]] std::span<const std::byte> call_bytes(const Value& value) noexcept {
  return std::as_bytes(std::span<const Value, 1>(&value, 1));
}

/// Without outputs but its result.
template <typename Live>
[[nodiscard]] int vendor_call(const std::shared_ptr<hal::DeviceTap>& tap, std::string_view name,
                              const Live& live) noexcept {
  return static_cast<int>(
      hal::through(tap.get(), hal::TapKind::kCall, std::as_bytes(std::span(name)), {}, live));
}

/// With `output`, of numbers without padding, that it fills.
template <typename Output, typename Live>
[[nodiscard]] int vendor_call(const std::shared_ptr<hal::DeviceTap>& tap, std::string_view name,
                              Output& output, const Live& live) noexcept {
  return static_cast<int>(
      hal::through(tap.get(), hal::TapKind::kCall, std::as_bytes(std::span(name)),
                   std::as_writable_bytes(std::span<Output, 1>(&output, 1)), live));
}

/// With `arguments`, of numbers without padding.
template <typename Arguments, typename Live>
[[nodiscard]] int vendor_call_with(const std::shared_ptr<hal::DeviceTap>& tap,
                                   std::string_view name, const Arguments& arguments,
                                   const Live& live) noexcept {
  if (tap == nullptr) return live();
  std::array<std::byte, 64 + sizeof arguments> sent{};
  const std::size_t length = name.size() < 64 ? name.size() : 64;
  std::memcpy(sent.data(), name.data(), length);
  std::memcpy(sent.data() + length, &arguments, sizeof arguments);
  return static_cast<int>(hal::through(tap.get(), hal::TapKind::kCall,
                                       std::span(sent).first(length + sizeof arguments), {}, live));
}

/// Without values: not kept, and left out in a replay.
template <typename Live>
void vendor_order(const std::shared_ptr<hal::DeviceTap>& tap, const Live& live) noexcept {
  if (tap == nullptr || !tap->is_replay()) live();
}

}  // namespace haptic::tools
