// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/bridge_answer.hpp"

#include <nlohmann/json.hpp>

namespace haptic::tools {
namespace {

std::string text_at(const nlohmann::json& json, const char* key) {
  const auto at = json.find(key);
  return at != json.end() && at->is_string() ? at->get<std::string>() : std::string();
}

/// 0 where it is no number from 0 to `most`.
double number_at(const nlohmann::json& json, const char* key, double most) {
  const auto at = json.find(key);
  const double number = at != json.end() && at->is_number() ? at->get<double>() : 0.0;
  return number >= 0 && number <= most ? number : 0.0;
}

}  // namespace

BridgeAnswer read_bridge_answer(std::string_view line) {
  BridgeAnswer answer;
  line = line.substr(0, kMostBridgeAnswer);
  const nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object()) {
    answer.why = line.empty() ? "the bridge has not answered" : std::string(line);
    return answer;
  }
  answer.name = text_at(json, "name");
  answer.words = text_at(json, "words");
  answer.product = text_at(json, "product");
  answer.serial = text_at(json, "serial");
  answer.needs = text_at(json, "needs");
  answer.why = text_at(json, "why");
  answer.latency_ms = 1e-3 * number_at(json, "latency_us", 1e6);
  answer.has_force = number_at(json, "driven_dof", 63) > 0;
  answer.max_stiffness_n_per_m = number_at(json, "max_stiffness_n_per_m", 1e6);
  answer.mass_kg = number_at(json, "mass_kg", 1e3);
  const auto found = json.find("found");
  const bool says_so = found != json.end() && found->is_boolean() && found->get<bool>();
  answer.found = says_so && !answer.name.empty();
  if (!answer.found && answer.why.empty())
    answer.why = "the bridge does not say why it has found nothing";
  return answer;
}

}  // namespace haptic::tools
