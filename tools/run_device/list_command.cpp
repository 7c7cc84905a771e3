// SPDX-License-Identifier: Apache-2.0
// run_device list [--json]
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "hal/drivers/driver_registry.hpp"
#include "hal/drivers/serial_adapters.hpp"
#include "hal/realtime/plugged_devices.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/bridge_spawn.hpp"
#include "tools/run_device/commands.hpp"

namespace haptic::tools {
namespace {

using nlohmann::ordered_json;

struct ListOptions {
  bool json = false;
  std::string root = "/";
};

/// A device that a configuration can begin with.
struct Listed {
  const hal::DriverRow* row = nullptr;
  std::string name;     ///< for people
  std::string address;  ///< for [device]; empty: none is needed
  std::string words;
  std::string scene_hint{};         ///< what the scene has to state for this device
  std::string more{};               ///< further lines of [device]
  std::string product{}, serial{};  ///< as it states them; empty: it does not
  double latency_ms = 0;            ///< its own; 0: none, or it has not been asked
};

/// A servo bus: it is reached by the port that its configuration names, and by no other.
bool needs_port(const hal::DriverRow& row) {
  return std::ranges::any_of(row.keys,
                             [](const hal::DriverKey& key) { return key.name == "port"; });
}

std::string node_of(const hal::PluggedDevice& d) {
  return formatted("/dev/bus/usb/%03d/%03d", d.bus, d.number);
}

std::string address_of(const hal::PluggedDevice& d) {
  std::string text = formatted("%04x:%04x", d.vendor_id, d.product_id);
  if (!d.serial.empty()) return text + ":" + d.serial;
  return text + "@" + d.bus_path;
}

std::string toml_of(const Listed& listed) {
  std::string text = "scene = \"SCENE.rtscene\"    # fill in" + listed.scene_hint +
                     "\n[device]\ndriver = \"" + std::string(listed.row->name) + "\"\n";
  if (!listed.address.empty()) text += "address = \"" + listed.address + "\"\n";
  return text + listed.more;
}

/// The gate of a run would ask this of the scene of a device that a bridge has found.
std::string scene_hint_of(const BridgeAnswer& device) {
  std::string keys;
  if (device.max_stiffness_n_per_m > 0)
    keys = formatted("k_f_n_per_m in [rendering] at most %.4g", device.max_stiffness_n_per_m);
  if (device.has_force && !(device.mass_kg > 0))
    keys += std::string(keys.empty() ? "" : ", and ") +
            "a [device] with mass_kg and damping_ns_per_m, which this device does not state";
  return keys.empty() ? "" : "; its scene.toml has " + keys;
}

/// Reasons for which a device that is plugged in cannot be opened now; empty: none is known.
std::string hindrance(const hal::DriverRow& row, const std::string& node) {
  const auto holder = hal::standard_driver(row)->profile().holder;
  if (holder != nullptr && !holder().empty())
    return "spacenavd holds it: take the lines of driver spacenav";
  return access(node.c_str(), R_OK | W_OK) == 0
             ? ""
             : "this user may not open " + node + ": run_device doctor says what to do";
}

std::vector<Listed> on_usb(const std::vector<hal::PluggedDevice>& plugged,
                           const ListOptions& options) {
  std::vector<Listed> found;
  for (const hal::PluggedDevice& device : plugged) {
    for (const hal::DriverRow& row : hal::driver_rows()) {
      for (const hal::UsbIdentity& id : hal::identities_of(row)) {
        if (id.vendor_id != device.vendor_id || id.product_id != device.product_id) continue;
        const std::string name = device.product.empty() ? std::string(row.product) : device.product;
        // Another root stands for another machine, whose nodes are not here.
        const std::string words = options.root == "/" ? hindrance(row, node_of(device)) : "";
        found.push_back({&row, name + " at " + device.bus_path, address_of(device), words, "", "",
                         device.product, device.serial, 0});
      }
    }
  }
  return found;
}

/// A bridge, and why it has found nothing.
struct Absent {
  std::string bridge, why;
};

constexpr const char* kSerialPorts = "/dev/serial/by-id";

/// Lines of an arm at a serial port: nobody but its owner knows where its joints are.
Listed arm_at(const hal::DriverRow& row, const std::string& name, const std::string& port) {
  Listed arm{&row, name, "", ""};
  if (row.name == "dynamixel")
    arm.scene_hint = "; its scene.toml has a [device] with mass_kg and damping_ns_per_m of the arm";
  arm.more = "port = \"" + port +
             "\"\n"
             "urdf = \"ARM.urdf\"      # fill in: the arm's robot description\n"
             "base_link = \"BASE\"     # fill in: its link that stands still\n"
             "tip_link = \"HANDLE\"    # fill in: its link that the hand holds\n"
             "# trigger_id = 7, trigger_rad = \"OPEN CLOSED\": the servo that the hand pulls as "
             "deadman switch\n"
             "# offsets_rad, signs: where servos and joints count from other places or the other "
             "way\n";
  return arm;
}

/// Name of an adapter's port that stays the same: the first that has its serial number.
std::string port_of(const std::vector<std::string>& ports, const hal::PluggedDevice& device) {
  const auto at = std::ranges::find_if(ports, [&](const std::string& port) {
    return !device.serial.empty() && port.find(device.serial) != std::string::npos;
  });
  return at != ports.end() ? *at : std::string();
}

/// Adapters of servos. An arm is not asked: who it is stands in a description that its owner has.
/// The ports of the adapters are taken out of `ports`.
std::vector<Listed> on_servo_adapters(std::vector<std::string>& ports,
                                      const std::vector<hal::PluggedDevice>& plugged) {
  std::vector<Listed> found;
  for (const hal::PluggedDevice& device : plugged) {
    const hal::SerialAdapter* const adapter =
        hal::find_serial_adapter(device.vendor_id, device.product_id);
    const hal::DriverRow* const row =
        adapter != nullptr ? hal::find_driver(adapter->bridge) : nullptr;
    if (row == nullptr || !needs_port(*row)) continue;
    const std::string port = port_of(ports, device);
    std::erase(ports, port);
    Listed arm = arm_at(*row, std::string(adapter->name) + " at " + device.bus_path,
                        std::string(kSerialPorts) + "/" + (port.empty() ? "..." : port));
    arm.words = "an adapter; the servos behind it are asked when a session begins";
    found.push_back(std::move(arm));
  }
  return found;
}

/// An arm may be at any other serial port, by either kind of servos.
std::vector<Listed> on_other_ports(const std::vector<std::string>& ports) {
  std::vector<Listed> possible;
  for (const std::string& port : ports) {
    for (const hal::DriverRow& row : hal::driver_rows()) {
      if (row.is_bridged && needs_port(row))
        possible.push_back(arm_at(row, std::string(row.product) + ", if they are at " + port,
                                  std::string(kSerialPorts) + "/" + port));
    }
  }
  return possible;
}

std::vector<Listed> by_bridges(std::vector<Absent>& absent) {
  std::vector<Listed> found;
  for (const hal::DriverRow& row : hal::driver_rows()) {
    if (!row.is_bridged || needs_port(row)) continue;
    const BridgeAnswer answer = probe_bridge(bridge_program(), std::string(row.name));
    if (answer.found)
      found.push_back({&row, answer.name, "", answer.words, scene_hint_of(answer), "",
                       answer.product, answer.serial, answer.latency_ms});
    else
      absent.push_back({std::string(row.name), answer.why});
  }
  return found;
}

std::string indented(const std::string& text) {
  std::string shown = "    ";
  for (const char c : text) shown += c == '\n' ? std::string("\n    ") : std::string(1, c);
  while (shown.ends_with(' ')) shown.pop_back();
  return shown;
}

std::string lines_of(const Listed& listed) {
  std::string text = listed.name + ": driver " + std::string(listed.row->name) +
                     ", tested against " + std::string(listed.row->tested) + "\n";
  if (!listed.words.empty()) text += "  " + listed.words + "\n";
  if (listed.latency_ms > 0)
    text += formatted("  %g ms of latency of its own\n", listed.latency_ms);
  return text + indented(toml_of(listed));
}

std::string text_of(const std::vector<Listed>& found, const std::vector<Listed>& possible,
                    const std::vector<Absent>& absent) {
  std::string text;
  for (const Listed& listed : found) text += lines_of(listed) + "\n";
  for (const Listed& listed : possible) text += lines_of(listed) + "\n";
  if (!absent.empty()) text += "Not found:\n";
  for (const Absent& each : absent) text += "  " + each.bridge + ": " + each.why + "\n";
  if (found.empty())
    return text +
           "\nNo device was found. run_device doctor says what a device needs here; driver = "
           "\"sim\" needs none.\n";
  return text + "\n" + std::to_string(found.size()) + (found.size() == 1 ? " device" : " devices") +
         ". Put the lines of one into a file and try it: run_device run FILE\n";
}

ordered_json json_of(const std::vector<Listed>& found, const std::vector<Listed>& possible,
                     const std::vector<Absent>& absent) {
  const auto all = [](const std::vector<Listed>& devices) {
    ordered_json json = ordered_json::array();
    for (const Listed& listed : devices)
      json.push_back({{"driver", listed.row->name},
                      {"name", listed.name},
                      {"product", listed.product},
                      {"serial", listed.serial},
                      {"latency_ms", listed.latency_ms},
                      {"address", listed.address},
                      {"words", listed.words},
                      {"tested", listed.row->tested},
                      {"toml", toml_of(listed)}});
    return json;
  };
  ordered_json json{
      {"devices", all(found)}, {"possible", all(possible)}, {"absent", ordered_json::array()}};
  for (const Absent& each : absent)
    json["absent"].push_back({{"bridge", each.bridge}, {"why", each.why}});
  return json;
}

int list(const ListOptions& o) {
  const hal::SystemTree tree(o.root);
  const std::vector<hal::PluggedDevice> plugged = hal::plugged_devices(tree);
  std::vector<std::string> ports = tree.names(kSerialPorts);
  std::vector<Listed> found = on_usb(plugged, o);
  for (Listed& listed : on_servo_adapters(ports, plugged)) found.push_back(std::move(listed));
  const std::vector<Listed> possible = on_other_ports(ports);
  std::vector<Absent> absent;
  for (Listed& listed : by_bridges(absent)) found.push_back(std::move(listed));
  const std::string text =
      o.json ? json_of(found, possible, absent)
                       .dump(2, ' ', false, nlohmann::json::error_handler_t::replace) +
                   "\n"
             : text_of(found, possible, absent);
  std::fwrite(text.data(), 1, text.size(), stdout);
  return found.empty() ? kExitDeviceOrOs : kExitDone;
}

}  // namespace

Command add_list_command(CLI::App& program) {
  const auto o = std::make_shared<ListOptions>();
  CLI::App* app = program.add_subcommand(
      "list",
      "Lists the devices that are plugged in or reached by a bridge, how each was tested, and the "
      "lines of a configuration for it.");
  app->add_flag("--json", o->json,
                "as JSON: devices, arms that may be at a serial adapter, and why the other bridges "
                "found none");
  app->add_option("--root", o->root, "folder to look at instead of / for what Linux has found");
  app->footer("Exit codes: 0 done, 2 usage, 4 no device was found.");
  return {app, [o] { return list(*o); }, "run_device list"};
}

}  // namespace haptic::tools
