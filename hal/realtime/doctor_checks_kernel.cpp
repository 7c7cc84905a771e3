// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <charconv>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

// Numbers of linux/capability.h.
constexpr unsigned kCapIpcLock = 14, kCapSysNice = 23;

bool has_capability(const SystemTree& tree, unsigned number) {
  const std::string mask = value_after(tree.text("/proc/self/status").value_or(""), "CapEff:");
  std::uint64_t bits = 0;
  std::from_chars(mask.data(), mask.data() + mask.size(), bits, 16);
  return ((bits >> number) & 1u) != 0;
}

// The soft limit as /proc/self/limits writes it: a number or "unlimited"; "?" where it is not
// there.
std::string soft_limit(const SystemTree& tree, std::string_view name) {
  const std::string value = value_after(tree.text("/proc/self/limits").value_or(""), name);
  const std::string soft = value.substr(0, value.find(' '));
  return soft.empty() ? "?" : soft;
}

std::int64_t as_number(const std::string& text, std::int64_t otherwise) {
  std::int64_t value = otherwise;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

const char kLimitsMend[] =
    "give the group `realtime` these limits, join it, then log out and in:\n"
    "    run_device doctor --print haptic-limits.conf | sudo tee "
    "/etc/security/limits.d/haptic-limits.conf\n"
    "    sudo groupadd -f realtime && sudo usermod -aG realtime $USER\n"
    "which writes\n"
    "    @realtime - rtprio 95\n"
    "    @realtime - memlock unlimited";

}  // namespace

DoctorLine check_preempt_rt(const Examination& e) {
  const std::string name = "PREEMPT_RT";
  const std::string release = "Linux " + e.tree.text("/proc/sys/kernel/osrelease").value_or("?");
  const std::optional<std::int64_t> flag = e.tree.number("/sys/kernel/realtime");
  const std::string version = e.tree.text("/proc/sys/kernel/version").value_or("");
  // Kernels that have it in the main line need not have the file.
  if (flag == 1 || has_word(version, "PREEMPT_RT")) return passed(name, release + " has it");
  return refused(name,
                 release + (flag ? ": /sys/kernel/realtime reads " + std::to_string(*flag)
                                 : ": no /sys/kernel/realtime, and its version does not say so"),
                 "boot a PREEMPT_RT kernel; Debian has one:\n"
                 "    sudo apt-get install linux-image-rt-amd64 && sudo reboot");
}

DoctorLine check_fifo(const Examination& e) {
  const std::string name = "SCHED_FIFO";
  const int priority = e.questions.servo_priority;
  const std::string limit = soft_limit(e.tree, "Max realtime priority");
  const bool capable = has_capability(e.tree, kCapSysNice);
  const int error = e.probes.try_fifo(priority);
  const std::string rights =
      "RLIMIT_RTPRIO " + limit + (capable ? ", CAP_SYS_NICE held" : ", no CAP_SYS_NICE");
  const std::string asked = "priority " + std::to_string(priority);
  if (error == 0) return passed(name, asked + " granted (" + rights + ")");
  const std::string found = asked + " refused: " + errno_text(error) + "; " + rights;
  if (error != EPERM)
    return failed(name, found, "ask for a priority from 1 to 99 on a Linux kernel");
  if (capable || as_number(limit, 0) >= priority) {
    return failed(name, found,
                  "the right is there, so a control group without real-time budget or a container "
                  "refuses; allow it:\n"
                  "    sudo sysctl -w kernel.sched_rt_runtime_us=-1\n"
                  "    docker run --cap-add=SYS_NICE --ulimit rtprio=95 --ulimit memlock=-1 ...");
  }
  return failed(name, found, kLimitsMend);
}

DoctorLine check_memory_lock(const Examination& e) {
  const std::string name = "memory lock";
  const std::string limit = soft_limit(e.tree, "Max locked memory");
  const bool capable = has_capability(e.tree, kCapIpcLock);
  const bool unlimited = capable || limit == "unlimited";
  const std::string rights = "RLIMIT_MEMLOCK " + limit + (limit == "unlimited" ? "" : " bytes") +
                             (capable ? ", CAP_IPC_LOCK held" : ", no CAP_IPC_LOCK");
  const int error = e.probes.try_memory_lock();
  if (error != 0)
    return failed(name, "mlockall refused: " + errno_text(error) + "; " + rights, kLimitsMend);
  if (!unlimited) {
    return refused(name, "mlockall granted, but later allocations may be refused: " + rights,
                   kLimitsMend);
  }
  return passed(name, "mlockall granted (" + rights + ")");
}

DoctorLine check_swap(const Examination& e) {
  const std::string name = "swap";
  const std::optional<std::string> swaps = e.tree.text("/proc/swaps");
  if (!swaps) return passed(name, "this kernel has none");
  const std::size_t heading = swaps->find('\n');
  if (heading == std::string::npos) return passed(name, "off");
  const std::string first = swaps->substr(heading + 1);
  return warned(name, "on: " + first.substr(0, first.find_first_of(" \t")),
                "locked memory stays, but a machine that swaps makes everybody wait:\n"
                "    sudo swapoff -a");
}

DoctorLine check_throttling(const Examination& e) {
  const std::string name = "RT throttling";
  const auto runtime = e.tree.number("/proc/sys/kernel/sched_rt_runtime_us");
  const auto period = e.tree.number("/proc/sys/kernel/sched_rt_period_us");
  if (!runtime || !period)
    return skipped(name, "this kernel does not say (/proc/sys/kernel/sched_rt_runtime_us)",
                   "look at it outside of the container");
  if (*runtime < 0 || *runtime >= *period) return passed(name, "off");
  return warned(name,
                "FIFO threads get " + std::to_string(*runtime) + " of every " +
                    std::to_string(*period) + " us",
                "a loop that sleeps in every period never meets it; one that spins stands still "
                "for the rest. Where cores are isolated:\n"
                "    sudo sysctl -w kernel.sched_rt_runtime_us=-1");
}

DoctorLine check_kernel_watchdog(const Examination& e) {
  const std::string name = "kernel watchdog";
  const auto counter = e.tree.number("/proc/sys/kernel/nmi_watchdog");
  if (counter.value_or(0) == 0) return passed(name, "no non-maskable interrupts of its own");
  const std::string mask = e.tree.text("/proc/sys/kernel/watchdog_cpumask").value_or("all");
  return warned(name, "a non-maskable interrupt every few seconds on cores " + mask,
                "switch it off while the loop runs:\n"
                "    sudo sysctl -w kernel.nmi_watchdog=0");
}

DoctorLine check_virtual_machine(const Examination& e) {
  const std::string name = "virtual machine";
  const std::string cpu = e.tree.text("/proc/cpuinfo").value_or("");
  if (!has_word(value_after(cpu, "flags"), "hypervisor")) return passed(name, "no hypervisor");
  return warned(name, "a hypervisor runs below this kernel and may stop it at any time",
                "drive motors from a kernel on the machine itself; here, trust the measured "
                "wake-ups alone");
}

}  // namespace haptic::hal
