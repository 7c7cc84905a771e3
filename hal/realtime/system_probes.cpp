// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/system_probes.hpp"

#include <libusb.h>
#include <unistd.h>

#include <cerrno>
#include <thread>

#include "hal/usb/usb_context.hpp"

namespace haptic::hal {
namespace {

// In a thread of its own, which takes its priority and its core with it.
template <typename Attempt>
int in_a_thread(Attempt attempt) {
  int error = 0;
  std::thread([&] { error = attempt(); }).join();
  return error;
}

}  // namespace

int LinuxProbes::try_fifo(int priority) {
  return in_a_thread([=] { return set_fifo_priority(priority); });
}

int LinuxProbes::try_cpu(int cpu) {
  return in_a_thread([=] { return tie_to_cpu(cpu); });
}

int LinuxProbes::try_memory_lock() {
  const int error = lock_all_memory();
  if (error == 0) unlock_all_memory();
  return error;
}

int LinuxProbes::try_idle_hold() { return IdleStateHold().hold(); }

int LinuxProbes::try_node(const std::string& path) {
  return access(path.c_str(), R_OK | W_OK) == 0 ? 0 : errno;
}

UsbLibrary LinuxProbes::try_usb_library() {
  UsbLibrary found;
  const libusb_version* version = libusb_get_version();
  found.version = std::to_string(version->major) + "." + std::to_string(version->minor) + "." +
                  std::to_string(version->micro);
  UsbContext context;
  found.code = context.open(true);
  if (found.code != 0) found.code_name = libusb_error_name(found.code);
  context.close();
  return found;
}

}  // namespace haptic::hal
