// SPDX-License-Identifier: Apache-2.0
#include "tests/hal/doctor_cases.hpp"

#include <cerrno>

namespace haptic::test {
namespace {

const std::string kUsb = "/sys/bus/usb/devices/";
const std::string kRule =
    "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"1209\", ATTR{idProduct}==\"0001\", MODE=\"0660\", "
    "TAG+=\"uaccess\"";

const DoctorCase kUsbCases[] = {
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
    {"its place on the bus alone",
     "device",
     kPass,
     false,
     [](FakeMachine& m) {
       m.questions.vendor_id = m.questions.product_id = 0;
       m.questions.bus_path = "1-2";
     },
     {"1209:0001", "at 1-2"},
     {}},
    {"nothing at that place",
     "device",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.questions.vendor_id = m.questions.product_id = 0;
       m.questions.bus_path = "1-9";
     },
     {"nothing at 1-9"},
     {}},
    {"it is at another place",
     "device",
     kFailure,
     true,
     [](FakeMachine& m) { m.questions.bus_path = "1-9"; },
     {"1 of 1209:0001, none at 1-9"},
     {}},
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
    {"the link sleeps between reports",
     "link power",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kUsb + "1-2/power/usb2_hardware_lpm", "enabled\n"); },
     {"link power management is on"},
     {"usbcore.quirks=1209:0001:k", "echo 0 | sudo tee " + kUsb + "1-2/power/usb2_hardware_lpm"}},
    {"no link power management",
     "link power",
     kPass,
     false,
     [](FakeMachine& m) { m.remove(kUsb + "1-2/power/usb2_hardware_lpm"); },
     {"has none"},
     {}},
};

const DoctorCase kMeasuredCases[] = {
    {"somebody is late",
     "late by",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.answer.lateness.add(1'200'000); },
     {"not asked"},
     {"sudo run_device doctor --culprit", "sudo rtla timerlat top -q -d 30s -T 250 -s 250 -c 3"}},
    {"somebody is late, and nobody to say who",
     "late by",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.probes.answer.lateness.add(1'200'000);
       m.probes.program = "";
     },
     {"rtla", "not installed"},
     {"apt-get install rtla"}},
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

std::span<const DoctorCase> usb_cases() { return kUsbCases; }
std::span<const DoctorCase> measured_cases() { return kMeasuredCases; }

}  // namespace haptic::test
