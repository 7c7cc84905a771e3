// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/haply/haply_messages.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

namespace haptic::tools {
namespace {

using Json = nlohmann::json;

/// Farther from its base no such device reaches, nor faster, nor with more force.
constexpr double kFarthest_m = 2, kFastest_m_per_s = 100, kStrongest_n = 1000;

/// Before the parser sees it: brackets that are open at once, outside of strings.
bool is_too_deep(std::string_view text) {
  int depth = 0;
  bool in_string = false, escaped = false;
  for (const char c : text) {
    if (in_string) {
      if (!escaped && c == '"') in_string = false;
      escaped = !escaped && c == '\\';
      continue;
    }
    if (c == '"') in_string = true;
    if (c == '{' || c == '[') ++depth;
    if (c == '}' || c == ']') --depth;
    if (depth > kMostHaplyDepth) return true;
  }
  return false;
}

HaplyVerdict parse(std::string_view text, Json& json) {
  if (text.size() > kMostHaplyText_bytes) return HaplyVerdict::kTooLong;
  if (is_too_deep(text)) return HaplyVerdict::kTooDeep;
  json = Json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  return json.is_object() || json.is_array() ? HaplyVerdict::kOk : HaplyVerdict::kNotJson;
}

const Json* member(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found != object.end() ? &*found : nullptr;
}

std::string text_of(const Json* value, std::size_t most) {
  if (value == nullptr || !value->is_string()) return {};
  const auto& text = value->get_ref<const std::string&>();
  const auto is_plain = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' ||
           c == '-' || c == '_';
  };
  return text.size() <= most && std::all_of(text.begin(), text.end(), is_plain) ? text : "";
}

bool flag_of(const Json* object, const char* name, bool otherwise) {
  const Json* const value = object != nullptr ? member(*object, name) : nullptr;
  return value != nullptr && value->is_boolean() ? value->get<bool>() : otherwise;
}

/// Numbers of the members `names` of `object`, each of `most` at most.
bool read_numbers(const Json& object, const char* names, double most, double* numbers) {
  for (std::size_t k = 0; names[k] != '\0'; ++k) {
    const char name[2] = {names[k], '\0'};
    const Json* const value = member(object, name);
    if (value == nullptr || !value->is_number()) return false;
    numbers[k] = value->get<double>();
    if (!(std::abs(numbers[k]) <= most)) return false;
  }
  return true;
}

/// Where it is there, it must be right.
bool read_optional(const Json& state, const char* name, double most, double (&numbers)[3],
                   bool& is_there) {
  const Json* const value = member(state, name);
  is_there = value != nullptr;
  return !is_there || read_numbers(*value, "xyz", most, numbers);
}

/// The workspace transform of 3.5 leaves out what is at rest. A wrong number counts as moved.
bool is_moved(const Json& state) {
  const Json* const transform = member(state, "transform");
  if (transform == nullptr) return false;
  const auto differs = [&](const char* name, const char* names, std::array<double, 4> rest) {
    const Json* const part = member(*transform, name);
    if (part == nullptr) return false;
    for (std::size_t k = 0; names[k] != '\0'; ++k) {
      const char letter[2] = {names[k], '\0'};
      const Json* const value = member(*part, letter);
      if (value == nullptr) continue;
      if (!value->is_number() || !(std::abs(value->get<double>() - rest[k]) <= 1e-6)) return true;
    }
    return false;
  };
  return differs("position", "xyz", {0, 0, 0, 0}) || differs("scale", "xyz", {1, 1, 1, 0}) ||
         differs("rotation", "xyzw", {0, 0, 0, 1});
}

/// The entry of a group: an array of objects with "device_id".
const Json* entry_of(const Json& message, const std::string& group, const std::string& id) {
  const Json* const entries = member(message, group.c_str());
  if (entries == nullptr || !entries->is_array()) return nullptr;
  for (const Json& entry : *entries) {
    const Json* const name = member(entry, "device_id");
    if (name != nullptr && name->is_string() && name->get_ref<const std::string&>() == id)
      return &entry;
  }
  return nullptr;
}

void list_group(const Json& message, const char* group, std::vector<HaplyListed>& listed) {
  const Json* const entries = member(message, group);
  if (entries == nullptr || !entries->is_array()) return;
  for (const Json& entry : *entries) {
    if (listed.size() >= kMostHaplyDevices) return;
    HaplyListed one;
    one.id = text_of(member(entry, "device_id"), kMostHaplyName_bytes);
    if (one.id.empty()) continue;
    one.group = group;
    if (const Json* const config = member(entry, "config"))
      one.kind = text_of(member(*config, "type"), kMostHaplyName_bytes);
    const Json* const status = member(entry, "status");
    one.calibrated = flag_of(status, "calibrated", false);
    one.in_use = flag_of(status, "in_use", false);
    one.powered = flag_of(status, "power_supply", true);
    one.awake = flag_of(status, "awake", true);
    const Json* const state = member(entry, "state");
    one.tells_force = state != nullptr && member(*state, "current_cursor_force") != nullptr;
    listed.push_back(std::move(one));
  }
}

bool read_grip(const Json& entry, HaplyState& next) {
  const Json* const state = member(entry, "state");
  if (state == nullptr) return true;  // nothing new
  const Json* const orientation = member(*state, "orientation");
  if (orientation != nullptr) {
    double q[4];
    if (!read_numbers(*orientation, "xyzw", 2, q)) return false;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::abs(length - 1) <= 0.1)) return false;  // sensors round, none is off by a tenth
    for (int k = 0; k < 4; ++k) next.q_xyzw[k] = q[k] / length;
    next.has_grip = true;
  }
  next.grip_awake = flag_of(member(entry, "status"), "awake", true);
  next.buttons = flag_of(state, "button", false) ? 1u : 0u;
  const Json* const buttons = member(*state, "buttons");
  const char* const names[] = {"a", "b", "c", "home"};
  for (std::size_t k = 0; k < std::size(names); ++k)
    if (flag_of(buttons, names[k], false)) next.buttons |= 1u << k;
  return true;
}

/// Shortest text that reads back as the same number.
void append_number(std::string& out, double number) {
  char text[32];
  const auto end = std::to_chars(std::begin(text), std::end(text), number);
  out.append(text, end.ptr);
}

/// The content of an answer of HTTP, with or without an envelope.
const Json& content_of(const Json& body) {
  const Json* const data = member(body, "data");
  return data != nullptr && member(body, "ok") != nullptr ? *data : body;
}

}  // namespace

const char* to_text(HaplyVerdict verdict) noexcept {
  static constexpr std::array kTexts = {
      "is right",
      "is longer than 64 kB",
      "is nested deeper than 16",
      "is no JSON",
      "has something else where a finite number of a plausible size belongs",
      "lists the device without the position of its cursor",
      "does not list the device"};
  static_assert(kTexts.size() == static_cast<std::size_t>(HaplyVerdict::kCount));
  const auto k = static_cast<std::size_t>(verdict);
  return k < kTexts.size() ? kTexts[k] : "is unknown";
}

std::optional<HaplyVersion> read_haply_version(std::string_view body) {
  Json json;
  if (parse(body, json) != HaplyVerdict::kOk) return std::nullopt;
  const Json& content = content_of(json);
  HaplyVersion version;
  version.text = text_of(member(content, "project_version"), 32);
  if (version.text.empty()) version.text = text_of(member(content, "git_tag"), 32);
  if (version.text.empty()) return std::nullopt;
  const auto begins = [&](std::string_view minor) {
    return version.text == minor || version.text.starts_with(std::string(minor) + ".");
  };
  if (begins("3.0")) version.format = HaplyFormat::k30;
  if (begins("3.1")) version.format = HaplyFormat::k31;
  if (begins("3.5")) version.format = HaplyFormat::k35;
  return version;
}

HaplyVerdict read_haply_inventory(std::string_view text, HaplyInventory& inventory) {
  inventory = {};
  Json json;
  const HaplyVerdict verdict = parse(text, json);
  if (verdict != HaplyVerdict::kOk) return verdict;
  if (!json.is_object()) return HaplyVerdict::kIncomplete;
  list_group(json, "inverse3", inventory.devices);
  for (const char* group : {"wireless_verse_grip", "verse_grip", "custom_verse_grip"})
    list_group(json, group, inventory.grips);
  return HaplyVerdict::kOk;
}

std::optional<std::size_t> read_haply_sessions(std::string_view body) {
  Json json;
  if (parse(body, json) != HaplyVerdict::kOk) return std::nullopt;
  const Json* list = &content_of(json);
  if (const Json* const sessions = member(*list, "sessions")) list = sessions;
  if (!list->is_array()) return std::nullopt;
  return list->size();
}

HaplyVerdict read_haply_state(std::string_view text, const HaplyChoice& choice, HaplyState& state) {
  Json json;
  const HaplyVerdict verdict = parse(text, json);
  if (verdict != HaplyVerdict::kOk) return verdict;
  const Json* const entry = entry_of(json, "inverse3", choice.device);
  if (entry == nullptr) return HaplyVerdict::kAbsent;
  const Json* const device = member(*entry, "state");
  if (device == nullptr) return HaplyVerdict::kIncomplete;
  HaplyState next = state;
  bool has_position = false;
  if (!read_optional(*device, "cursor_position", kFarthest_m, next.position_m, has_position))
    return HaplyVerdict::kBadNumber;
  if (!has_position) return HaplyVerdict::kIncomplete;
  if (!read_optional(*device, "cursor_velocity", kFastest_m_per_s, next.velocity_m_per_s,
                     next.has_velocity) ||
      !read_optional(*device, "current_cursor_force", kStrongest_n, next.force_n, next.has_force))
    return HaplyVerdict::kBadNumber;
  next.moved = is_moved(*device);
  if (const Json* const status = member(*entry, "status")) {
    next.calibrated = flag_of(status, "calibrated", false) && flag_of(status, "ready", true);
    next.powered = flag_of(status, "power_supply", true);
  }
  next.has_grip = false;
  if (!choice.grip.empty()) {
    const Json* const grip = entry_of(json, choice.grip_group, choice.grip);
    if (grip != nullptr && !read_grip(*grip, next)) return HaplyVerdict::kBadNumber;
  }
  state = next;
  return HaplyVerdict::kOk;
}

void write_haply_force(HaplyFormat format, const std::string& device, const double (&force_n)[3],
                       bool first, std::string& out) {
  const bool configures = first && format == HaplyFormat::k35;
  out = "{";
  if (configures) out += R"("session":{"configure":{"basis":{"permutation":"XYZ"}}},)";
  out += R"("inverse3":[{"device_id":")";
  out += device;
  out += '"';
  if (configures) out += R"(,"configure":{"preset":"defaults"})";
  out += R"(,"commands":{"set_cursor_force":{")";
  out += format == HaplyFormat::k35 ? "vector" : "values";
  for (int k = 0; k < 3; ++k) {
    out += k == 0 ? R"(":{"x":)" : k == 1 ? R"(,"y":)" : R"(,"z":)";
    append_number(out, force_n[k]);
  }
  out += "}}}}]}";
}

}  // namespace haptic::tools
