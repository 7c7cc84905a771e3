// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/device_file.hpp"

#include <cmath>

#include "tools/common/error.hpp"
#include "tools/common/toml_file.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kLargestFileBytes = std::size_t{1} << 20;
constexpr double kLargestValue = 1.0e6;

[[noreturn]] void refuse(const std::string& path, const toml::source_region& place,
                         const std::string& defect) {
  throw tools::InputError(path + ":" + std::to_string(place.begin.line) + ": " + defect);
}

double number(const std::string& path, std::string_view key, const toml::node& node) {
  const auto value = node.value<double>();
  if (!node.is_number() || !value || !(*value >= 0 && *value <= kLargestValue))
    refuse(path, node.source(), std::string(key) + " must be a number from 0 to 1e6");
  return *value;
}

unsigned samples(const std::string& path, const toml::node& node, double count) {
  const double whole = std::nearbyint(count);
  if (whole > kMaxDelaySamples) {
    refuse(path, node.source(),
           "the delay is more than " + std::to_string(kMaxDelaySamples) + " samples at this rate");
  }
  return static_cast<unsigned>(whole);
}

void read_key(const std::string& path, std::string_view key, const toml::node& node, double rate_hz,
              DeviceModel& model) {
  const std::pair<std::string_view, double DeviceModel::*> fields[] = {
      {"mass_kg", &DeviceModel::mass_kg},
      {"damping_ns_per_m", &DeviceModel::damping_ns_per_m},
      {"rotor_kg_m2", &DeviceModel::rotor_kg_m2},
      {"rotor_damping_nms_per_rad", &DeviceModel::rotor_damping_nms_per_rad},
      {"coulomb_friction_n", &DeviceModel::coulomb_force_n},
      {"coulomb_torque_nm", &DeviceModel::coulomb_torque_nm},
      {"encoder_step_m", &DeviceModel::encoder_step_m},
      {"encoder_step_rad", &DeviceModel::encoder_step_rad},
      {"max_force_n", &DeviceModel::max_force_n},
      {"max_torque_nm", &DeviceModel::max_torque_nm}};
  const double value = number(path, key, node);
  for (const auto& [name, member] : fields) {
    if (name != key) continue;
    model.*member = value;
    return;
  }
  if (key == "delay_s") {
    model.delay_samples = samples(path, node, value * rate_hz);
    return;
  }
  if (key == "delay_samples") {
    if (!node.is_integer()) refuse(path, node.source(), "delay_samples must be a whole number");
    model.delay_samples = samples(path, node, value);
    return;
  }
  for (const std::string_view unused : {"max_force_rate_n_per_s", "max_torque_rate_nm_per_s",
                                        "max_stiffness_n_per_m", "max_damping_ns_per_m"}) {
    if (key == unused) return;
  }
  refuse(path, node.source(), "unknown key '" + std::string(key) + "'");
}

}  // namespace

DeviceModel read_device_file(const std::string& path, double rate_hz) {
  const toml::table root = tools::read_toml_file(path, kLargestFileBytes, "the device file");
  DeviceModel model;
  const toml::table* device = nullptr;
  for (const auto& [key, node] : root) {
    device = key.str() == "device" ? node.as_table() : nullptr;
    if (device == nullptr) refuse(path, node.source(), "only a [device] table may stand here");
  }
  if (device == nullptr) throw tools::InputError(path + ": has no [device] table; add it");
  for (const auto& [key, node] : *device) read_key(path, key.str(), node, rate_hz, model);
  return model;
}

}  // namespace haptic::sim
