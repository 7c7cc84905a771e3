// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/spacenav_socket.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>

namespace haptic::hal {
namespace {

constexpr const char* kConfiguration = "/etc/spnavrc";
constexpr std::size_t kMostConfigurationBytes = 64 * 1024;
constexpr std::string_view kBlank = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string text_of(const char* path) {
  std::string text(kMostConfigurationBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return text;
}

}  // namespace

std::string spacenav_path_of(std::string_view spnavrc) {
  constexpr std::string_view kKey = "socket";
  while (!spnavrc.empty()) {
    const std::size_t end = std::min(spnavrc.find('\n'), spnavrc.size());
    const std::string_view line = trimmed(spnavrc.substr(0, end));
    spnavrc.remove_prefix(std::min(end + 1, spnavrc.size()));
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || trimmed(line.substr(0, equals)) != kKey) continue;
    const std::string_view path = trimmed(line.substr(equals + 1));
    if (!path.empty()) return std::string(path);
  }
  return {};
}

std::vector<std::string> spacenav_paths() {
  std::vector<std::string> paths;
  const char* const named = std::getenv("SPNAV_SOCKET");
  if (named != nullptr && *named != '\0') paths.emplace_back(named);
  if (std::string path = spacenav_path_of(text_of(kConfiguration)); !path.empty())
    paths.push_back(std::move(path));
  paths.emplace_back("/var/run/spnav.sock");
  paths.emplace_back("/run/spnav.sock");
  return paths;
}

int connect_spacenav(const std::string& path) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty()) return -ENOENT;
  if (path.size() >= sizeof address.sun_path) return -ENAMETOOLONG;
  std::copy(path.begin(), path.end(), address.sun_path);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return -errno;
  int result = 0;
  do {
    result = connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  } while (result != 0 && errno == EINTR);
  if (result == 0) return fd;
  const int error = errno;
  close(fd);
  return -error;
}

std::string spacenav_holder() {
  for (const std::string& path : spacenav_paths()) {
    const int fd = connect_spacenav(path);
    if (fd >= 0) close(fd);
    if (fd < 0 && fd != -EAGAIN) continue;
    return "spacenavd holds the devices of 3Dconnexion (it listens at " + path +
           "), and taking this one would take it from every program that uses the daemon\n"
           "  Give driver = \"spacenav\", which gets its motion from the daemon; or stop that: "
           "sudo "
           "systemctl stop spacenavd";
  }
  return {};
}

}  // namespace haptic::hal
