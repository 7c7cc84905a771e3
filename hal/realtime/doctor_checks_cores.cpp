// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <iterator>
#include <set>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

std::string cpu_path(const std::string& rest) { return "/sys/devices/system/cpu/" + rest; }

// The processors that share a core with `cpu`, as the kernel writes them; its own number where the
// tree does not say.
std::string core_of(const SystemTree& tree, int cpu) {
  const std::string topology = cpu_path("cpu" + std::to_string(cpu) + "/topology/");
  const auto siblings = tree.text(topology + "thread_siblings_list");
  return siblings && !siblings->empty() ? *siblings : std::to_string(cpu);
}

bool contains_all(const std::vector<int>& all, const std::vector<int>& some) {
  return std::all_of(some.begin(), some.end(),
                     [&](int cpu) { return std::find(all.begin(), all.end(), cpu) != all.end(); });
}

// "2,3" as the command line takes it, in the order given.
std::string comma_list(const std::vector<int>& cpus) {
  std::string text;
  for (const int cpu : cpus) text += (text.empty() ? "" : ",") + std::to_string(cpu);
  return text;
}

}  // namespace

DoctorLine check_clock(const Examination& e) {
  const std::string name = "clock";
  const auto source =
      e.tree.text("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (!source) return skipped(name, "the kernel does not say which clock it uses", "mount /sys");
  const std::string flags = value_after(e.tree.text("/proc/cpuinfo").value_or(""), "flags");
  // Other architectures have one counter, which does not stop.
  if (*source == "arch_sys_counter") return passed(name, *source);
  if (*source != "tsc") {
    return warned(name, *source + ": each reading of the time is slow",
                  "see `dmesg | grep -i tsc` for why the kernel left it; where the processor's is "
                  "sound, add kernel arguments:\n"
                  "    tsc=reliable clocksource=tsc");
  }
  std::string missing;
  for (const char* flag : {"constant_tsc", "nonstop_tsc"}) {
    if (!has_word(flags, flag)) missing += std::string(missing.empty() ? "" : " ") + flag;
  }
  if (!missing.empty()) {
    return warned(name, "tsc, but the processor lacks " + missing,
                  "its rate follows the frequency or it stops in sleep; use another processor, or "
                  "hold frequency and idle states (lines below)");
  }
  return passed(name, "tsc, constant_tsc nonstop_tsc");
}

DoctorLine check_cores(const Examination& e) {
  const std::string name = "cores";
  const std::vector<int> online = online_cpus(e.tree);
  std::set<std::string> cores, asked;
  for (const int cpu : online) cores.insert(core_of(e.tree, cpu));
  for (const int cpu : e.questions.cpus) asked.insert(core_of(e.tree, cpu));
  const std::string found = std::to_string(cores.size()) +
                            (cores.size() == 1 ? " core, " : " cores, ") +
                            std::to_string(online.size()) + " processors online";
  if (cores.size() < 2) {
    return warned(name, found + ": servo and USB thread, each of which watches the other, share it",
                  "use a machine with two cores or more");
  }
  if (!e.questions.cpus.empty() && asked.size() < 2) {
    return warned(
        name, found + ", but both threads would share the core of " + comma_list(e.questions.cpus),
        "give servo and USB thread, each of which watches the other, a core each "
        "(--cpu N,M)");
  }
  return passed(name, found + ": servo and USB thread can have one each");
}

DoctorLine check_smt(const Examination& e) {
  const std::string name = "SMT";
  const auto active = e.tree.number(cpu_path("smt/active"));
  if (active.value_or(0) == 0) return passed(name, "no two processors share a core");
  return warned(name, "on: a neighbour on the same core slows the loop down",
                "switch it off, now or with the kernel argument nosmt:\n"
                "    echo off | sudo tee /sys/devices/system/cpu/smt/control");
}

DoctorLine check_isolation(const Examination& e) {
  const std::string name = "isolated cores";
  const std::vector<int> isolated = isolated_cpus(e.tree);
  const std::vector<int> tickless = parse_cpu_list(e.tree.text(cpu_path("nohz_full")).value_or(""));
  const std::string found =
      "isolated: " + cpu_list_text(isolated) + "; nohz_full: " + cpu_list_text(tickless);
  const std::vector<int>& asked = e.questions.cpus;
  const std::vector<int>& needed = asked.empty() ? isolated : asked;
  if (!isolated.empty() && contains_all(isolated, needed) && contains_all(tickless, needed))
    return passed(name, found);
  const std::vector<int> online = online_cpus(e.tree), wanted = proposed_cpus(e);
  const std::vector<int> rest = without(online, wanted);
  if (rest.empty()) {
    return warned(name, found + "; all " + std::to_string(online.size()) + " would be needed",
                  "leave the rest of the system a core: name fewer, or use a machine with more");
  }
  const std::string list = cpu_list_text(wanted);
  return warned(name, found,
                "add kernel arguments (Debian: GRUB_CMDLINE_LINUX in /etc/default/grub, then sudo "
                "update-grub && sudo reboot):\n"
                "    isolcpus=managed_irq,domain," +
                    list + " nohz_full=" + list + " rcu_nocbs=" + list +
                    " irqaffinity=" + cpu_list_text(rest));
}

DoctorLine check_affinity(const Examination& e) {
  const std::string name = "affinity";
  const std::string allowed =
      value_after(e.tree.text("/proc/self/status").value_or(""), "Cpus_allowed_list:");
  for (const int cpu : e.questions.cpus) {
    const int error = e.probes.try_cpu(cpu);
    if (error == 0) continue;
    return failed(name,
                  "core " + std::to_string(cpu) + " refused: " + errno_text(error) +
                      "; online: " + cpu_list_text(online_cpus(e.tree)),
                  "name cores that are online (--cpu N,M), and give this control group the core:\n"
                  "    cat /sys/fs/cgroup/cpuset.cpus.effective");
  }
  if (!e.questions.cpus.empty())
    return passed(name, "threads can be tied to cores " + comma_list(e.questions.cpus));
  const std::vector<int> isolated = isolated_cpus(e.tree);
  if (!isolated.empty()) {
    return warned(name, "isolated cores " + cpu_list_text(isolated) + " are left unused",
                  "tie servo and USB thread to them:\n    --cpu " + comma_list(isolated));
  }
  return passed(name, "not tied; may run on " + (allowed.empty() ? "any core" : allowed));
}

DoctorLine check_governor(const Examination& e) {
  const std::string name = "governor";
  std::size_t policies = 0;
  std::set<std::string> others;
  for (const std::string& policy : e.tree.names(cpu_path("cpufreq"))) {
    const auto governor = e.tree.text(cpu_path("cpufreq/" + policy + "/scaling_governor"));
    if (!governor) continue;
    policies += 1;
    if (*governor != "performance") others.insert(*governor);
  }
  if (policies == 0) {
    return skipped(name, "no frequency control to be seen (usual in a virtual machine)",
                   "set the governor where the processors are: in the host");
  }
  if (others.empty())
    return passed(name, "performance (" + std::to_string(policies) + " policies)");
  std::string found;
  for (const std::string& other : others) found += (found.empty() ? "" : ", ") + other;
  return warned(name, found,
                "hold the frequency:\n"
                "    echo performance | sudo tee "
                "/sys/devices/system/cpu/cpufreq/policy*/scaling_governor");
}

DoctorLine check_idle_states(const Examination& e) {
  const std::string name = "idle states";
  const int error = e.probes.try_idle_hold();
  if (error == 0) return passed(name, "/dev/cpu_dma_latency can be held at 0");
  const std::string found = "/dev/cpu_dma_latency refused: " + errno_text(error);
  if (error == ENOENT) {
    return warned(name, found,
                  "this kernel has no power management requests; shut deep idle states off with "
                  "kernel arguments:\n"
                  "    processor.max_cstate=1 intel_idle.max_cstate=0");
  }
  return warned(name, found,
                "let the group `realtime` hold it, with this line in "
                "/etc/udev/rules.d/60-haptic.rules:\n"
                "    KERNEL==\"cpu_dma_latency\", GROUP=\"realtime\", MODE=\"0660\"\n"
                "    sudo udevadm control --reload && sudo udevadm trigger "
                "--name-match=cpu_dma_latency");
}

}  // namespace haptic::hal
