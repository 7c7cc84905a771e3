// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/record/recording_begin.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

using Kind = hal::DriverKey::Kind;

/// Stands for a port that a replay does not open.
constexpr const char* kNoPort = "recorded";

bool is_private(const hal::DriverKey& key) {
  return key.name == "service" || key.name == "socket" || key.name == "library" ||
         key.name == "record" || key.name == "record_mb";
}

std::string kept_text(const hal::DriverKey& key, const std::string& text) {
  if (key.name == "port") return kNoPort;
  return key.kind == Kind::kPath ? std::filesystem::path(text).filename().string() : text;
}

bool is_given(const hal::DriverOptions& options, std::string_view key) {
  for (const auto& each : options.values)
    if (each.first == key) return true;
  return false;
}

}  // namespace

std::string begin_text(const hal::DriverRow& row, const hal::DriverOptions& options) {
  nlohmann::ordered_json keys = nlohmann::ordered_json::object();
  for (const hal::DriverKey& key : row.keys) {
    if (is_private(key)) continue;
    const std::string name(key.name);
    if (const auto* const text = options.value<std::string>(key.name))
      keys[name] = kept_text(key, *text);
    else if (const auto* const number = options.value<double>(key.name))
      keys[name] = *number;
    else if (const auto* const flag = options.value<bool>(key.name))
      keys[name] = *flag;
  }
  const nlohmann::ordered_json json{{"bridge", row.name}, {"keys", keys}};
  return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

hal::DriverOptions recorded_options(Recording& recording, const hal::DriverRow& row,
                                    const hal::DriverOptions& given) {
  RecordEntry entry;
  const bool is_begin = recording.next(entry) && entry.kind == hal::TapKind::kBegin;
  const auto* const text = reinterpret_cast<const char*>(entry.received.data());
  const nlohmann::json json =
      is_begin ? nlohmann::json::parse(text, text + entry.received.size(), nullptr, false)
               : nlohmann::json();
  const bool is_whole = json.is_object() && json.contains("bridge") && json["bridge"].is_string() &&
                        json.contains("keys") && json["keys"].is_object();
  if (!is_whole)
    throw InputError(recording.place() +
                     "the recording does not begin with its bridge; record again");
  const std::string bridge = json["bridge"].get<std::string>();
  if (bridge != row.name)
    throw InputError(recording.place() + "a recording of another bridge; device_bridge " + bridge +
                     " --replay FILE");
  hal::DriverOptions options = given;
  for (const hal::DriverKey& key : row.keys) {
    const auto at = json["keys"].find(std::string(key.name));
    if (at == json["keys"].end() || is_given(given, key.name)) continue;
    if (at->is_string() && (key.kind == Kind::kText || key.kind == Kind::kPath))
      options.values.emplace_back(key.name, at->get<std::string>());
    else if (at->is_number() && key.kind == Kind::kNumber)
      options.values.emplace_back(key.name, at->get<double>());
    else if (at->is_boolean() && key.kind == Kind::kFlag)
      options.values.emplace_back(key.name, at->get<bool>());
    else
      throw InputError(recording.place() + "the key " + std::string(key.name) +
                       " has another type than the bridge's; record again");
  }
  return options;
}

}  // namespace haptic::tools
