// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A verdict as JSON, the same keys in every account. Needs nlohmann_json.

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// `line`: verdict_line of it.
[[nodiscard]] inline nlohmann::ordered_json verdict_json(const SessionVerdict& v,
                                                         std::string_view line) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["outcome"] = to_text(v.outcome);
  json["failures"] = Json::array();
  for (unsigned k = 0; k < static_cast<unsigned>(Outcome::kCount); ++k) {
    const auto outcome = static_cast<Outcome>(k);
    if (v.has(outcome)) json["failures"].push_back(to_text(outcome));
  }
  json["ticks"] = v.ticks;
  json["followed_ticks"] = v.followed_ticks;
  json["contact_ticks"] = v.contact_ticks;
  for (std::size_t k = 0; k < kWhyNots; ++k)
    json[std::string(to_text(static_cast<WhyNot>(k))) + "_ticks"] = v.why_not[k];
  json["started_inside"] = v.started_inside;
  json["longest_open_ticks"] = v.longest_open.ticks;
  json["open_force_n"] = v.open_force_n;
  json["longest_stuck_ticks"] = v.longest_stuck.ticks;
  json["inside_to_end_ticks"] = v.inside_to_end;
  json["given_out_j"] = std::isnan(v.given_out_j) ? Json(nullptr) : Json(v.given_out_j);
  json["text"] = std::string(line);
  return json;
}

}  // namespace haptic::tools
