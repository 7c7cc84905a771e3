// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/device_config.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>

#include "hal/device_limits.hpp"
#include "hal/drivers/driver_registry.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/toml_file.hpp"
#include "tools/common/toml_table.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kLargestFileBytes = std::size_t{1} << 20;
constexpr const char* kSimulated = "sim";
constexpr std::string_view kSocketPrefix = "unix:";
constexpr Range kRate_hz{50.0, 10'000.0};
constexpr Range kScale{1e-3, 1e3};
constexpr Range kOffset_m{-1e3, 1e3};
constexpr Range kFlight_s{0.1, 60.0};
constexpr Range kRampIn_s{0.0, 10.0};
constexpr Range kHandleOffset_m{-1.0, 1.0};

std::int64_t integer_in(const TomlTable& t, std::string_view key, std::int64_t low,
                        std::int64_t high, std::int64_t otherwise) {
  const std::int64_t value = t.integer(key).value_or(otherwise);
  if (value != otherwise && (value < low || value > high))
    t.fail(key, "is " + std::to_string(value) + "; give an integer from " + std::to_string(low) +
                    " to " + std::to_string(high));
  return value;
}

bool has_key(const hal::DriverRow* row, std::string_view name) {
  return row != nullptr && std::any_of(row->keys.begin(), row->keys.end(),
                                       [&](const hal::DriverKey& key) { return key.name == name; });
}

/// "driver 'a'", "driver 'a' or 'b'": those that have a key.
std::string drivers_with(std::string_view key) {
  std::string names;
  for (const hal::DriverRow& row : hal::driver_rows()) {
    if (!has_key(&row, key)) continue;
    names += (names.empty() ? "driver '" : " or '") + std::string(row.name) + "'";
  }
  return names;
}

/// The keys of `[device]` that a driver has beyond those of all.
/// @param row  of the file's driver; null: `sim`, which has none.
/// @param used  the values go to a device; else they are checked alone.
void read_driver_keys(const TomlTable& device, const hal::DriverRow* row,
                      const std::filesystem::path& folder, bool used, hal::DriverOptions& options) {
  for (const hal::DriverRow& other : hal::driver_rows()) {
    for (const hal::DriverKey& key : other.keys) {
      if (device.has(key.name) && !has_key(row, key.name))
        device.fail(key.name,
                    "is a key of " + drivers_with(key.name) + " and of no other; remove the key");
    }
  }
  if (row == nullptr) return;
  for (const hal::DriverKey& key : row->keys) {
    if (!device.has(key.name)) continue;
    switch (key.kind) {
      case hal::DriverKey::Kind::kText:
        options.values.emplace_back(key.name, *device.text(key.name));
        break;
      case hal::DriverKey::Kind::kPath: {
        const std::string path = (folder / *device.path(key.name)).string();
        std::error_code error;
        if (used && std::filesystem::is_regular_file(path, error))
          note_input(path, "the " + std::string(key.name));
        options.values.emplace_back(key.name, path);
        break;
      }
      case hal::DriverKey::Kind::kFlag:
        options.values.emplace_back(key.name, *device.flag(key.name));
        break;
      case hal::DriverKey::Kind::kNumber:
        options.values.emplace_back(key.name, *device.number(key.name, {key.least, key.most}));
        break;
    }
  }
}

bool is_default(const hal::UsbAddress& address) {
  return address.vendor_id == 0 && address.serial.empty() && address.bus_path.empty();
}

/// As arguments of a bridge.
std::vector<std::string> words_of(const hal::DriverOptions& options) {
  std::vector<std::string> words;
  for (const auto& [key, value] : options.values) {
    if (const bool* const flag = std::get_if<bool>(&value)) {
      if (*flag) words.push_back("--" + std::string(key));
      continue;
    }
    words.push_back("--" + std::string(key));
    const std::string* const text = std::get_if<std::string>(&value);
    words.push_back(text != nullptr ? *text : formatted("%.17g", std::get<double>(value)));
  }
  return words;
}

void read_address(const TomlTable& device, const std::filesystem::path& folder, bool used,
                  HandDevice& config) {
  const auto address = device.text("address");
  if (!address) return;
  if (address->starts_with(kSocketPrefix)) {
    if (address->size() == kSocketPrefix.size())
      device.fail("address", "names no socket; give unix:PATH");
    if (used) config.socket_path = (folder / address->substr(kSocketPrefix.size())).string();
    return;
  }
  hal::UsbAddress read;
  if (!hal::parse_usb_address(*address, read))
    device.fail("address", "'" + *address +
                               "' is no address; give VID:PID or VID:PID:SERIAL in "
                               "hexadecimal, as lsusb shows it, its place on the bus, as in "
                               "1-2.3, or both, joined by @");
  if (used) config.address = read;
}

/// The tables of one device: [device], [workspace] and so on, or those with a 2 behind the name.
struct Tables {
  const TomlTable& top;
  std::string number;  ///< "", "2"

  [[nodiscard]] std::string name(const char* table) const { return table + number; }
  [[nodiscard]] std::optional<TomlTable> table(const char* called,
                                               std::vector<std::string_view> known) const {
    return top.table(name(called), std::move(known));
  }
};

void read_device(const Tables& tables, const std::filesystem::path& folder,
                 const std::string& chosen, HandDevice& config) {
  std::vector<std::string_view> known = {"driver", "address"};
  for (const hal::DriverRow& row : hal::driver_rows()) {
    for (const hal::DriverKey& key : row.keys) known.push_back(key.name);
  }
  const auto device = tables.table("device", known);
  const std::string name_of_table = tables.name("device");
  if (!device && chosen.empty())
    tables.top.fail_missing(name_of_table, "add the table [" + name_of_table + "] with driver");
  config.driver_name = chosen;
  hal::DriverOptions options;
  options.has_deadman = !config.deadman_input.path.empty();
  hal::DriverDefect defect;
  if (device) {
    const auto named = device->text("driver");
    if (!named && chosen.empty()) device->fail_missing("driver", driver_list());
    if (named && !is_driver_name(*named))
      device->fail("driver", "no driver '" + *named + "'; " + driver_list());
    if (chosen.empty()) config.driver_name = *named;
    // Address and keys are those of the file's driver; without a name there, of the chosen one.
    const std::string& name = named ? *named : chosen;
    const hal::DriverRow* const row = hal::find_driver(name);
    const bool used = name == config.driver_name && row != nullptr;
    read_address(*device, folder, used, config);
    hal::DriverOptions of_file = options;
    read_driver_keys(*device, row, folder, used, of_file);
    of_file.vendor_id = config.address.vendor_id;
    of_file.product_id = config.address.product_id;
    if (row != nullptr && row->make(of_file, defect) == nullptr)
      device->fail(defect.key, defect.text);
    if (row != nullptr && row->is_bridged && used && !is_default(config.address))
      device->fail("address", "is of USB, and driver '" + name +
                                  "' reaches its device by a bridge; remove the key, or give "
                                  "unix:PATH of a bridge that runs already");
    if (used) options = of_file;
  }
  config.simulated = config.driver_name == kSimulated;
  const hal::DriverRow* const row = hal::find_driver(config.driver_name);
  // The simulated device speaks the protocol of the reference device.
  config.driver = (row != nullptr ? *row : hal::driver_rows().front()).make(options, defect);
  config.has_motors = !config.simulated && config.driver->capabilities().driven_dof != 0;
  if (row != nullptr && row->is_bridged && config.socket_path.empty())
    config.bridge = {config.driver_name, words_of(options)};
}

void read_loop(const TomlTable& top, DeviceConfig& config) {
  LoopConfig& loop = config.loop;
  loop.strict = config.has_motors();
  const auto t = top.table("loop", {"rate_hz", "clocking", "servo_priority", "usb_priority",
                                    "servo_cpu", "usb_cpu", "lock_memory", "strict"});
  if (!t) return;
  loop.period_ns = std::llround(1e9 / t->number("rate_hz", kRate_hz).value_or(1000.0));
  const std::string clocking = t->text("clocking").value_or("timer");
  if (clocking != "timer" && clocking != "report")
    t->fail("clocking", "no clocking '" + clocking + "'; give \"timer\" or \"report\"");
  loop.report_clocked = clocking == "report";
  loop.servo_priority = static_cast<int>(integer_in(*t, "servo_priority", 0, 99, 80));
  loop.usb_priority = static_cast<int>(integer_in(*t, "usb_priority", 0, 99, 79));
  if (loop.usb_priority > loop.servo_priority)
    t->fail("usb_priority", "is above servo_priority, " + std::to_string(loop.servo_priority) +
                                ", and would interrupt the tick; give one below it");
  loop.servo_cpu = static_cast<int>(integer_in(*t, "servo_cpu", 0, 1023, -1));
  loop.usb_cpu = static_cast<int>(integer_in(*t, "usb_cpu", 0, 1023, -1));
  loop.lock_memory = t->flag("lock_memory").value_or(true);
  loop.strict = t->flag("strict").value_or(loop.strict);
}

void read_workspace(const Tables& tables, bool of_two, HandDevice& config) {
  WorkspaceMap& map = config.servo.map;
  // D as the device has it, to x right, y away, z up; the user turns from there.
  const Quat upright = config.driver->capabilities().q_wd;
  map.q_wd = upright;
  map.handle_offset_h = config.driver->capabilities().handle_offset_h;
  const auto t = tables.table(
      "workspace", {"scale", "offset_m", "rotation", "part_rotation", "handle_offset_m"});
  // Where the device's origin is, and how the part is turned in the handle: found where nobody
  // says.
  config.servo.start.place = !t || !t->has("offset_m");
  config.servo.start.turn = config.servo.start.place && (!t || !t->has("part_rotation"));
  if (!t) return;
  for (const char* const key : {"offset_m", "part_rotation"}) {
    if (of_two && t->has(key))
      t->fail(key,
              "is of one device; the parts of two hands begin where the scene has them start and "
              "are led on from where they are, wherever the handles stand; remove the key");
  }
  if (const auto offset = t->vector3("handle_offset_m", kHandleOffset_m)) {
    for (int k = 0; k < 3; ++k)
      map.handle_offset_h[k] = static_cast<Real>((*offset)[static_cast<std::size_t>(k)]);
  }
  map.scale = static_cast<Real>(t->number("scale", kScale).value_or(1.0));
  if (const auto offset = t->vector3("offset_m", kOffset_m)) {
    for (int k = 0; k < 3; ++k)
      map.offset_w[k] = static_cast<Real>((*offset)[static_cast<std::size_t>(k)]);
  }
  if (const auto q = t->quaternion_wxyz("part_rotation"))
    map.q_ha = Quat(static_cast<Real>((*q)[0]), static_cast<Real>((*q)[1]),
                    static_cast<Real>((*q)[2]), static_cast<Real>((*q)[3]))
                   .normalized();
  if (const auto q = t->quaternion_wxyz("rotation")) {
    const Quat turn(static_cast<Real>((*q)[0]), static_cast<Real>((*q)[1]),
                    static_cast<Real>((*q)[2]), static_cast<Real>((*q)[3]));
    map.q_wd = (turn * upright).normalized();
  }
}

void read_limits(const Tables& tables, std::int64_t period_ns, HandDevice& config) {
  SafetyLimits& limits = config.servo.limits;
  limits = hal::limits_of(config.driver->capabilities(), period_ns);
  const std::pair<std::string_view, Real SafetyLimits::*> fields[] = {
      {"max_force_n", &SafetyLimits::max_force_n},
      {"max_torque_nm", &SafetyLimits::max_torque_nm},
      {"full_speed_m_per_s", &SafetyLimits::full_speed_m_per_s},
      {"zero_speed_m_per_s", &SafetyLimits::zero_speed_m_per_s},
      {"full_turn_rad_per_s", &SafetyLimits::full_turn_rad_per_s},
      {"zero_turn_rad_per_s", &SafetyLimits::zero_turn_rad_per_s},
      {"slew_n_per_s", &SafetyLimits::slew_n_per_s},
      {"slew_nm_per_s", &SafetyLimits::slew_nm_per_s},
      {"jump_speed_m_per_s", &SafetyLimits::jump_speed_m_per_s},
      {"jump_turn_rad_per_s", &SafetyLimits::jump_turn_rad_per_s}};
  std::vector<std::string_view> known = {"ramp_in_s"};
  for (const auto& field : fields) known.push_back(field.first);
  const auto t = tables.table("limits", known);
  if (!t) return;
  for (const auto& [key, member] : fields) {
    const auto value = t->number(key, {0.0, std::numeric_limits<double>::infinity()});
    if (!value) continue;
    if (*value == 0.0)
      t->fail(key,
              "is 0, which would not be \"no limit\" but nothing at all; give more than 0, or "
              "leave it out");
    const auto device = static_cast<double>(limits.*member);
    if (*value > device)
      t->fail(key, "is " + short_number(*value, 6) + ", beyond the " + short_number(device, 6) +
                       " of the device; give at most that, or leave it out");
    limits.*member = static_cast<Real>(*value);
  }
  if (const auto ramp_s = t->number("ramp_in_s", kRampIn_s)) {
    if (*ramp_s < static_cast<double>(limits.ramp_in_s))
      t->fail("ramp_in_s", "is " + short_number(*ramp_s, 6) + ", shorter than the " +
                               short_number(limits.ramp_in_s, 6) +
                               " of the device; give at least that, or leave it out");
    limits.ramp_in_s = static_cast<Real>(*ramp_s);
  }
  if (limits.full_speed_m_per_s >= limits.zero_speed_m_per_s)
    t->fail("zero_speed_m_per_s", "is not above full_speed_m_per_s, " +
                                      short_number(limits.full_speed_m_per_s, 6) +
                                      "; lower that one too");
  if (limits.full_turn_rad_per_s >= limits.zero_turn_rad_per_s)
    t->fail("zero_turn_rad_per_s", "is not above full_turn_rad_per_s, " +
                                       short_number(limits.full_turn_rad_per_s, 6) +
                                       "; lower that one too");
}

std::optional<TomlTable> switches_table(const Tables& tables) {
  return tables.table(
      "switches", {"deadman", "clutch", "emergency_stop", "deadman_input", "deadman_key", "gripper",
                   "gripper_closes_m", "gripper_opens_m"});
}

/// A key of a Linux input device, beside the haptic one.
void read_deadman_input(const Tables& tables, hal::KeySwitchSettings& input) {
  const auto t = switches_table(tables);
  if (!t) return;
  const auto path = t->path("deadman_input");
  const bool has_key = t->has("deadman_key");
  if (!path && has_key) t->fail("deadman_key", "is a key of no device; add deadman_input");
  if (!path) return;
  if (path->empty()) t->fail("deadman_input", "is empty; give the path below /dev/input/by-id");
  if (!has_key)
    t->fail("deadman_input", "has no key; add deadman_key, the code that evtest shows for it");
  input.path = *path;
  input.key = static_cast<std::uint16_t>(integer_in(*t, "deadman_key", 1, KEY_MAX, -1));
}

/// The gripper as a switch. @return the mask that it belongs to; null: none.
std::uint32_t* read_gripper(const TomlTable& t, HandDevice& config) {
  constexpr double kLeast_m = 1.0e-4, kMost_m = 1.0;
  const auto use = t.text("gripper");
  if (!use) {
    for (const char* const key : {"gripper_closes_m", "gripper_opens_m"}) {
      if (t.has(key)) t.fail(key, "is of a gripper that is no switch; add gripper = \"deadman\"");
    }
    return nullptr;
  }
  if (*use != "deadman" && *use != "clutch")
    t.fail("gripper", "is \"" + *use + "\"; it can be \"deadman\" or \"clutch\"");
  const Range range{kLeast_m, kMost_m};
  const auto closes = t.number("gripper_closes_m", range),
             opens = t.number("gripper_opens_m", range);
  if (!closes) t.fail("gripper", "needs gripper_closes_m, the gap at which it is closed");
  if (opens && *opens <= *closes)
    t.fail("gripper_opens_m", "is not above gripper_closes_m, " + short_number(*closes, 6));
  constexpr double kPlay = 1.25;  // so that a hand that trembles at the edge switches once
  config.gripper = {static_cast<Real>(*closes), static_cast<Real>(opens.value_or(kPlay * *closes))};
  SwitchMap& switches = config.servo.switches;
  return *use == "deadman" ? &switches.deadman : &switches.clutch;
}

void read_switches(const Tables& tables, HandDevice& config) {
  SwitchMap& switches = config.servo.switches;
  const auto t = switches_table(tables);
  if (!t) return;
  const bool has_input = !config.deadman_input.path.empty();
  if (has_input && !t->has("deadman")) switches.deadman = hal::kInputSwitch;
  std::uint32_t* const by_gripper = read_gripper(*t, config);
  if (by_gripper == &switches.clutch && t->has("clutch"))
    t->fail("clutch", "is a switch, and so is the gripper by gripper = \"clutch\"; remove one");
  if (by_gripper == &switches.clutch) switches.clutch = hal::kClosedGripper;
  if (by_gripper == &switches.deadman && !has_input && !t->has("deadman"))
    switches.deadman = hal::kClosedGripper;
  constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
  const auto mask = [&t](std::string_view key, std::uint32_t& value) {
    value = static_cast<std::uint32_t>(integer_in(*t, key, 0, kMost, value));
  };
  mask("deadman", switches.deadman);
  mask("clutch", switches.clutch);
  mask("emergency_stop", switches.emergency_stop);
  if (switches.deadman == 0)
    t->fail("deadman", "is 0, so that nothing would ever arm; give the mask of a switch");
  if ((switches.deadman & switches.clutch) != 0)
    t->fail("clutch", "shares a switch with deadman; give each its own");
  if (((switches.deadman | switches.clutch) & switches.emergency_stop) != 0)
    t->fail("emergency_stop", "shares a switch with deadman or clutch; give each its own");
  if (has_input) switches.deadman |= hal::kInputSwitch;
  if (by_gripper == &switches.deadman) switches.deadman |= hal::kClosedGripper;
}

/// Which tables of a second device there are without it.
void check_second(const TomlTable& top, bool has_second) {
  if (has_second) return;
  for (const char* const table : {"workspace2", "limits2", "switches2"}) {
    if (top.has(table))
      top.fail(table,
               "is of a second device, and there is none; add the table [device2] with "
               "driver, or remove this one");
  }
}

/// Two devices must be told apart: a link takes the first one that its address fits.
void check_places(const TomlTable& top, const std::vector<HandDevice>& devices) {
  const HandDevice &first = devices[0], &second = devices[1];
  if (first.simulated || second.simulated) return;
  bool is_apart = first.driver_name != second.driver_name;
  if (first.bridge.is_used() && second.bridge.is_used()) {
    is_apart = is_apart || first.bridge.words != second.bridge.words;
  } else if (first.socket_path.empty() != second.socket_path.empty()) {
    is_apart = true;
  } else if (!first.socket_path.empty()) {
    is_apart = first.socket_path != second.socket_path;
  } else if (!is_apart) {
    const auto named = [](const HandDevice& d) {
      return d.address.serial.empty() && d.address.bus_path.empty()
                 ? std::string()
                 : d.address.serial + "@" + d.address.bus_path;
    };
    is_apart = !named(first).empty() && !named(second).empty() && named(first) != named(second);
  }
  if (!is_apart)
    top.fail("device2",
             first.bridge.is_used() && second.bridge.is_used()
                 ? "cannot be told from [device]; give both keys that name one device alone"
                 : "cannot be told from [device]; give both an address that one device alone "
                   "has: VID:PID:SERIAL, a place on the bus as in 1-2.3, or unix:PATH");
}

}  // namespace

bool is_driver_name(const std::string& name) {
  return name == kSimulated || hal::find_driver(name) != nullptr;
}

std::string driver_list() {
  std::string names = "the drivers are: ";
  for (const hal::DriverRow& row : hal::driver_rows()) names += std::string(row.name) + ", ";
  return names + kSimulated;
}

std::string driver_help() {
  std::ostringstream text;
  text << std::left << "[device] driver is one of\n";
  for (const hal::DriverRow& row : hal::driver_rows()) {
    text << "  " << std::setw(12) << row.name << row.product;
    if (!row.note.empty()) text << ". " << row.note;
    text << '\n';
    for (const hal::DriverKey& key : row.keys)
      text << "    " << std::setw(26) << key.name << key.help << '\n';
  }
  text << "  " << std::setw(12) << kSimulated << "a handle in this process; no hardware\n";
  return text.str();
}

std::string device_words(const DeviceConfig& config, std::size_t device) {
  return config.has_two() ? "device " + std::to_string(device + 1) + ": " : "";
}

std::filesystem::path crash_file_of(const std::filesystem::path& file, std::size_t device) {
  if (device == 0 || file.empty()) return file;
  std::filesystem::path numbered = file;
  numbered.replace_filename(file.stem().string() + "-device" + std::to_string(device + 1) +
                            file.extension().string());
  return numbered;
}

DeviceConfig read_device_config(const std::filesystem::path& path, const std::string& device,
                                const std::string& device2) {
  const toml::table root = read_toml_file(path.string(), kLargestFileBytes, "the configuration");
  const std::filesystem::path folder = path.parent_path();
  if (!root.contains("scene") && root.contains("moving"))
    throw InputError(path.string() + ": is a scene file; compile it with 'graph_compiler " +
                     path.string() +
                     " -o SCENE.rtscene', and give a configuration with scene = "
                     "\"SCENE.rtscene\" here ('run_device run --help')");
  const TomlTable top(root, path.string(), "",
                      {"scene", "device", "device2", "loop", "workspace", "workspace2", "limits",
                       "limits2", "switches", "switches2", "recorder"});
  DeviceConfig config;
  config.file = path;
  const auto scene = top.path("scene");
  if (!scene) top.fail_missing("scene", "give the path of a compiled scene (.rtscene)");
  config.scene = folder / *scene;
  std::error_code error;
  if (scene->empty() || !std::filesystem::is_regular_file(config.scene, error))
    top.fail("scene", "no file '" + *scene +
                          "'; compile it with graph_compiler; the path counts from this file's "
                          "folder");
  note_input(config.scene, "the compiled scene");
  const bool has_second = top.has("device2") || !device2.empty();
  check_second(top, has_second);
  config.devices.resize(has_second ? 2 : 1);
  const auto each = [&](auto&& read) {
    for (std::size_t k = 0; k < config.devices.size(); ++k)
      read(Tables{top, k == 0 ? "" : "2"}, config.devices[k], k == 0 ? device : device2);
  };
  each([&](const Tables& tables, HandDevice& of, const std::string& chosen) {
    read_deadman_input(tables, of.deadman_input);
    read_device(tables, folder, chosen, of);
  });
  if (has_second) check_places(top, config.devices);
  read_loop(top, config);
  each([&](const Tables& tables, HandDevice& of, const std::string&) {
    read_workspace(tables, has_second, of);
    read_limits(tables, config.loop.period_ns, of);
    read_switches(tables, of);
  });
  if (const auto recorder = top.table("recorder", {"flight_seconds", "crash_file"})) {
    config.flight_seconds = recorder->number("flight_seconds", kFlight_s).value_or(4.0);
    if (const auto file = recorder->path("crash_file")) config.crash_file = folder / *file;
    for (std::size_t k = 0; k < config.devices.size(); ++k)
      claim_output(crash_file_of(config.crash_file, k), "crash_file",
                   csv_kind("tick,sequence,stamp_ns"));
  }
  return config;
}

}  // namespace haptic::tools
