// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/vhci_port.hpp"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace haptic::sim {
namespace {

constexpr const char* kHighSpeedHub = "hs";
constexpr unsigned kStateFree = 4;  // VDEV_ST_NULL of the kernel's usbip_common.h
// Bus and device number that the peer of a real export would have; any that are not zero.
constexpr unsigned kDeviceId = 1u << 16 | 2u;
// Another program may take the port between our look and our write.
constexpr int kTries = 4;

[[noreturn]] void refuse(const std::string& what, int code) {
  std::string text = what + ": " + std::strerror(code);
  if (code == EACCES || code == EPERM)
    text += "; only root may plug in a virtual device: run this with sudo";
  if (code == EBUSY || code == EINVAL)
    text += "; is the port taken by another program (usbip port)?";
  throw std::runtime_error(text);
}

std::string status_of(const std::string& folder) {
  std::ifstream stream(folder + "/status");
  if (!stream) {
    throw std::runtime_error(folder +
                             ": this kernel has no virtual USB host controller now; load it with "
                             "sudo modprobe vhci-hcd");
  }
  return {std::istreambuf_iterator<char>(stream), {}};
}

// In one write, as the kernel wants it. Returns 0 or an errno.
int write_line(int file, const std::string& line) {
  const ssize_t count = write(file, line.data(), line.size());
  if (count < 0) return errno;
  return count == static_cast<ssize_t>(line.size()) ? 0 : EIO;
}

}  // namespace

// "hub port sta spd dev sockfd local_busid", port and state in decimal.
std::optional<unsigned> free_vhci_port(std::string_view status) {
  std::istringstream lines{std::string(status)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string hub;
    unsigned port = 0, state = 0;
    if (words >> hub >> port >> state && hub == kHighSpeedHub && state == kStateFree) return port;
  }
  return std::nullopt;
}

unsigned attach_to_vhci(int descriptor, int speed, const std::string& folder) {
  const std::string name = folder + "/attach";
  int error = EBUSY;
  for (int k = 0; k < kTries && error == EBUSY; ++k) {
    const std::optional<unsigned> port = free_vhci_port(status_of(folder));
    if (!port) throw std::runtime_error(folder + ": no free high-speed port; unplug one of them");
    const int file = open(name.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) refuse(name, errno);
    std::ostringstream line;
    line << *port << ' ' << descriptor << ' ' << kDeviceId << ' ' << speed << '\n';
    error = write_line(file, line.str());
    close(file);
    if (error == 0) return *port;
  }
  refuse(name, error);
}

unsigned raise_vhci_threads(int priority, const std::string& processes) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  unsigned raised = 0;
  std::error_code gone;  // processes end while they are looked at
  for (std::filesystem::directory_iterator each(processes, gone), end; each != end;
       each.increment(gone)) {
    const std::string number = each->path().filename().string();
    pid_t process = 0;
    const char* const last = number.data() + number.size();
    if (std::from_chars(number.data(), last, process).ptr != last) continue;
    std::string name;
    std::getline(std::ifstream(each->path() / "comm"), name);
    if (name != "vhci_rx" && name != "vhci_tx") continue;
    if (sched_setscheduler(process, SCHED_FIFO, &parameters) == 0) ++raised;
  }
  return raised;
}

}  // namespace haptic::sim
