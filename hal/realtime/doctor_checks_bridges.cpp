// SPDX-License-Identifier: Apache-2.0
/// Devices that a bridge reaches: daemon, service, vendors' libraries, rights on what they open. A
/// device that is not there is skipped, unless it is the one that was asked for.
#include <algorithm>
#include <cerrno>
#include <cstdio>

#include "hal/drivers/driver_registry.hpp"
#include "hal/drivers/serial_adapters.hpp"
#include "hal/drivers/spacenav_socket.hpp"
#include "hal/realtime/doctor_checks.hpp"
#include "hal/realtime/plugged_devices.hpp"

namespace haptic::hal {
namespace {

constexpr const char* kRulesFix =
    "install the rules, then plug it in again:\n"
    "    run_device doctor --print 60-haptic.rules | sudo tee /etc/udev/rules.d/60-haptic.rules\n"
    "    sudo udevadm control --reload && sudo udevadm trigger";
constexpr const char* kDialoutFix =
    "join the group of serial ports, then log in again:\n    sudo usermod -aG dialout $USER";

std::string identity(const PluggedDevice& d) {
  char text[16];
  (void)std::snprintf(text, sizeof text, "%04x:%04x", d.vendor_id, d.product_id);
  return std::string(text) + " at " + d.bus_path;
}

void add(std::string& list, const std::string& text, const char* between = ", ") {
  list += (list.empty() ? "" : between) + text;
}

std::string folder_of(const PluggedDevice& d) { return "/sys/bus/usb/devices/" + d.bus_path; }

std::string node_of(const PluggedDevice& d) {
  char node[48];
  (void)std::snprintf(node, sizeof node, "/dev/bus/usb/%03d/%03d", d.bus, d.number);
  return node;
}

std::vector<PluggedDevice> plugged(const Examination& e,
                                   bool (*is_wanted)(const PluggedDevice& d)) {
  std::vector<PluggedDevice> found = plugged_devices(e.tree);
  std::erase_if(found, [&](const PluggedDevice& d) { return !is_wanted(d); });
  return found;
}

bool is_of_driver(const PluggedDevice& d, std::string_view driver) {
  const std::vector<UsbIdentity> all = identities_of(*find_driver(driver));
  return std::any_of(all.begin(), all.end(), [&](const UsbIdentity& id) {
    return id.vendor_id == d.vendor_id && id.product_id == d.product_id;
  });
}

bool is_3dconnexion(const PluggedDevice& d) { return is_of_driver(d, "spacemouse"); }
bool is_touch(const PluggedDevice& d) {
  const SerialAdapter* const adapter = find_serial_adapter(d.vendor_id, d.product_id);
  return adapter != nullptr && adapter->bridge == "openhaptics";
}
bool is_force_dimension(const PluggedDevice& d) { return d.vendor_id == kForceDimensionVendor; }

/// A serial port of a plugged device: "ttyUSB0".
struct SerialPlace {
  PluggedDevice device;
  std::string port;
};

/// Ports of USB devices: an adapter's lies in its interface, that of a CDC device in `tty` there.
std::vector<SerialPlace> serial_places(const Examination& e,
                                       bool (*is_wanted)(const PluggedDevice& d)) {
  std::vector<SerialPlace> found;
  for (const PluggedDevice& d : plugged(e, is_wanted)) {
    for (const std::string& interface : e.tree.names(folder_of(d))) {
      if (!interface.starts_with(d.bus_path + ":")) continue;
      const std::string folder = folder_of(d) + "/" + interface;
      for (const std::string& name : e.tree.names(folder))
        if (name.starts_with("ttyUSB")) found.push_back({d, name});
      for (const std::string& name : e.tree.names(folder + "/tty"))
        if (name.starts_with("ttyACM")) found.push_back({d, name});
    }
  }
  return found;
}

/// Nodes of raw HID of a plugged device: "/dev/hidraw0".
std::vector<std::string> hidraw_nodes(const Examination& e, const PluggedDevice& d) {
  std::vector<std::string> nodes;
  for (const std::string& interface : e.tree.names(folder_of(d))) {
    if (!interface.starts_with(d.bus_path + ":")) continue;
    const std::string folder = folder_of(d) + "/" + interface;
    for (const std::string& report : e.tree.names(folder)) {
      for (const std::string& name : e.tree.names(folder + "/" + report + "/hidraw"))
        nodes.push_back("/dev/" + name);
    }
  }
  return nodes;
}

/// A process of this name, as the kernel cuts it.
bool is_running(const Examination& e, const std::string& name) {
  for (const std::string& pid : e.tree.names("/proc")) {
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    if (e.tree.text("/proc/" + pid + "/comm") == name.substr(0, 15)) return true;
  }
  return false;
}

/// Nothing of the bridge's device is there.
DoctorLine absent(const Examination& e, std::string_view bridge, std::string name,
                  std::string found, std::string fix) {
  return e.questions.bridge == bridge ? failed(std::move(name), std::move(found), std::move(fix))
                                      : skipped(std::move(name), std::move(found), std::move(fix));
}

/// Rights on the nodes of devices, which those that are refused are named with.
DoctorLine nodes_line(std::string name, const Examination& e, const std::vector<std::string>& nodes,
                      const std::string& none, const char* fix) {
  std::string open, closed;
  for (const std::string& node : nodes) {
    const int error = e.probes.try_node(node);
    add(error == 0 ? open : closed, error == 0 ? node : node + ": " + errno_text(error));
  }
  if (nodes.empty()) return skipped(std::move(name), none, "plug it in, then see: lsusb");
  if (closed.empty()) return passed(std::move(name), open + " may be read and written");
  return warned(std::move(name), closed, fix);
}

/// The part of a bridge's sentence that says what helps.
std::string fix_in(const std::string& why) {
  const std::size_t at = why.rfind("; ");
  return at == std::string::npos ? why : why.substr(at + 2);
}

/// The answer of a bridge behind a vendor's library.
DoctorLine library_line(const Examination& e, const std::string& name, const std::string& bridge,
                        bool is_plugged, const std::string& install) {
  const BridgeReply reply = e.probes.try_bridge(bridge);
  if (!reply.is_asked)
    return skipped(name, "not asked", "run_device doctor asks the bridge " + bridge);
  if (reply.found && reply.needs.empty()) return passed(name, reply.name);
  if (reply.found) return warned(name, reply.name, reply.needs);
  const bool lacks_library = reply.why.find("library is not there") != std::string::npos ||
                             reply.why.find("cannot be loaded") != std::string::npos;
  const std::string fix = lacks_library ? install : fix_in(reply.why);
  if (is_plugged) return warned(name, "it is plugged in, and " + reply.why, fix);
  return absent(e, bridge, name, reply.why, fix);
}

}  // namespace

DoctorLine check_usb_rights(const Examination& e) {
  std::vector<std::string> nodes;
  std::string found;
  for (const PluggedDevice& d : plugged_devices(e.tree)) {
    for (const DriverRow& row : driver_rows()) {
      if (row.is_bridged || row.name == "spacemouse" || !is_of_driver(d, row.name)) continue;
      nodes.push_back(node_of(d));
      const std::string speed = e.tree.text(folder_of(d) + "/speed").value_or("?");
      add(found, identity(d) + " for driver " + std::string(row.name) +
                     (speed == "12" ? ", full speed: a report a millisecond at most" : ""));
    }
  }
  DoctorLine line = nodes_line("device rights", e, nodes,
                               "no device of a driver for USB is plugged in", kRulesFix);
  if (!nodes.empty()) line.found = found + "; " + line.found;
  return line;
}

DoctorLine check_spacenavd(const Examination& e) {
  const std::string name = "spacenavd";
  std::string devices;
  for (const PluggedDevice& d : plugged(e, is_3dconnexion)) add(devices, identity(d));
  std::string tried;
  for (const std::string& path :
       {e.probes.variable("SPNAV_SOCKET"),
        spacenav_path_of(e.tree.text("/etc/spnavrc").value_or("")),
        std::string("/var/run/spnav.sock"), std::string("/run/spnav.sock")}) {
    if (path.empty()) continue;
    const int error = e.probes.try_socket(path);
    if (error == 0 || error == EAGAIN) {
      if (devices.empty())
        return passed(name, "listens at " + path +
                                ", which this user may open; no device of 3Dconnexion is on USB");
      return passed(name, "listens at " + path + ", which this user may open; it holds " + devices +
                              ": driver = \"spacenav\" has it, driver = \"spacemouse\" is refused");
    }
    if (error == EACCES || error == EPERM)
      return warned(name, "listens at " + path + ", which this user may not open",
                    "the daemon opens it to all at its start; start it again, or open it by hand:\n"
                    "    sudo systemctl restart spacenavd\n    sudo chmod 0666 " +
                        path);
    add(tried, path + " (" + errno_text(error) + ")");
  }
  if (is_running(e, "spacenavd"))
    return warned(name, "it runs and listens at none of " + tried,
                  "start it again:\n    sudo systemctl restart spacenavd");
  const std::string fix =
      "install and start it; without it driver = \"spacemouse\" takes the device from every other "
      "program:\n    sudo apt-get install spacenavd\n    sudo systemctl start spacenavd";
  if (!devices.empty()) return warned(name, devices + " is plugged in, and no spacenavd runs", fix);
  return absent(e, "spacenav", name, "it does not run, and no device of 3Dconnexion is on USB",
                fix);
}

DoctorLine check_hidraw(const Examination& e) {
  std::vector<std::string> nodes;
  for (const PluggedDevice& d : plugged(e, is_3dconnexion)) {
    for (const std::string& node : hidraw_nodes(e, d)) nodes.push_back(node);
  }
  return nodes_line("browser's mouse", e, nodes,
                    "no device of 3Dconnexion is on USB, which a page opens by WebHID", kRulesFix);
}

DoctorLine check_haply(const Examination& e) {
  const std::string name = "Haply service";
  constexpr const char* kUnit = "haply-inverse-service";
  const std::string start =
      "start it, or Haply Hub:\n    sudo systemctl start " + std::string(kUnit);
  const BridgeReply reply = e.probes.try_bridge("haply");
  if (!reply.is_asked) return skipped(name, "not asked", "run_device doctor asks the bridge haply");
  if (reply.found && reply.needs.empty()) return passed(name, reply.name);
  if (reply.found) return warned(name, reply.name, reply.needs);
  if (reply.why.find("does not answer at") == std::string::npos)
    return warned(name, reply.why, fix_in(reply.why));
  const bool is_installed = e.tree.has("/lib/systemd/system/" + std::string(kUnit) + ".service") ||
                            e.tree.has("/etc/systemd/system/" + std::string(kUnit) + ".service");
  if (is_installed) return warned(name, "it is installed; " + reply.why, start);
  return absent(e, "haply", name, reply.why, "install it from haply.co; then " + start);
}

DoctorLine check_openhaptics(const Examination& e) {
  return library_line(e, "OpenHaptics", "openhaptics", !plugged(e, is_touch).empty(),
                      "install the Touch driver and OpenHaptics 3.x of 3D Systems, or name the "
                      "file: library = \"/PATH/libHD.so\"");
}

DoctorLine check_touch_port(const Examination& e) {
  std::vector<std::string> nodes;
  for (const SerialPlace& place : serial_places(e, is_touch)) nodes.push_back("/dev/" + place.port);
  return nodes_line("Touch port", e, nodes, "no 3D Systems Touch with a serial port is on USB",
                    kRulesFix);
}

DoctorLine check_touch_pairing(const Examination& e) {
  const std::string name = "GTDD_HOME";
  if (plugged(e, is_touch).empty())
    return skipped(name, "no 3D Systems Touch is on USB", "plug it in, then see: lsusb");
  const std::string home = e.probes.variable("GTDD_HOME");
  const std::string pair =
      "pair the device, in the shell in which run_device is started too:\n"
      "    export GTDD_HOME=$HOME/.3dsystems\n    Touch_Setup";
  if (home.empty()) return warned(name, "not set: libHD finds no pairing of the device", pair);
  const std::string folder = home + "/config";
  for (const std::string& file : e.tree.names(folder)) {
    if (file.ends_with(".config")) return passed(name, folder + "/" + file);
  }
  return warned(name, "no device is paired in " + folder, pair);
}

DoctorLine check_force_dimension(const Examination& e) {
  return library_line(e, "Force Dimension", "forcedimension",
                      !plugged(e, is_force_dimension).empty(),
                      "install the Force Dimension SDK 3.x, or name the file: library = "
                      "\"/PATH/libdhd.so\"");
}

DoctorLine check_force_dimension_rights(const Examination& e) {
  std::vector<std::string> nodes;
  for (const PluggedDevice& d : plugged(e, is_force_dimension)) nodes.push_back(node_of(d));
  return nodes_line("Force Dimension USB", e, nodes, "nothing of vendor 1451 is on USB", kRulesFix);
}

namespace {

bool is_servo_port(const PluggedDevice& d) { return !is_touch(d); }

}  // namespace

DoctorLine check_servo_ports(const Examination& e) {
  const std::string name = "servo ports";
  std::string open, closed;
  bool is_known = true;
  for (const SerialPlace& place : serial_places(e, is_servo_port)) {
    const SerialAdapter* const adapter =
        find_serial_adapter(place.device.vendor_id, place.device.product_id);
    const std::string node = "/dev/" + place.port;
    const int error = e.probes.try_node(node);
    const std::string what =
        node + (adapter == nullptr ? ""
                                   : ", " + std::string(adapter->name) + ", driver " +
                                         std::string(adapter->bridge));
    add(error == 0 ? open : closed, error == 0 ? what : what + ": " + errno_text(error), "; ");
    if (error != 0 && adapter == nullptr) is_known = false;
  }
  if (open.empty() && closed.empty())
    return e.questions.bridge == "dynamixel" || e.questions.bridge == "feetech"
               ? failed(name, "no serial port is on USB", "plug the adapter in, then see: lsusb")
               : skipped(name, "no serial port is on USB", "plug the adapter in, then see: lsusb");
  if (!closed.empty()) return warned(name, closed, is_known ? kRulesFix : kDialoutFix);
  std::string by_id;
  for (const std::string& each : e.tree.names("/dev/serial/by-id"))
    add(by_id, "/dev/serial/by-id/" + each);
  return passed(name, open + (by_id.empty() ? "" : "; port = " + by_id));
}

DoctorLine check_servo_latency(const Examination& e) {
  const std::string name = "servo latency";
  std::string found, fix;
  for (const SerialPlace& place : serial_places(e, is_servo_port)) {
    const std::string file = "/sys/bus/usb-serial/devices/" + place.port + "/latency_timer";
    const auto wait_ms = e.tree.number(file);
    if (!wait_ms) continue;
    add(found, place.port + ": " + std::to_string(*wait_ms) + " ms");
    if (*wait_ms > 1) fix += "\n    echo 1 | sudo tee " + file;
  }
  if (found.empty())
    return skipped(name, "no port has a latency timer", "none needed: FTDI adapters alone do");
  if (fix.empty()) return passed(name, found);
  return warned(name, found,
                "the adapter holds answers back for so long; now, or at each start by the rules of "
                "60-haptic.rules:" +
                    fix);
}

DoctorLine check_modem_manager(const Examination& e) {
  const std::string name = "ModemManager";
  const std::vector<SerialPlace> places =
      serial_places(e, [](const PluggedDevice&) { return true; });
  if (places.empty())
    return skipped(name, "no serial port is on USB", "plug the adapter in, then see: lsusb");
  if (!is_running(e, "ModemManager") &&
      !e.tree.has("/run/systemd/units/invocation:ModemManager.service"))
    return passed(name, "it does not run");
  std::string held;
  for (const SerialPlace& place : places) {
    // udev keeps what its rules have set of a USB device under the number of its node.
    const int number = 128 * (place.device.bus - 1) + place.device.number - 1;
    const std::string kept =
        e.tree.text("/run/udev/data/c189:" + std::to_string(number)).value_or("");
    if (kept.find("E:ID_MM_DEVICE_IGNORE=1") == std::string::npos) add(held, place.port);
  }
  if (held.empty()) return passed(name, "it runs, and leaves these ports alone");
  return warned(name, "it writes to " + held + " for some seconds after it was plugged in",
                std::string("stop it, or for the known adapters ") + kRulesFix +
                    "\n    sudo systemctl disable --now ModemManager");
}

}  // namespace haptic::hal
