// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/system_probes.hpp"

#include <fcntl.h>
#include <libusb.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "hal/drivers/spacenav_socket.hpp"
#include "hal/realtime/doctor_checks.hpp"
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

int LinuxProbes::try_socket(const std::string& path) {
  const int fd = connect_spacenav(path);
  if (fd >= 0) close(fd);
  return fd >= 0 ? 0 : -fd;
}

std::string LinuxProbes::variable(const std::string& name) {
  const char* const value = std::getenv(name.c_str());
  return value != nullptr ? value : "";
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

bool LinuxProbes::has_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  std::string folder;
  while (std::getline(folders, folder, ':')) {
    if (access((folder + "/" + name).c_str(), X_OK) == 0) return true;
  }
  return false;
}

std::string LinuxProbes::run_program(const std::vector<std::string>& command) {
  int ends[2] = {-1, -1};
  if (command.empty() || pipe2(ends, O_CLOEXEC) != 0) return "";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::vector<char*> arguments;
  for (const std::string& each : command) arguments.push_back(const_cast<char*>(each.c_str()));
  arguments.push_back(nullptr);
  pid_t child = -1;
  const int error =
      posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string text = error != 0 ? command[0] + ": " + errno_text(error) : "";
  char part[4096];
  for (ssize_t count = 0; error == 0 && (count = read(ends[0], part, sizeof part)) > 0;)
    text.append(part, static_cast<std::size_t>(count));
  close(ends[0]);
  if (error == 0) waitpid(child, nullptr, 0);
  return text;
}

}  // namespace haptic::hal
