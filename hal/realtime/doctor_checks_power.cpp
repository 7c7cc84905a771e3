// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

const std::string kCpuFolder = "/sys/devices/system/cpu/";
const std::string kHostDrivers = "/sys/bus/pci/drivers/";

std::string joined(const std::set<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

DoctorLine check_energy_preference(const Examination& e) {
  const char* const name = "energy preference";
  std::set<std::string> found;
  bool seen = false;
  for (const std::string& policy : e.tree.names(kCpuFolder + "cpufreq")) {
    const auto preference =
        e.tree.text(kCpuFolder + "cpufreq/" + policy + "/energy_performance_preference");
    if (!preference) continue;
    seen = true;
    if (*preference != "performance") found.insert("preference " + *preference);
  }
  for (const int cpu : online_cpus(e.tree)) {
    const auto bias =
        e.tree.number(kCpuFolder + "cpu" + std::to_string(cpu) + "/power/energy_perf_bias");
    if (!bias) continue;
    seen = true;
    if (*bias != 0) found.insert("bias " + std::to_string(*bias));
  }
  if (!seen) return passed(name, "these processors have none");
  if (found.empty()) return passed(name, "performance");
  return warned(name, joined(found) + ": the processor wakes up slow to save energy",
                "prefer performance:\n"
                "    echo performance | sudo tee "
                "/sys/devices/system/cpu/cpufreq/policy*/energy_performance_preference\n"
                "    echo 0 | sudo tee /sys/devices/system/cpu/cpu*/power/energy_perf_bias");
}

DoctorLine check_least_speed(const Examination& e) {
  const char* const name = "least speed";
  const auto percent = e.tree.number(kCpuFolder + "intel_pstate/min_perf_pct");
  if (percent) {
    if (*percent == 100) return passed(name, "100 % of the greatest");
    return warned(name, std::to_string(*percent) + " % of the greatest",
                  "hold it up:\n"
                  "    echo 100 | sudo tee /sys/devices/system/cpu/intel_pstate/min_perf_pct");
  }
  std::set<std::string> low;
  bool seen = false;
  for (const std::string& policy : e.tree.names(kCpuFolder + "cpufreq")) {
    const std::string folder = kCpuFolder + "cpufreq/" + policy;
    const auto least = e.tree.number(folder + "/scaling_min_freq");
    const auto most = e.tree.number(folder + "/scaling_max_freq");
    if (!least || !most) continue;
    seen = true;
    if (*least < *most)
      low.insert(policy + " from " + std::to_string(*least) + " to " + std::to_string(*most) +
                 " kHz");
  }
  if (!seen) return passed(name, "no frequency control to be seen");
  if (low.empty()) return passed(name, "as the greatest");
  return warned(
      name, joined(low),
      "hold it up:\n"
      "    for p in /sys/devices/system/cpu/cpufreq/policy*; do cat $p/scaling_max_freq | "
      "sudo tee $p/scaling_min_freq; done");
}

DoctorLine check_turbo(const Examination& e) {
  const char* const name = "turbo";
  const auto off = e.tree.number(kCpuFolder + "intel_pstate/no_turbo");
  const auto boost = e.tree.number(kCpuFolder + "cpufreq/boost");
  const bool on = off ? *off == 0 : boost.value_or(0) == 1;
  if (!on) return passed(name, off || boost ? "off" : "these processors have none");
  const std::string file = off ? "intel_pstate/no_turbo" : "cpufreq/boost";
  return warned(name, "on: the speed changes with heat and with what other cores do",
                "for equal times, slower ones, switch it off:\n    echo " +
                    std::string(off ? "1" : "0") + " | sudo tee " + kCpuFolder + file);
}

DoctorLine check_controller_power(const Examination& e) {
  const char* const name = "USB controller power";
  std::string seen, fix;
  for (const char* driver : {"xhci_hcd", "ehci-pci"}) {
    for (const std::string& device : e.tree.names(kHostDrivers + driver)) {
      if (device.find(':') == std::string::npos) continue;  // bind, unbind, module
      const std::string file = kHostDrivers + driver + "/" + device + "/power/control";
      const auto control = e.tree.text(file);
      if (!control) continue;
      seen += (seen.empty() ? "" : ", ") + device + " " + *control;
      if (*control == "auto") fix += "\n    echo on | sudo tee " + file;
    }
  }
  if (seen.empty()) return passed(name, "no controller on PCI");
  if (fix.empty()) return passed(name, seen);
  return warned(name, seen + ": it sleeps when nothing is plugged in or moves",
                "keep it awake:" + fix);
}

DoctorLine check_pcie_power(const Examination& e) {
  const char* const name = "PCIe power";
  const std::string path = "/sys/module/pcie_aspm/parameters/policy";
  const auto text = e.tree.text(path);
  if (!text) return passed(name, "this kernel does not save power on PCIe links");
  if (text->find("[performance]") != std::string::npos) return passed(name, "performance");
  return warned(name, *text + ": the link to the USB controller sleeps and wakes up late",
                "keep it awake, now or with the kernel argument pcie_aspm.policy=performance:\n"
                "    echo performance | sudo tee " +
                    path);
}

}  // namespace haptic::hal
