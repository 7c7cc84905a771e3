// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstdio>

#include "hal/realtime/doctor_checks.hpp"
#include "hal/usb/usb_text.hpp"

namespace haptic::hal {
namespace {

constexpr const char* kNames[] = {"device",        "device speed", "device rate",
                                  "device access", "autosuspend",  "link power"};

std::string hexadecimal(std::uint16_t value) {
  char text[8];
  std::snprintf(text, sizeof text, "%04x", value);
  return text;
}

std::string identity(const DoctorQuestions& q) {
  return hexadecimal(q.vendor_id) + ":" + hexadecimal(q.product_id);
}

// The device's folder below /sys/bus/usb/devices ("1-2.4": bus 1, port 2, port 4 of the hub there);
// empty: not found. `twins`: how many have its identity, with any serial number.
std::string find_device(const Examination& e, int& twins) {
  const DoctorQuestions& q = e.questions;
  std::string found;
  twins = 0;
  for (const std::string& each : e.tree.names("/sys/bus/usb/devices")) {
    const std::string folder = "/sys/bus/usb/devices/" + each;
    if (e.tree.text(folder + "/idVendor") != hexadecimal(q.vendor_id) ||
        e.tree.text(folder + "/idProduct") != hexadecimal(q.product_id))
      continue;
    twins += 1;
    const bool asked = (q.serial.empty() || e.tree.text(folder + "/serial") == q.serial) &&
                       (q.bus_path.empty() || each == q.bus_path);
    if (asked && found.empty()) found = each;
  }
  return found;
}

// The identity of what is at its place; unchanged where nothing is.
void identify(const SystemTree& tree, DoctorQuestions& q) {
  const std::string folder = "/sys/bus/usb/devices/" + q.bus_path;
  const auto number = [&](const char* file) {
    const std::string text = tree.text(folder + "/" + file).value_or("");
    std::uint16_t value = 0;
    (void)std::from_chars(text.data(), text.data() + text.size(), value, 16);
    return value;
  };
  q.vendor_id = number("idVendor");
  q.product_id = number("idProduct");
}

// "125us", "1ms" as the kernel writes an endpoint's interval; 0 for what is none.
std::int64_t interval_ns(const std::string& text) {
  std::int64_t value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(result.ptr, text.data() + text.size());
  if (result.ec != std::errc{}) return 0;
  return unit == "us" ? value * 1'000 : unit == "ms" ? value * 1'000'000 : 0;
}

// Longest polling interval of the interrupt endpoints of its interfaces; 0: it has none.
std::int64_t report_interval_ns(const SystemTree& tree, const std::string& device,
                                std::string& described) {
  std::int64_t longest_ns = 0;
  const std::string folder = "/sys/bus/usb/devices/" + device;
  for (const std::string& interface : tree.names(folder)) {
    if (!interface.starts_with(device + ":")) continue;
    const std::string endpoints = folder + "/" + interface;
    for (const std::string& endpoint : tree.names(endpoints)) {
      const auto file = [&](const char* name) {
        return tree.text(endpoints + "/" + endpoint + "/" + name).value_or("?");
      };
      if (!endpoint.starts_with("ep_") || file("type") != "Interrupt") continue;
      longest_ns = std::max(longest_ns, interval_ns(file("interval")));
      if (!described.empty()) described += ", ";
      described += endpoint;
      described += " " + file("direction") + " bInterval " + file("bInterval");
      described += " = " + file("interval");
    }
  }
  return longest_ns;
}

DoctorLine check_found(const Examination& e, const std::string& device, int twins) {
  const DoctorQuestions& q = e.questions;
  const std::string folder = "/sys/bus/usb/devices/" + device;
  if (device.empty()) {
    const std::string found = twins == 0
                                  ? "no " + identity(q) + " on any bus"
                                  : std::to_string(twins) + " of " + identity(q) + ", none" +
                                        (q.serial.empty() ? "" : " with serial " + q.serial) +
                                        (q.bus_path.empty() ? "" : " at " + q.bus_path);
    return failed(kNames[0], found,
                  "plug it in and switch it on; it must be in the list of\n    lsusb");
  }
  const std::string product = e.tree.text(folder + "/product").value_or("");
  const std::string found =
      identity(q) + (product.empty() ? "" : " \"" + product + "\"") + " at " + device;
  if (twins > 1 && q.serial.empty() && q.bus_path.empty()) {
    return warned(kNames[0], found + ", one of " + std::to_string(twins),
                  "say which, by its serial number or by its place:\n    --device " + identity(q) +
                      ":SERIAL\n    --device " + identity(q) + "@" + device);
  }
  return passed(kNames[0], found);
}

DoctorLine check_speed(const Examination& e, const std::string& device) {
  const std::string speed = e.tree.text("/sys/bus/usb/devices/" + device + "/speed").value_or("?");
  const bool low = speed == "12" || speed == "1.5";
  const std::string found =
      speed + " Mbit/s, " +
      (device.find('.') == std::string::npos ? "port of the machine itself"
                                             : "through a hub (" + device + ")");
  if (device.find('.') != std::string::npos) {
    return warned(kNames[1], found,
                  "other devices of the hub delay its reports: plug it into the machine itself");
  }
  // Full speed has a frame of one millisecond: nothing comes more often.
  if (low && e.questions.period_ns < 1'000'000) {
    return warned(kNames[1], found + ": at the most one report per millisecond",
                  "ask for --rate 1000 or less");
  }
  return passed(kNames[1], found);
}

DoctorLine check_rate(const Examination& e, const std::string& device) {
  std::string found;
  const std::int64_t interval = report_interval_ns(e.tree, device, found);
  if (interval == 0) return passed(kNames[2], "bulk transfers: the bus sets no interval");
  if (interval <= e.questions.period_ns) return passed(kNames[2], found);
  return warned(
      kNames[2], found + ": slower than the loop",
      "ask for what the device can do:\n    --rate " + std::to_string(1'000'000'000 / interval));
}

DoctorLine check_access(const Examination& e, const std::string& device) {
  const std::string folder = "/sys/bus/usb/devices/" + device;
  char node[48];
  std::snprintf(node, sizeof node, "/dev/bus/usb/%03d/%03d",
                static_cast<int>(e.tree.number(folder + "/busnum").value_or(0)),
                static_cast<int>(e.tree.number(folder + "/devnum").value_or(0)));
  const int error = e.probes.try_node(node);
  if (error == 0) return passed(kNames[3], std::string(node) + " may be read and written");
  const UsbName name{"", e.questions.vendor_id, e.questions.product_id};
  return failed(
      kNames[3], std::string(node) + ": " + errno_text(error),
      "put this line into /etc/udev/rules.d/60-haptic.rules, then plug it in again:\n    " +
          udev_rule(name) + "\n    sudo udevadm control --reload && sudo udevadm trigger");
}

DoctorLine check_autosuspend(const Examination& e, const std::string& device) {
  const std::string power = "/sys/bus/usb/devices/" + device + "/power/";
  const auto control = e.tree.text(power + "control");
  const auto delay_ms = e.tree.number(power + "autosuspend_delay_ms");
  std::string found = "power/control is " + control.value_or("absent");
  if (delay_ms) found += ", delay " + std::to_string(*delay_ms) + " ms";
  // A negative delay (usbcore.autosuspend=-1) means never.
  if (control != "auto" || delay_ms.value_or(0) < 0) return passed(kNames[4], found);
  return warned(kNames[4], found,
                "an idle device would be suspended; a line for "
                "/etc/udev/rules.d/60-haptic.rules:\n"
                "    ACTION==\"add\", SUBSYSTEM==\"usb\", ATTR{idVendor}==\"" +
                    hexadecimal(e.questions.vendor_id) + "\", ATTR{idProduct}==\"" +
                    hexadecimal(e.questions.product_id) +
                    "\", TEST==\"power/control\", ATTR{power/control}=\"on\"");
}

// USB 2 link power management: the link sleeps between reports, and each one waits for it.
DoctorLine check_link_power(const Examination& e, const std::string& device) {
  const std::string file = "/sys/bus/usb/devices/" + device + "/power/usb2_hardware_lpm";
  const auto state = e.tree.text(file);
  if (!state) return passed(kNames[5], "the device or its controller has none");
  if (*state != "enabled" && *state != "1" && *state != "y") return passed(kNames[5], "off");
  return warned(kNames[5], "USB 2 link power management is on: reports wait for the link",
                "switch it off, now or with the kernel argument usbcore.quirks=" +
                    identity(e.questions) + ":k:\n    echo 0 | sudo tee " + file);
}

}  // namespace

std::vector<DoctorLine> check_device(const Examination& asked) {
  std::vector<DoctorLine> lines;
  DoctorQuestions questions = asked.questions;
  const bool by_place = questions.vendor_id == 0 && !questions.bus_path.empty();
  if (by_place) identify(asked.tree, questions);
  const Examination e{asked.tree, asked.probes, questions};
  if (by_place && questions.vendor_id == 0) {
    lines.push_back(failed(kNames[0], "nothing at " + questions.bus_path,
                           "see where it is:\n    grep . /sys/bus/usb/devices/*/idProduct"));
    for (const char* name : kNames) {
      if (name != kNames[0])
        lines.push_back(skipped(name, "device not found", "see the line \"device\""));
    }
    return lines;
  }
  if (e.questions.vendor_id == 0) {
    for (const char* name : kNames)
      lines.push_back(
          skipped(name, "no device named", "name it: --device VID:PID[:SERIAL][@PLACE]"));
    return lines;
  }
  int twins = 0;
  const std::string device = find_device(e, twins);
  lines.push_back(check_found(e, device, twins));
  if (device.empty()) {
    for (const char* name : kNames) {
      if (name != kNames[0])
        lines.push_back(skipped(name, "device not found", "see the line \"device\""));
    }
    return lines;
  }
  lines.push_back(check_speed(e, device));
  lines.push_back(check_rate(e, device));
  lines.push_back(check_access(e, device));
  lines.push_back(check_autosuspend(e, device));
  lines.push_back(check_link_power(e, device));
  return lines;
}

}  // namespace haptic::hal
