// SPDX-License-Identifier: Apache-2.0
#include "tests/support/fake_machine.hpp"

#include <fstream>

namespace haptic::test {
namespace {

const char kInterrupts[] =
    "           CPU0       CPU1       CPU2       CPU3\n"
    "  8:          0          1          0          0   IO-APIC   8-edge      rtc0\n"
    "126:      91021          0          0          0   PCI-MSI 327680-edge      xhci_hcd\n"
    "127:          3          0          0          0   PCI-MSI 376832-edge      nvme0q0\n"
    "NMI:          0          0          0          0   Non-maskable interrupts\n";

// Word 40 is rt_priority (50), word 41 the policy (1: FIFO).
const char kInterruptThread[] =
    "77 (irq/126-xhci_hc) S 2 0 0 0 -1 2129984 0 0 0 0 0 12 0 0 -51 0 1 0 31 0 0 "
    "18446744073709551615 0 0 0 0 0 0 0 2147483647 0 0 0 0 17 0 50 1 0 0 0";

const char kLimits[] =
    "Limit                     Soft Limit           Hard Limit           Units\n"
    "Max locked memory         unlimited            unlimited            bytes\n"
    "Max realtime priority     95                   95\n";

}  // namespace

FakeProbes::FakeProbes() {
  answer.priority = 80;
  answer.cpu = 3;
  answer.memory_locked = answer.idle_states_held = true;
  for (int i = 0; i < 2000; ++i) answer.lateness.add(3'000 + 10 * (i % 500));
}

FakeMachine::FakeMachine() : folder_("fake_machine") {
  questions.vendor_id = 0x1209;
  questions.product_id = 0x0001;
  questions.cpus = {3, 2};
  write("/sys/kernel/realtime", "1\n");
  write("/proc/sys/kernel/osrelease", "6.1.0-rt\n");
  write("/proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian\n");
  write("/proc/self/limits", kLimits);
  write("/proc/self/status",
        "Name:\trun_device\nCapEff:\t0000000000000000\nCpus_allowed_list:\t0-1\n");
  write("/proc/swaps", "Filename\t\tType\t\tSize\t\tUsed\t\tPriority\n");
  write("/proc/sys/kernel/sched_rt_runtime_us", "-1\n");
  write("/proc/sys/kernel/sched_rt_period_us", "1000000\n");
  write("/proc/sys/kernel/nmi_watchdog", "0\n");
  write("/proc/sys/kernel/watchdog_cpumask", "0-3\n");
  write("/proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu tsc constant_tsc nonstop_tsc\n");
  write("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  const std::string cpus = "/sys/devices/system/cpu/";
  write(cpus + "online", "0-3\n");
  write(cpus + "isolated", "2-3\n");
  write(cpus + "nohz_full", "2-3\n");
  write(cpus + "smt/active", "0\n");
  for (const char* cpu : {"0", "1", "2", "3"}) {
    write(cpus + "cpu" + cpu + "/topology/thread_siblings_list", std::string(cpu) + "\n");
    write(cpus + "cpufreq/policy" + cpu + "/scaling_governor", "performance\n");
  }
  for (const char* cpu : {"0", "1", "2", "3"}) {
    const std::string policy = cpus + "cpufreq/policy" + cpu + "/";
    write(policy + "energy_performance_preference", "performance\n");
    write(cpus + "cpu" + cpu + "/power/energy_perf_bias", "0\n");
    write(std::string("/sys/devices/system/machinecheck/machinecheck") + cpu + "/check_interval",
          "0\n");
    write(std::string("/sys/kernel/debug/sched/fair_server/cpu") + cpu + "/runtime", "0\n");
  }
  write(cpus + "intel_pstate/min_perf_pct", "100\n");
  write(cpus + "intel_pstate/no_turbo", "1\n");
  write("/proc/cmdline", "root=/dev/nvme0n1p2 skew_tick=1 quiet\n");
  write("/proc/self/cgroup", "0::/user.slice\n");
  write("/proc/sys/kernel/timer_migration", "0\n");
  write("/proc/sys/kernel/hung_task_timeout_secs", "0\n");
  write("/proc/sys/kernel/soft_watchdog", "0\n");
  write("/proc/sys/kernel/numa_balancing", "0\n");
  write("/proc/sys/vm/stat_interval", "10\n");
  write("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n");
  write("/sys/kernel/mm/ksm/run", "0\n");
  write("/sys/devices/virtual/workqueue/cpumask", "3\n");
  write("/sys/devices/virtual/workqueue/writeback/cpumask", "3\n");
  write("/sys/kernel/tracing/current_tracer", "nop\n");
  write("/sys/kernel/tracing/events/enable", "0\n");
  write("/boot/config-6.1.0-rt", "CONFIG_PREEMPT_RT=y\nCONFIG_SLUB_DEBUG=y\n");
  write("/sys/fs/cgroup/cgroup.controllers", "cpuset cpu memory\n");
  write("/sys/bus/pci/drivers/xhci_hcd/0000:00:14.0/power/control", "on\n");
  write("/sys/module/pcie_aspm/parameters/policy", "default [performance] powersave\n");
  write("/proc/irq/default_smp_affinity", "3\n");
  write("/proc/interrupts", kInterrupts);
  write("/proc/irq/126/smp_affinity_list", "0-1\n");
  write("/proc/77/comm", "irq/126-xhci_hc\n");
  write("/proc/77/stat", kInterruptThread);
  const std::string usb = "/sys/bus/usb/devices/";
  write(usb + "usb1/speed", "480\n");
  write(usb + "1-2/idVendor", "1209\n");
  write(usb + "1-2/idProduct", "0001\n");
  write(usb + "1-2/serial", "A1\n");
  write(usb + "1-2/product", "Reference 6-DOF\n");
  write(usb + "1-2/speed", "480\n");
  write(usb + "1-2/busnum", "1\n");
  write(usb + "1-2/devnum", "4\n");
  write(usb + "1-2/power/control", "on\n");
  write(usb + "1-2/power/autosuspend_delay_ms", "2000\n");
  write(usb + "1-2/power/usb2_hardware_lpm", "disabled\n");
  write(usb + "1-2/1-2:1.0/ep_81/type", "Interrupt\n");
  write(usb + "1-2/1-2:1.0/ep_81/direction", "in\n");
  write(usb + "1-2/1-2:1.0/ep_81/bInterval", "01\n");
  write(usb + "1-2/1-2:1.0/ep_81/interval", "125us\n");
  plug_bridged();
}

/// A device of each bridge, all of them as they should be.
void FakeMachine::plug_bridged() {
  const std::string usb = "/sys/bus/usb/devices/";
  const auto plug = [&](const std::string& place, const char* vendor, const char* product) {
    write(usb + place + "/idVendor", std::string(vendor) + "\n");
    write(usb + place + "/idProduct", std::string(product) + "\n");
    write(usb + place + "/busnum", "1\n");
    write(usb + place + "/devnum", std::to_string(place.back() - '0' + 2) + "\n");
  };
  plug("1-3", "256f", "c635");
  write(usb + "1-3/1-3:1.0/0003:256F:C635.0001/hidraw/hidraw0/dev", "244:0\n");
  plug("1-4", "1451", "0402");
  plug("1-5", "0301", "2988");
  write(usb + "1-5/1-5:1.0/tty/ttyACM0/dev", "166:0\n");
  plug("1-6", "0403", "6014");
  write(usb + "1-6/1-6:1.0/ttyUSB0/port_number", "0\n");
  write("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1\n");
  write("/dev/serial/by-id/usb-FTDI_Serial_FT1-if00-port0", "");
  write("/home/anna/.3dsystems/config/Default Device.config", "");
  write("/proc/55/comm", "spacenavd\n");
  probes.sockets["/run/spnav.sock"] = 0;
  probes.variables["GTDD_HOME"] = "/home/anna/.3dsystems";
  probes.bridges["haply"] = {true, true, "Inverse3, serial 049D, service 3.5.0.0", "", ""};
  probes.bridges["openhaptics"] = {true, true, "Touch, serial 1, HDAPI 3.4.0", "", ""};
  probes.bridges["forcedimension"] = {true, true, "omega.6, serial 2, SDK 3.17.6", "", ""};
}

void FakeMachine::write(const std::string& path, const std::string& text) const {
  const std::filesystem::path file = folder_.file(path.substr(1));
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

void FakeMachine::remove(const std::string& path) const {
  std::filesystem::remove_all(folder_.file(path.substr(1)));
}

std::vector<hal::DoctorLine> FakeMachine::examine() {
  return hal::examine(hal::SystemTree(folder_.file("")), probes, questions);
}

hal::DoctorLine FakeMachine::line(const std::string& name) {
  for (hal::DoctorLine& each : examine()) {
    if (each.name == name) return each;
  }
  return {};
}

}  // namespace haptic::test
