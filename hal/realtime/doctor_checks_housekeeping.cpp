// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <iterator>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

constexpr std::int64_t kLeastStatInterval_s = 10;

// A setting of the kernel that is best at `wanted`.
struct KernelSetting {
  const char* name;
  const char* path;
  std::int64_t wanted;
  const char* well;  // found so
  const char* harm;  // of another value
  const char* command;
};

DoctorLine check_setting(const Examination& e, const KernelSetting& s) {
  const auto value = e.tree.number(s.path);
  if (!value) return passed(s.name, "this kernel has none");
  if (*value == s.wanted) return passed(s.name, s.well);
  return warned(s.name, s.harm + (" (" + std::to_string(*value)) + ")", s.command);
}

std::vector<int> in_common(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> both;
  std::copy_if(a.begin(), a.end(), std::back_inserter(both),
               [&](int cpu) { return std::find(b.begin(), b.end(), cpu) != b.end(); });
  return both;
}

std::vector<int> other_cpus(const Examination& e) {
  return without(online_cpus(e.tree), loop_cpus(e));
}

DoctorLine no_core_kept(const char* name, const std::string& found) {
  return skipped(name, found + "; no core is kept for the loop",
                 "isolate cores and name them (--cpu N,M)");
}

// A file with a mask of the cores that may do some work of the kernel's.
DoctorLine check_mask(const Examination& e, const char* name, const std::string& path,
                      const char* work) {
  const auto text = e.tree.text(path);
  if (!text) return passed(name, "this kernel has none");
  const std::vector<int> cpus = parse_cpu_mask(*text);
  const std::string found = std::string(work) + " on cores " + cpu_list_text(cpus);
  const std::vector<int> loop = loop_cpus(e), rest = other_cpus(e);
  if (loop.empty() || rest.empty()) return no_core_kept(name, found);
  const std::vector<int> met = in_common(in_common(cpus, online_cpus(e.tree)), loop);
  if (met.empty()) return passed(name, found);
  return warned(name, found + ", among them the loop's " + cpu_list_text(met),
                "leave it to the others:\n    echo " + cpu_mask_text(rest) + " | sudo tee " + path);
}

// "always [madvise] never": madvise.
std::string chosen_of(const std::string& text) {
  const std::size_t open = text.find('['), close = text.find(']', open);
  if (open == std::string::npos || close == std::string::npos) return text;
  return text.substr(open + 1, close - open - 1);
}

std::string own_cgroup(const SystemTree& tree) {
  // Version 2 has one line: "0::/user.slice".
  const std::string path = value_after(tree.text("/proc/self/cgroup").value_or(""), "0::");
  return "/sys/fs/cgroup" + (path == "/" ? "" : path);
}

}  // namespace

DoctorLine check_fair_server(const Examination& e) {
  const char* const name = "fair server";
  const std::string folder = "/sys/kernel/debug/sched/fair_server";
  const std::vector<int> loop = loop_cpus(e);
  const std::vector<int> cpus = loop.empty() ? online_cpus(e.tree) : loop;
  std::vector<int> active;
  bool seen = false;
  for (const int cpu : cpus) {
    const auto runtime_ns = e.tree.number(folder + "/cpu" + std::to_string(cpu) + "/runtime");
    seen = seen || runtime_ns.has_value();
    if (runtime_ns.value_or(0) > 0) active.push_back(cpu);
  }
  if (!seen) {
    return skipped(name, "not to be seen: Linux before 6.12 has none; later ones show it to root",
                   "look once as root:\n    sudo grep . " + folder + "/cpu*/runtime");
  }
  if (active.empty()) return passed(name, "off on cores " + cpu_list_text(cpus));
  std::string fix =
      "a stray ordinary task on such a core takes it from FIFO threads for up to 50 ms in a "
      "second, "
      "also with sched_rt_runtime_us=-1; switch it off:";
  for (const int cpu : active)
    fix += "\n    echo 0 | sudo tee " + folder + "/cpu" + std::to_string(cpu) + "/runtime";
  return warned(name, "on for cores " + cpu_list_text(active), fix);
}

DoctorLine check_timer_migration(const Examination& e) {
  return check_setting(
      e,
      {"timer migration", "/proc/sys/kernel/timer_migration", 0, "timers stay where they are set",
       "timers of idle cores move to busy ones, the loop's among them",
       "keep them where they are set:\n    sudo sysctl -w kernel.timer_migration=0"});
}

DoctorLine check_tick_skew(const Examination& e) {
  const char* const name = "tick skew";
  if (has_word(e.tree.text("/proc/cmdline").value_or(""), "skew_tick=1"))
    return passed(name, "the cores' ticks come one after the other");
  if (online_cpus(e.tree).size() < 2) return passed(name, "one processor, nobody to meet");
  return warned(name, "the ticks of all cores come at once and wait for each other's locks",
                "add the kernel argument:\n    skew_tick=1");
}

DoctorLine check_vm_statistics(const Examination& e) {
  const char* const name = "memory statistics";
  const auto interval_s = e.tree.number("/proc/sys/vm/stat_interval");
  if (!interval_s) return passed(name, "this kernel has none");
  const std::string found = "gathered every " + std::to_string(*interval_s) + " s";
  if (*interval_s >= kLeastStatInterval_s) return passed(name, found);
  return warned(name, found + " by a worker on each core",
                "let it be rare:\n    sudo sysctl -w vm.stat_interval=10");
}

DoctorLine check_hung_tasks(const Examination& e) {
  return check_setting(
      e,
      {"hung-task check", "/proc/sys/kernel/hung_task_timeout_secs", 0, "off",
       "the kernel walks through all tasks every so many seconds",
       "switch it off while the loop runs:\n    sudo sysctl -w kernel.hung_task_timeout_secs=0"});
}

DoctorLine check_soft_lockups(const Examination& e) {
  const char* const name = "lockup watchdog";
  if (e.tree.number("/proc/sys/kernel/soft_watchdog").value_or(0) == 0) return passed(name, "off");
  const std::vector<int> watched =
      parse_cpu_list(e.tree.text("/proc/sys/kernel/watchdog_cpumask").value_or(""));
  const std::string found =
      "a thread above all others every few seconds on cores " +
      (watched.empty() ? std::string("of all kinds") : cpu_list_text(watched));
  const std::vector<int> loop = loop_cpus(e), rest = other_cpus(e);
  if (loop.empty() || rest.empty()) return no_core_kept(name, found);
  if (!watched.empty() && in_common(watched, loop).empty()) return passed(name, found);
  return warned(name, found,
                "let it watch the others:\n    sudo sysctl -w kernel.watchdog_cpumask=" +
                    cpu_list_text(rest));
}

DoctorLine check_huge_pages(const Examination& e) {
  const char* const name = "huge pages";
  const std::string path = "/sys/kernel/mm/transparent_hugepage/enabled";
  const auto text = e.tree.text(path);
  if (!text) return passed(name, "this kernel has none");
  const std::string chosen = chosen_of(*text);
  if (chosen != "always") return passed(name, chosen);
  return warned(name, "always: pages are joined behind the loop's back, which stops its memory",
                "leave it to who asks for it:\n    echo madvise | sudo tee " + path);
}

DoctorLine check_numa_balancing(const Examination& e) {
  return check_setting(e, {"NUMA balancing", "/proc/sys/kernel/numa_balancing", 0, "off",
                           "the kernel unmaps pages to see who uses them, locked ones too",
                           "switch it off:\n    sudo sysctl -w kernel.numa_balancing=0"});
}

DoctorLine check_page_merging(const Examination& e) {
  const char* const name = "page merging";
  const auto run = e.tree.number("/sys/kernel/mm/ksm/run");
  // 2: stopped, and what was merged is apart again.
  if (run.value_or(0) != 1) return passed(name, run ? "off" : "this kernel has none");
  return warned(name, "ksmd merges equal pages; a write to one faults",
                "stop it and take the pages apart:\n    echo 2 | sudo tee /sys/kernel/mm/ksm/run");
}

DoctorLine check_workqueues(const Examination& e) {
  return check_mask(e, "workqueues", "/sys/devices/virtual/workqueue/cpumask",
                    "the kernel's unbound workers");
}

DoctorLine check_writeback(const Examination& e) {
  return check_mask(e, "writeback", "/sys/devices/virtual/workqueue/writeback/cpumask",
                    "writing files back");
}

DoctorLine check_default_interrupts(const Examination& e) {
  return check_mask(e, "new interrupts", "/proc/irq/default_smp_affinity",
                    "interrupts of devices that come later");
}

DoctorLine check_irqbalance(const Examination& e) {
  const char* const name = "irqbalance";
  for (const std::string& pid : e.tree.names("/proc")) {
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    if (e.tree.text("/proc/" + pid + "/comm") != "irqbalance") continue;
    return warned(name, "runs (process " + pid + "): moves interrupts, onto the loop's cores too",
                  "stop it; isolated cores alone it leaves out by itself:\n"
                  "    sudo systemctl disable --now irqbalance");
  }
  return passed(name, "does not run");
}

DoctorLine check_machine_checks(const Examination& e) {
  const char* const name = "machine checks";
  const std::string folder = "/sys/devices/system/machinecheck/machinecheck";
  const std::vector<int> loop = loop_cpus(e);
  std::vector<int> polled;
  for (const int cpu : loop.empty() ? online_cpus(e.tree) : loop) {
    // In hexadecimal, but zero is zero.
    const auto interval_s = e.tree.text(folder + std::to_string(cpu) + "/check_interval");
    if (interval_s && *interval_s != "0") polled.push_back(cpu);
  }
  if (polled.empty()) return passed(name, "not polled");
  std::string fix = "faults that matter come as an interrupt; stop the polling:";
  for (const int cpu : polled)
    fix += "\n    echo 0 | sudo tee " + folder + std::to_string(cpu) + "/check_interval";
  return warned(name, "polled by a timer on cores " + cpu_list_text(polled), fix);
}

DoctorLine check_tracer(const Examination& e) {
  const char* const name = "tracer";
  for (const std::string folder : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
    const auto tracer = e.tree.text(folder + "/current_tracer");
    if (!tracer) continue;
    const std::string events = e.tree.text(folder + "/events/enable").value_or("0");
    if (*tracer == "nop" && events == "0") return passed(name, "none");
    return warned(name,
                  (*tracer == "nop" ? "trace events" : *tracer) +
                      " active: each function or "
                      "event of the kernel takes longer",
                  "switch it off:\n    echo nop | sudo tee " + folder +
                      "/current_tracer\n    echo 0 "
                      "| sudo tee " +
                      folder + "/events/enable");
  }
  return skipped(name, "/sys/kernel/tracing is root's to see",
                 "look once as root:\n    sudo cat /sys/kernel/tracing/current_tracer");
}

DoctorLine check_debug_kernel(const Examination& e) {
  const char* const name = "debug kernel";
  // SLUB_DEBUG alone costs nothing: distributions have it, and it acts when switched on.
  static constexpr std::array<const char*, 6> kCostly = {
      "CONFIG_LOCKDEP=y",       "CONFIG_PROVE_LOCKING=y", "CONFIG_DEBUG_PREEMPT=y",
      "CONFIG_SLUB_DEBUG_ON=y", "CONFIG_KASAN=y",         "CONFIG_DEBUG_OBJECTS=y"};
  const std::string release = e.tree.text("/proc/sys/kernel/osrelease").value_or("?");
  const auto config = e.tree.text("/boot/config-" + release);
  std::string found;
  const auto add = [&](const std::string& what) { found += (found.empty() ? "" : ", ") + what; };
  for (const char* option : kCostly) {
    if (config && has_word(*config, option)) add(option);
  }
  const std::string cmdline = e.tree.text("/proc/cmdline").value_or("");
  if (cmdline.find("slub_debug") != std::string::npos) add("slub_debug on the command line");
  if (!found.empty()) {
    return warned(name, found + ": checks in every lock and allocation",
                  "boot a kernel without them; Debian's:\n"
                  "    sudo apt-get install linux-image-rt-amd64 && sudo reboot");
  }
  if (config) return passed(name, "no costly checks in /boot/config-" + release);
  return skipped(name, "no /boot/config-" + release, "see how the kernel was configured");
}

DoctorLine check_partition(const Examination& e) {
  const char* const name = "cpuset partition";
  const std::vector<int> isolated = isolated_cpus(e.tree);
  const std::string group = own_cgroup(e.tree);
  const std::string kind = e.tree.text(group + "/cpuset.cpus.partition").value_or("");
  if (kind == "isolated") {
    const std::string cpus = e.tree.text(group + "/cpuset.cpus.effective").value_or("?");
    return passed(name, "this control group has cores " + cpus + " for itself");
  }
  if (kind.find("invalid") != std::string::npos) {
    return warned(name, group + ": " + kind,
                  "its cores must be in no other group's cpuset.cpus.exclusive, and its parent a "
                  "partition or the root; see\n    grep . /sys/fs/cgroup/*/cpuset.cpus*");
  }
  if (!isolated.empty()) return passed(name, "not needed: cores are isolated since boot");
  if (!e.tree.has("/sys/fs/cgroup/cgroup.controllers"))
    return skipped(name, "no control groups of version 2", "isolate cores at boot (line above)");
  const std::string list = cpu_list_text(proposed_cpus(e));
  return warned(name, "no core is isolated, neither at boot nor by a partition",
                "without a reboot, of this shell and what it starts (at boot is better: ticks stop "
                "too):\n"
                "    echo +cpuset | sudo tee /sys/fs/cgroup/cgroup.subtree_control\n"
                "    sudo mkdir -p /sys/fs/cgroup/haptic\n"
                "    echo " +
                    list +
                    " | sudo tee /sys/fs/cgroup/haptic/cpuset.cpus\n"
                    "    echo isolated | sudo tee /sys/fs/cgroup/haptic/cpuset.cpus.partition\n"
                    "    echo $$ | sudo tee /sys/fs/cgroup/haptic/cgroup.procs");
}

}  // namespace haptic::hal
