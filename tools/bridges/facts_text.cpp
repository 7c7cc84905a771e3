// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/facts_text.hpp"

#include <bit>
#include <nlohmann/json.hpp>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// Bytes of a device that are no UTF-8 are replaced.
std::string in_a_line(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string facts_text(const std::string& bridge, const hal::BridgeFacts* facts,
                       const std::string& why) {
  if (facts == nullptr) return bridge + ": not there: " + why;
  const hal::DeviceCapabilities& c = facts->capabilities;
  std::string text = bridge + ": " + facts->name;
  text += formatted("\n  senses %d degrees of freedom, drives %d", std::popcount(c.sensed_dof),
                    std::popcount(c.driven_dof));
  if (c.driven_dof != 0)
    text += formatted("; at most %g N and %g N m", double{c.max_force_n}, double{c.max_torque_nm});
  if (c.max_stiffness_n_per_m > 0) text += formatted(", %g N/m", double{c.max_stiffness_n_per_m});
  text += formatted("; a report every %g ms", 1e-6 * static_cast<double>(c.report_period_ns));
  if (c.latency_ns > 0)
    text += formatted(", %g ms of latency", 1e-6 * static_cast<double>(c.latency_ns));
  if (c.is_displacement) text += "; measures displacement";
  if (!facts->words.empty()) text += "\n  " + facts->words;
  return text;
}

std::string facts_line(const std::string& bridge, const hal::BridgeFacts* facts,
                       const std::string& why) {
  nlohmann::ordered_json json{{"bridge", bridge}, {"found", facts != nullptr}};
  if (facts == nullptr) {
    json["why"] = why;
  } else {
    const hal::DeviceCapabilities& c = facts->capabilities;
    json.update({{"name", facts->name},
                 {"words", facts->words},
                 {"needs", facts->needs},
                 {"sensed_dof", c.sensed_dof},
                 {"driven_dof", c.driven_dof},
                 {"max_force_n", double{c.max_force_n}},
                 {"max_torque_nm", double{c.max_torque_nm}},
                 {"max_stiffness_n_per_m", double{c.max_stiffness_n_per_m}},
                 {"mass_kg", double{c.mass_kg}},
                 {"report_period_us", c.report_period_ns / 1000},
                 {"product", hal::text_of(c.name)},
                 {"serial", hal::text_of(c.serial)},
                 {"latency_us", c.latency_ns / 1000},
                 {"measures", c.is_displacement ? "displacement" : "pose"}});
  }
  return in_a_line(json);
}

std::string replay_text(const std::string& bridge, const ReplayResult& result) {
  std::string text = bridge + ": " + std::to_string(result.poses) + " poses of the recording";
  if (result.poses == 0 && result.first.empty())
    return text + ": it shows nothing; record again while the device moves";
  text += result.first.empty() ? ", each of them the same to the bit"
                               : ", and then another one\n  " + result.first;
  if (!result.has_end && result.first.empty())
    text += "\n  the recording has no end: its bridge was killed, or its disk was full";
  return text;
}

std::string replay_line(const std::string& bridge, const ReplayResult& result) {
  const nlohmann::ordered_json json{{"bridge", bridge},
                                    {"poses", result.poses},
                                    {"different", result.different},
                                    {"first", result.first},
                                    {"whole", result.has_end && result.end == RecordingEnd::kDone}};
  return in_a_line(json);
}

}  // namespace haptic::tools
