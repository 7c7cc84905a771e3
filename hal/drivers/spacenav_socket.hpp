// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where spacenavd, the free daemon for six-axis devices, takes connections. It holds every device
/// of 3Dconnexion that it finds, and hands its events to all programs that connect. Facts: libspnav
/// 1.0, spnav.c (BSD).

#include <string>
#include <string_view>
#include <vector>

namespace haptic::hal {

/// The value of the first line `socket = PATH` of the text of /etc/spnavrc; empty: there is none.
[[nodiscard]] std::string spacenav_path_of(std::string_view spnavrc);

/// Paths to try, in libspnav's order: the environment's SPNAV_SOCKET, that of /etc/spnavrc,
/// /var/run/spnav.sock, and /run/spnav.sock where a system has no /var/run.
[[nodiscard]] std::vector<std::string> spacenav_paths();

/// @return a descriptor of the connection, which neither blocks nor outlives an exec; or a negative
///   errno: -ENAMETOOLONG for a path that no socket can have, -EAGAIN for a daemon that has left
///   too many connections waiting. Returns at once.
[[nodiscard]] int connect_spacenav(const std::string& path) noexcept;

/// For people: where spacenavd runs, and what to do about it where a device is to be opened without
/// it. Empty: nobody listens at any of the paths.
[[nodiscard]] std::string spacenav_holder();

}  // namespace haptic::hal
