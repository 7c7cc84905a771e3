// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cerrno>
#include <set>

#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/polhem_driver.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/spacemouse_models.hpp"
#include "hal/realtime/deploy_text.hpp"
#include "hal/usb/usb_text.hpp"
#include "tests/support/fake_machine.hpp"

using namespace haptic::hal;
using haptic::test::FakeMachine;

namespace {

const std::string kUsb = "/sys/bus/usb/devices/";
const std::string kCpus = "/sys/devices/system/cpu/";
const std::string kRule =
    "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"1209\", ATTR{idProduct}==\"0001\", MODE=\"0660\", "
    "TAG+=\"uaccess\"";

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// One change of the healthy machine, and what its line must say then.
struct Case {
  const char* what;
  const char* line;
  DoctorLevel level;
  bool refuses;
  void (*change)(FakeMachine& m);
  std::vector<std::string> found, mend;
};

constexpr auto kPass = DoctorLevel::kPass, kWarning = DoctorLevel::kWarning,
               kFailure = DoctorLevel::kFailure, kSkipped = DoctorLevel::kSkipped;

void check_case(const Case& c) {
  CAPTURE(c.what);
  FakeMachine machine;
  REQUIRE(machine.line(c.line).level == kPass);
  c.change(machine);
  const DoctorLine line = machine.line(c.line);
  CHECK(line.level == c.level);
  CHECK(line.refuses_in_strict == c.refuses);
  for (const std::string& word : c.found) {
    CAPTURE(line.found);
    CHECK(has(line.found, word));
  }
  for (const std::string& word : c.mend) {
    CAPTURE(line.mend);
    CHECK(has(line.mend, word));
  }
  const bool fit = c.level != kFailure, fit_in_strict = fit && !c.refuses;
  CHECK(is_fit({line}, false) == fit);
  CHECK(is_fit({line}, true) == fit_in_strict);
}

const Case kKernelCases[] = {
    {"no PREEMPT_RT",
     "PREEMPT_RT",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.remove("/sys/kernel/realtime");
       m.write("/proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n");
     },
     {"6.1.0-rt", "no /sys/kernel/realtime"},
     {"linux-image-rt-amd64"}},
    {"real-time switched off",
     "PREEMPT_RT",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.write("/sys/kernel/realtime", "0\n");
       m.remove("/proc/sys/kernel/version");
     },
     {"reads 0"},
     {"linux-image-rt-amd64"}},
    {"only the version says so",
     "PREEMPT_RT",
     kPass,
     false,
     [](FakeMachine& m) { m.remove("/sys/kernel/realtime"); },
     {"has it"},
     {"none needed"}},
    {"no right to SCHED_FIFO",
     "SCHED_FIFO",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.probes.fifo_error = EPERM;
       m.write("/proc/self/limits", "Max realtime priority     0                    0\n");
     },
     {"priority 80", "EPERM", "RLIMIT_RTPRIO 0", "no CAP_SYS_NICE"},
     {"@realtime - rtprio 95", "usermod -aG realtime"}},
    {"SCHED_FIFO refused in spite of the right",
     "SCHED_FIFO",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.fifo_error = EPERM; },
     {"RLIMIT_RTPRIO 95"},
     {"--cap-add=SYS_NICE"}},
    {"no such priority",
     "SCHED_FIFO",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.fifo_error = EINVAL; },
     {"EINVAL"},
     {"1 to 99"}},
    {"a capability in the limit's place",
     "SCHED_FIFO",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/proc/self/status", "CapEff:\t0000000000800000\n");
       m.write("/proc/self/limits", "Max realtime priority     0                    0\n");
     },
     {"CAP_SYS_NICE held"},
     {}},
    {"no right to lock memory",
     "memory lock",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.memory_error = ENOMEM; },
     {"ENOMEM"},
     {"@realtime - memlock unlimited", "run_device doctor --print haptic-limits.conf"}},
    {"little memory may be locked",
     "memory lock",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.write("/proc/self/limits", "Max locked memory         8388608     8388608     bytes\n");
     },
     {"8388608 bytes", "later"},
     {"memlock unlimited"}},
    {"a small limit that a capability lifts",
     "memory lock",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/proc/self/status", "CapEff:\t0000000000004000\n");
       m.write("/proc/self/limits", "Max locked memory         8388608     8388608     bytes\n");
     },
     {"CAP_IPC_LOCK held"},
     {}},
    {"swap on",
     "swap",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write("/proc/swaps", "Filename Type Size\n/dev/nvme0n1p3   partition 999\n");
     },
     {"/dev/nvme0n1p3"},
     {"swapoff -a"}},
    {"throttling as it comes",
     "RT throttling",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/sys/kernel/sched_rt_runtime_us", "950000\n"); },
     {"950000 of every 1000000"},
     {"sched_rt_runtime_us=-1"}},
    {"throttling unknown",
     "RT throttling",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove("/proc/sys/kernel/sched_rt_period_us"); },
     {},
     {}},
    {"watchdog interrupts",
     "kernel watchdog",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/sys/kernel/nmi_watchdog", "1\n"); },
     {"cores 0-3"},
     {"kernel.nmi_watchdog=0"}},
    {"a hypervisor",
     "virtual machine",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/cpuinfo", "flags\t\t: fpu hypervisor tsc\n"); },
     {"hypervisor"},
     {"wake-ups"}},
};

const Case kCoreCases[] = {
    {"another clock",
     "clock",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
     },
     {"hpet"},
     {"clocksource=tsc"}},
    {"a counter that stops",
     "clock",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/cpuinfo", "flags\t\t: fpu constant_tsc tsc\n"); },
     {"lacks nonstop_tsc"},
     {}},
    {"one core",
     "cores",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "online", "0\n"); },
     {"1 core, 1 processors"},
     {"two cores"}},
    {"both threads on one core",
     "cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kCpus + "cpu2/topology/thread_siblings_list", "2-3\n");
       m.write(kCpus + "cpu3/topology/thread_siblings_list", "2-3\n");
     },
     {"share the core of 3,2"},
     {"--cpu N,M"}},
    {"SMT on",
     "SMT",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "smt/active", "1\n"); },
     {"on"},
     {"smt/control"}},
    {"nothing isolated",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kCpus + "isolated", "\n");
       m.remove(kCpus + "nohz_full");
     },
     {"isolated: none"},
     {"isolcpus=managed_irq,domain,2-3 nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1"}},
    {"other cores isolated",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.questions.cpus = {1, 0};
     },
     {"isolated: 2-3"},
     {"isolcpus=managed_irq,domain,0-1", "irqaffinity=2-3"}},
    {"ticks on the isolated cores",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "nohz_full", "(null)\n"); },
     {"nohz_full: none"},
     {"nohz_full=2-3"}},
    {"no core left for the system",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kCpus + "online", "2-3\n");
       m.write(kCpus + "isolated", "\n");
     },
     {"all 2"},
     {"name fewer"}},
    {"a core refused",
     "affinity",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.cpu_error = EINVAL; },
     {"core 3 refused", "online: 0-3"},
     {"--cpu N,M"}},
    {"isolated cores left unused",
     "affinity",
     kWarning,
     false,
     [](FakeMachine& m) { m.questions.cpus.clear(); },
     {"2-3"},
     {"--cpu 2,3"}},
    {"a saving governor",
     "governor",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "cpufreq/policy2/scaling_governor", "powersave\n"); },
     {"powersave"},
     {"echo performance"}},
    {"no frequency control",
     "governor",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove(kCpus + "cpufreq"); },
     {},
     {}},
    {"idle states not to be held",
     "idle states",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.idle_error = EACCES; },
     {"EACCES"},
     {"KERNEL==\"cpu_dma_latency\""}},
    {"no idle states file",
     "idle states",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.idle_error = ENOENT; },
     {"ENOENT"},
     {"processor.max_cstate=1"}},
};

const Case kUsbCases[] = {
    {"no USB",
     "USB controller",
     kFailure,
     true,
     [](FakeMachine& m) { m.remove("/sys/bus/usb"); },
     {"/sys/bus/usb is absent"},
     {"modprobe xhci_pci"}},
    {"no USB and no device asked for",
     "USB controller",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.remove(kUsb + "usb1");
       m.questions.vendor_id = 0;
     },
     {"no host controller"},
     {"modprobe xhci_pci"}},
    {"libusb does not start",
     "libusb",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.probes.library = {-99, "LIBUSB_ERROR_OTHER", "1.0.26"};
     },
     {"LIBUSB_ERROR_OTHER"},
     {"/dev/bus/usb"}},
    {"interrupts on the servo core",
     "USB interrupts",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/irq/126/smp_affinity_list", "0-3\n"); },
     {"IRQ 126 on cores 0-3", "core 3 is the servo"},
     {"echo 2 | sudo tee /proc/irq/126/smp_affinity_list"}},
    {"no USB interrupt",
     "USB interrupts",
     kSkipped,
     false,
     [](FakeMachine& m) { m.write("/proc/interrupts", "NMI: 0 Non-maskable interrupts\n"); },
     {},
     {}},
    {"our USB thread above the interrupt's on its core",
     "USB IRQ priority",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/irq/126/smp_affinity_list", "2\n"); },
     {"FIFO 50", "servo 80, USB 79"},
     {"sudo chrt -f -p 81 77"}},
    {"threads tied to no core",
     "USB IRQ priority",
     kWarning,
     false,
     [](FakeMachine& m) { m.questions.cpus.clear(); },
     {"FIFO 50"},
     {"sudo chrt -f -p 81 77"}},
    {"ours below the interrupt's",
     "USB IRQ priority",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/proc/irq/126/smp_affinity_list", "2\n");
       m.questions.servo_priority = 40;
       m.questions.usb_priority = 39;
     },
     {"FIFO 50", "servo 40"},
     {}},
    {"no interrupt threads",
     "USB IRQ priority",
     kPass,
     false,
     [](FakeMachine& m) { m.remove("/proc/77"); },
     {"interrupt context"},
     {}},
    {"no interrupts to have threads",
     "USB IRQ priority",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove("/proc/interrupts"); },
     {},
     {}},
    {"not plugged in",
     "device",
     kFailure,
     true,
     [](FakeMachine& m) { m.remove(kUsb + "1-2"); },
     {"no 1209:0001 on any bus"},
     {"lsusb"}},
    {"another serial number",
     "device",
     kFailure,
     true,
     [](FakeMachine& m) { m.questions.serial = "B2"; },
     {"1 of 1209:0001, none with serial B2"},
     {}},
    {"its serial number",
     "device",
     kPass,
     false,
     [](FakeMachine& m) { m.questions.serial = "A1"; },
     {"at 1-2", "Reference 6-DOF"},
     {}},
    {"two of them",
     "device",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kUsb + "1-3/idVendor", "1209\n");
       m.write(kUsb + "1-3/idProduct", "0001\n");
     },
     {"one of 2"},
     {"--device 1209:0001:SERIAL"}},
    {"behind a hub",
     "device speed",
     kWarning,
     false,
     [](FakeMachine& m) {
       for (const char* file : {"idVendor", "idProduct"})
         m.write(kUsb + "1-1.4/" + file, file[2] == 'V' ? "1209\n" : "0001\n");
       m.write(kUsb + "1-1.4/speed", "480\n");
     },
     {"through a hub (1-1.4)"},
     {"machine itself"}},
    {"full speed for a loop of 2 kHz",
     "device speed",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kUsb + "1-2/speed", "12\n");
       m.questions.period_ns = 500'000;
     },
     {"12 Mbit/s"},
     {"--rate 1000"}},
    {"full speed for a loop of 1 kHz",
     "device speed",
     kPass,
     false,
     [](FakeMachine& m) { m.write(kUsb + "1-2/speed", "12\n"); },
     {"12 Mbit/s"},
     {}},
    {"reports every 8 ms",
     "device rate",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kUsb + "1-2/1-2:1.0/ep_81/interval", "8ms\n"); },
     {"ep_81 in bInterval 01 = 8ms"},
     {"--rate 125"}},
    {"bulk transfers",
     "device rate",
     kPass,
     false,
     [](FakeMachine& m) { m.write(kUsb + "1-2/1-2:1.0/ep_81/type", "Bulk\n"); },
     {"bulk"},
     {}},
    {"no right to open it",
     "device access",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.node_error = EACCES; },
     {"/dev/bus/usb/001/004", "EACCES"},
     {"    " + kRule + "\n", "/etc/udev/rules.d/60-haptic.rules"}},
    {"device absent, nothing to open",
     "device access",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove(kUsb + "1-2"); },
     {},
     {}},
    {"it may be suspended",
     "autosuspend",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kUsb + "1-2/power/control", "auto\n"); },
     {"auto", "2000 ms"},
     {"ATTR{idVendor}==\"1209\", ATTR{idProduct}==\"0001\"", "ATTR{power/control}=\"on\""}},
    {"suspended never",
     "autosuspend",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write(kUsb + "1-2/power/control", "auto\n");
       m.write(kUsb + "1-2/power/autosuspend_delay_ms", "-1000\n");
     },
     {"-1000 ms"},
     {}},
};

const Case kMeasuredCases[] = {
    {"one late wake-up",
     "wake-ups",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.probes.answer.lateness.add(1'200'000);
       m.probes.answer.late_ticks = 1;
       m.probes.answer.missed_periods = 1;
     },
     {"p50 6, p99 8, p99.9 8, largest 1200 us", "1 of 2001 ticks", "SCHED_FIFO 80 on core 3",
      "limit 250 us"},
     {"PREEMPT_RT", "hwlatdetect"}},
    {"a limit of one's own",
     "wake-ups",
     kWarning,
     true,
     [](FakeMachine& m) { m.questions.wakeup_limit_ns = 5'000; },
     {"limit 5 us"},
     {}},
    {"no thread to measure with",
     "wake-ups",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.answer.error = EAGAIN; },
     {"EAGAIN"},
     {}},
    {"not measured",
     "wake-ups",
     kSkipped,
     false,
     [](FakeMachine& m) { m.questions.measure = false; },
     {},
     {"--no-measure"}},
    {"minor page faults",
     "page faults",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.probes.answer.faults = {3, 0};
     },
     {"3 minor, 0 major"},
     {"memory lock"}},
    {"major page faults",
     "page faults",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.probes.answer.faults = {3, 1};
     },
     {"1 major"},
     {"memory lock"}},
};

}  // namespace

TEST_SUITE("hal.doctor") {
  TEST_CASE("examine: a healthy machine passes every line, and asks for what the loop will be") {
    FakeMachine machine;
    machine.questions.period_ns = 250'000;
    const std::vector<DoctorLine> lines = machine.examine();
    CHECK(lines.size() == 25);
    std::set<std::string> names;
    for (const DoctorLine& line : lines) {
      CAPTURE(line.name);
      CAPTURE(line.found);
      CHECK(line.level == kPass);
      CHECK_FALSE(line.found.empty());
      CHECK(line.mend == "none needed");
      names.insert(line.name);
    }
    CHECK(names.size() == lines.size());
    CHECK(is_fit(lines, true));
    CHECK(machine.probes.last_priority == 80);
    CHECK(machine.probes.last_node == "/dev/bus/usb/001/004");
    CHECK(machine.probes.measured == 1);
    CHECK(machine.probes.last_question.period_ns == 250'000);
    CHECK(machine.probes.last_question.cpu == 3);
    CHECK(machine.probes.last_question.priority == 80);
  }

  TEST_CASE("kernel: each defect is seen, with its mend") {
    for (const Case& c : kKernelCases) check_case(c);
  }
  TEST_CASE("cores: each defect is seen, with its mend") {
    for (const Case& c : kCoreCases) check_case(c);
  }
  TEST_CASE("USB: each defect is seen, with its mend") {
    for (const Case& c : kUsbCases) check_case(c);
  }
  TEST_CASE("measured: each defect is seen, with its mend") {
    for (const Case& c : kMeasuredCases) check_case(c);
  }

  TEST_CASE("every line has a case in which it does not pass") {
    std::set<std::string> seen;
    const auto note = [&](const auto& cases) {
      for (const Case& c : cases) {
        if (c.level == kWarning || c.level == kFailure) seen.insert(c.line);
      }
    };
    note(kKernelCases);
    note(kCoreCases);
    note(kUsbCases);
    note(kMeasuredCases);
    FakeMachine machine;
    for (const DoctorLine& line : machine.examine()) {
      CAPTURE(line.name);
      CHECK(seen.count(line.name) == 1);
    }
  }

  TEST_CASE("examine: an empty tree gives the same lines, none without found and mend") {
    FakeMachine machine;
    std::vector<std::string> names;
    for (const DoctorLine& line : machine.examine()) names.push_back(line.name);
    machine.remove("/sys");
    machine.remove("/proc");
    std::size_t i = 0;
    for (const DoctorLine& line : machine.examine()) {
      REQUIRE(i < names.size());
      CHECK(line.name == names[i++]);
      CHECK_FALSE(line.found.empty());
      CHECK_FALSE(line.mend.empty());
    }
    CHECK(i == names.size());
  }
}

TEST_SUITE("hal.deploy_text") {
  TEST_CASE("deploy_text: byte for byte the files of the source tree") {
    const std::string folder = std::string(HAPTIC_TEST_DIR) + "/../hal/realtime/deploy/";
    CHECK(deploy_files().size() == 3);
    for (const DeployFile& file : deploy_files()) {
      CAPTURE(std::string(file.name));
      const std::string text = haptic::sim::test::text_of_file(folder + std::string(file.name));
      CHECK_FALSE(text.empty());
      CHECK(std::string(file.text) == text);
      CHECK(deploy_text(file.name) == file.text);
    }
    CHECK(deploy_text("60-haptic").empty());
  }

  TEST_CASE("60-haptic.rules: every identity of a driver, and no more") {
    const std::string rules(deploy_text("60-haptic.rules"));
    std::vector<UsbName> names;
    const auto add = [&](const UsbProfile& p) {
      names.push_back({p.name, p.vendor_id, p.product_id});
    };
    add(ReferenceDriver().profile());
    add(FalconDriver(FalconSettings{}).profile());
    add(PolhemDriver().profile());
    for (const SpaceMouseModel& m : spacemouse_models())
      names.push_back({"", m.vendor_id, m.product_id});
    for (const UsbName& name : names) {
      CAPTURE(udev_rule(name));
      CHECK(has(rules, "\n" + udev_rule(name) + "\n"));
    }
    std::size_t count = 0;
    for (std::size_t at = rules.find("uaccess\"\n"); at != std::string::npos;
         at = rules.find("uaccess\"\n", at + 1))
      count += 1;
    CHECK(count == names.size());
  }

  TEST_CASE("haptic-limits.conf: the lines that the doctor names") {
    FakeMachine machine;
    machine.probes.memory_error = ENOMEM;
    const std::string limits(deploy_text("haptic-limits.conf"));
    const std::string mend = machine.line("memory lock").mend;
    for (const char* line : {"@realtime - rtprio 95", "@realtime - memlock unlimited"}) {
      CHECK(has(limits, std::string("\n") + line + "\n"));
      CHECK(has(mend, std::string("    ") + line));
    }
  }
}

TEST_SUITE("hal.system_tree") {
  TEST_CASE("parse_cpu_list: ranges, single ones, and text that is none") {
    CHECK(parse_cpu_list("0-2,5\n") == std::vector<int>{0, 1, 2, 5});
    CHECK(parse_cpu_list("7") == std::vector<int>{7});
    for (const char* text : {"", "(null)", "1-", "-1", "a", "1,,2", "0-99999999", "3-x"}) {
      CAPTURE(text);
      CHECK(parse_cpu_list(text).empty());
    }
    CHECK(cpu_list_text({5, 0, 1, 2}) == "0-2,5");
    CHECK(cpu_list_text({}) == "none");
  }

  TEST_CASE("value_after and has_word: whole keys at line starts, whole words") {
    CHECK(value_after("a: 1\nab:\t 2 \n", "ab:") == "2");
    CHECK(value_after("x ab: 2\n", "ab:").empty());
    CHECK(has_word("constant_tsc tsc", "tsc"));
    CHECK_FALSE(has_word("constant_tsc", "tsc"));
  }
}
