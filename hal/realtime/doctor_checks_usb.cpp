// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

// Host controllers as /proc/interrupts names them.
constexpr std::array<std::string_view, 6> kControllers = {"xhci", "ehci", "uhci",
                                                          "ohci", "dwc2", "dwc3"};

bool names_controller(const std::string& text) {
  return std::any_of(kControllers.begin(), kControllers.end(),
                     [&](std::string_view each) { return text.find(each) != std::string::npos; });
}

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

// One interrupt of a host controller.
struct UsbInterrupt {
  std::string number;
  std::vector<int> cpus;  // that may take it
};

std::vector<UsbInterrupt> usb_interrupts(const SystemTree& tree) {
  std::vector<UsbInterrupt> found;
  std::istringstream lines(tree.text("/proc/interrupts").value_or(""));
  std::string line;
  while (std::getline(lines, line)) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || !names_controller(line)) continue;
    const std::size_t first = line.find_first_not_of(' ');
    const std::string number = line.substr(first, colon - first);
    if (!is_number(number)) continue;
    const std::string list = "/proc/irq/" + number + "/smp_affinity_list";
    found.push_back({number, parse_cpu_list(tree.text(list).value_or(""))});
  }
  return found;
}

std::string interrupts_text(const std::vector<UsbInterrupt>& interrupts) {
  std::string text;
  for (const UsbInterrupt& each : interrupts) {
    text += (text.empty() ? "" : "; ") + ("IRQ " + each.number) + " on cores " +
            cpu_list_text(each.cpus);
  }
  return text;
}

bool contains(const std::vector<int>& cpus, int cpu) {
  return std::find(cpus.begin(), cpus.end(), cpu) != cpus.end();
}

// A kernel thread that serves such an interrupt.
struct InterruptThread {
  std::string pid, name, interrupt;
  int priority = 0;  // SCHED_FIFO or SCHED_RR; 0: ordinary
};

// rt_priority is the 40th word of /proc/PID/stat; the second, in brackets, may hold blanks.
int real_time_priority(const std::string& stat) {
  constexpr int kWordsBefore = 37;  // between the bracket and rt_priority
  std::istringstream words(stat.substr(std::min(stat.rfind(')') + 1, stat.size())));
  std::string word;
  for (int i = 0; i <= kWordsBefore && words >> word; ++i) {
  }
  int priority = 0;
  std::from_chars(word.data(), word.data() + word.size(), priority);
  return words ? priority : 0;
}

std::vector<InterruptThread> interrupt_threads(const SystemTree& tree) {
  std::vector<InterruptThread> found;
  for (const std::string& pid : tree.names("/proc")) {
    if (!is_number(pid)) continue;
    // "irq/126-xhci_hcd", which the kernel cuts after 15 characters.
    const std::string name = tree.text("/proc/" + pid + "/comm").value_or("");
    if (!name.starts_with("irq/") || !names_controller(name)) continue;
    const std::string stat = tree.text("/proc/" + pid + "/stat").value_or("");
    found.push_back({pid, name, name.substr(4, name.find('-') - 4), real_time_priority(stat)});
  }
  return found;
}

// True if one of our threads of a higher priority may run on a core that the interrupt uses.
bool may_be_held_up(const Examination& e, const InterruptThread& thread,
                    const std::vector<UsbInterrupt>& interrupts) {
  const DoctorQuestions& q = e.questions;
  const auto meets = [&](std::size_t ours, int priority) {
    if (priority <= thread.priority) return false;
    if (q.cpus.empty()) return true;
    const int cpu = q.cpus[std::min(ours, q.cpus.size() - 1)];
    return std::any_of(interrupts.begin(), interrupts.end(), [&](const UsbInterrupt& each) {
      return each.number == thread.interrupt && (each.cpus.empty() || contains(each.cpus, cpu));
    });
  };
  return meets(0, q.servo_priority) || meets(1, q.usb_priority);
}

}  // namespace

DoctorLine check_usb_controller(const Examination& e) {
  const std::string name = "USB controller";
  std::string found;
  for (const std::string& each : e.tree.names("/sys/bus/usb/devices")) {
    if (!each.starts_with("usb")) continue;
    const auto speed = e.tree.text("/sys/bus/usb/devices/" + each + "/speed");
    found += (found.empty() ? "" : ", ") + each + " (" + speed.value_or("?") + " Mbit/s)";
  }
  if (!found.empty()) return passed(name, found);
  const std::string none = e.tree.has("/sys/bus/usb")
                               ? "/sys/bus/usb is there, but no host controller"
                               : "this kernel has no USB (/sys/bus/usb is absent)";
  const std::string fix =
      "load the modules; into a container or virtual machine pass the bus or the device:\n"
      "    sudo modprobe usbcore && sudo modprobe xhci_pci";
  return e.questions.vendor_id != 0 ? failed(name, none, fix) : warned(name, none, fix);
}

DoctorLine check_usb_library(const Examination& e) {
  const std::string name = "libusb";
  const UsbLibrary library = e.probes.try_usb_library();
  if (library.code == 0) return passed(name, library.version + " starts");
  const std::string found = library.version + " does not start: " + library.code_name;
  const std::string fix =
      "it needs /dev/bus/usb (and /sys); a device opened by somebody else can still be handed "
      "over as a descriptor:\n"
      "    ls -l /dev/bus/usb";
  return e.questions.vendor_id != 0 ? failed(name, found, fix) : warned(name, found, fix);
}

DoctorLine check_usb_interrupts(const Examination& e) {
  const std::string name = "USB interrupts";
  const std::vector<UsbInterrupt> interrupts = usb_interrupts(e.tree);
  if (interrupts.empty()) {
    return skipped(name, "no interrupt of a USB controller in /proc/interrupts",
                   "see the line \"USB controller\"");
  }
  const std::string found = interrupts_text(interrupts);
  const std::vector<int>& cpus = e.questions.cpus;
  if (cpus.empty()) return passed(name, found);
  // The USB thread's own core is the best place, any but the servo thread's will do.
  const int servo = cpus.front();
  const std::vector<int> online = online_cpus(e.tree);
  int other = cpus.size() > 1 ? cpus[1] : servo;
  for (const int cpu : online) {
    if (other == servo && cpu != servo) other = cpu;
  }
  std::string fix;
  for (const UsbInterrupt& each : interrupts) {
    if (!contains(each.cpus, servo)) continue;
    fix += "\n    echo " + std::to_string(other) + " | sudo tee /proc/irq/" + each.number +
           "/smp_affinity_list";
  }
  if (fix.empty() || other == servo) return passed(name, found);
  return warned(name, found + "; core " + std::to_string(servo) + " is the servo thread's",
                "send them to another core (and stop irqbalance, which would undo it):" + fix);
}

DoctorLine check_usb_interrupt_threads(const Examination& e) {
  const std::string name = "USB IRQ priority";
  const std::vector<UsbInterrupt> interrupts = usb_interrupts(e.tree);
  const std::vector<InterruptThread> threads = interrupt_threads(e.tree);
  if (interrupts.empty()) {
    return skipped(name, "no interrupt of a USB controller in /proc/interrupts",
                   "see the line \"USB controller\"");
  }
  if (threads.empty()) return passed(name, "taken in interrupt context, above every thread");
  std::string found, fix;
  const int above =
      std::min(std::max(e.questions.servo_priority, e.questions.usb_priority) + 1, 98);
  for (const InterruptThread& each : threads) {
    found += each.name + " FIFO " + std::to_string(each.priority) + "; ";
    if (may_be_held_up(e, each, interrupts))
      fix += "\n    sudo chrt -f -p " + std::to_string(above) + " " + each.pid;
  }
  found += "ours: servo " + std::to_string(e.questions.servo_priority) + ", USB " +
           std::to_string(e.questions.usb_priority);
  if (fix.empty()) return passed(name, found);
  return warned(name, found,
                "on the same core ours would hold up our own reports; raise the interrupt's "
                "thread, or tie it to a core without ours (line above):" +
                    fix);
}

}  // namespace haptic::hal
