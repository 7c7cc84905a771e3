// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How large a full push is by the time spacenavd sends it.

#include <cstdint>
#include <string_view>

namespace haptic::tools {

/// An axis at full push, as spacenavd 1.1 sends it at sensitivity 1: 500 where the kernel calls the
/// axes absolute, since the daemon maps their range to that (its dev_usb_linux.c; GPL-3, facts
/// only); what the device reports, hal::kDisplacementFullScale, where it calls them relative or the
/// device is not found.
/// @param input_devices  text of /proc/bus/input/devices.
[[nodiscard]] double spacenav_full_scale(std::string_view input_devices, std::uint16_t vendor_id,
                                         std::uint16_t product_id) noexcept;

/// By this machine's list.
[[nodiscard]] double spacenav_full_scale(std::uint16_t vendor_id, std::uint16_t product_id);

}  // namespace haptic::tools
