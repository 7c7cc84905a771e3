// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_facts/coupling_text.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

/// L = sqrt(k_r / k_t).
double coupling_length(const CouplingParameters& c) {
  return std::sqrt(c.k_r_nm_per_rad / c.k_t_n_per_m);
}

bool is_rotary(const ContactStateBudget& state) {
  return std::string(state.gain) == "k_r_nm_per_rad";
}

std::string state_text(const ContactStateBudget& s) {
  const bool rotary = is_rotary(s);
  return formatted("    %-40s %s up to %.6g %s (scene %.6g: %s), damping up to %.6g %s\n", s.state,
                   std::string(s.gain).substr(0, 3).c_str(), s.stiffness,
                   rotary ? "N m/rad" : "N/m", s.given, s.holds() ? "within" : "BEYOND", s.damping,
                   rotary ? "N m s/rad" : "N s/m");
}

}  // namespace

std::string short_length(double length_m) {
  if (length_m >= 1.0) return formatted("%.3g m", length_m);
  return length_m >= 1e-4 ? formatted("%.3g mm", 1e3 * length_m)
                          : formatted("%.3g um", 1e6 * length_m);
}

std::string coupling_as_text(const SceneFacts& facts) {
  const CouplingParameters& c = facts.parameters.coupling;
  const ServedSize& size = facts.size;
  std::string text = formatted(
      "    k_t %.9g N/m, k_r %.9g N m/rad (L %s), damping %.9g N s/m, at most %.9g of the spring\n"
      "    limits: %.9g rad, ",
      c.k_t_n_per_m, c.k_r_nm_per_rad, short_length(coupling_length(c)).c_str(), c.damping_ns_per_m,
      c.damping_share, c.max_rotation_error_rad);
  text += c.max_translation_error_m > 0 ? short_length(c.max_translation_error_m)
                                        : std::string("none in translation");
  text += formatted("; twist over %.9g to %.9g s", c.min_window_s, c.max_window_s);
  if (c.max_pull_n > 0) text += formatted(", spring up to %.9g N", c.max_pull_n);
  if (c.max_turn_nm > 0) text += formatted(", up to %.9g N m", c.max_turn_nm);
  text += c.passivity != 0 ? "; passivity controller on" : "; no passivity controller";
  text += c.allow_active != 0 ? "; gains beyond the budget allowed\n" : "\n";
  if (facts.parameters.law != LawId::kProxy) {
    return text + "    this law does not use these gains: its stiffness is k_F\n";
  }
  text += formatted("    moving part reaches %s: lengths are %.4g times those at 50 mm, tolerance ",
                    short_length(size.radius_m).c_str(), size.length_scale);
  text += short_length(size.tolerance_m);
  text += size.floored ? " (rounding of the coordinates)\n" : "\n";
  text += size.climb_m > 0.0 ? "    steps up to " + short_length(size.climb_m) +
                                   " between faces do not hold the part\n"
                             : std::string("    every step between faces holds the part\n");
  return text + formatted("    stiffness in a contact at the largest lever: %.4g of k_t\n",
                          size.stiffness_share);
}

Json coupling_as_json(const SceneFacts& facts) {
  const CouplingParameters& c = facts.parameters.coupling;
  const ServedSize& size = facts.size;
  return {{"k_t_n_per_m", c.k_t_n_per_m},
          {"k_r_nm_per_rad", c.k_r_nm_per_rad},
          {"length_m", coupling_length(c)},
          {"damping_ns_per_m", c.damping_ns_per_m},
          {"damping_share", c.damping_share},
          {"max_rotation_error_rad", c.max_rotation_error_rad},
          {"max_translation_error_m", c.max_translation_error_m},
          {"min_window_s", c.min_window_s},
          {"max_window_s", c.max_window_s},
          {"encoder_step_rad", facts.parameters.device.encoder_step_rad},
          {"max_pull_n", c.max_pull_n},
          {"max_turn_nm", c.max_turn_nm},
          {"passes", c.passes},
          {"near_pairs", c.near_pairs},
          {"tolerance_m", c.tolerance_m},
          {"passivity", c.passivity != 0},
          {"allow_active", c.allow_active != 0},
          {"largest_lever_m", size.radius_m},
          {"stiffness_share_at_largest_lever", size.stiffness_share},
          {"length_scale", size.length_scale},
          {"tolerance_m", size.tolerance_m},
          {"climb_m", size.climb_m},
          {"largest_coordinate_m", size.coordinate_m},
          {"largest_coordinate_served_m", size.largest_offset_m}};
}

std::string budget_as_text(const SceneFacts& facts) {
  const PassivityBudget& b = facts.budget;
  if (!b.unchecked.empty()) return "    " + b.unchecked + ": no budget was checked\n";
  std::string text;
  for (const ContactStateBudget& state : b.states) text += state_text(state);
  text += formatted(
      "    at %.9g Hz, delay %.9g s, coupling damping %.6g N s/m (safe alone up to %.6g), margin "
      "%.3g; no hand,\n"
      "    no Coulomb friction; first order without damping: %.6g N/m; passive in any hand without "
      "delay: %.6g N/m\n"
      "    rotation: %s, %.6g kg m2 and %.6g N m s/rad about its least stable axis, gyration %s\n",
      1.0 / b.translation.period_s, b.translation.delay_s, b.virtual_damping_ns_per_m,
      b.damping_limit_ns_per_m, kBudgetMargin, b.first_order_n_per_m, b.passive_n_per_m,
      b.rotor_assumed ? "rotor not given, assumed" : "rotor", b.rotation.mass_kg,
      b.rotation.damping_ns_per_m, short_length(b.rotation_radius_m).c_str());
  if (b.encoder_n_per_m > 0) {
    text += formatted("    Coulomb friction eats what the encoder's steps feed in up to %.6g N/m\n",
                      b.encoder_n_per_m);
  }
  return text;
}

Json budget_as_json(const SceneFacts& facts) {
  const PassivityBudget& b = facts.budget;
  if (!b.unchecked.empty()) return {{"checked", false}, {"reason", b.unchecked}};
  Json states = Json::array();
  for (const ContactStateBudget& s : b.states) {
    states.push_back({{"state", s.state},
                      {"gain", s.gain},
                      {"stiffness", s.stiffness},
                      {"damping", s.damping},
                      {"scene", s.given},
                      {"holds", s.holds()}});
  }
  return {{"checked", true},
          {"holds", b.holds()},
          {"margin", kBudgetMargin},
          {"period_s", b.translation.period_s},
          {"delay_s", b.translation.delay_s},
          {"damping_ns_per_m", b.virtual_damping_ns_per_m},
          {"largest_damping_ns_per_m", b.damping_limit_ns_per_m},
          {"first_order_n_per_m", b.first_order_n_per_m},
          {"passive_n_per_m", b.passive_n_per_m},
          {"encoder_n_per_m", b.encoder_n_per_m},
          {"rotation_radius_m", b.rotation_radius_m},
          {"rotor_assumed", b.rotor_assumed},
          {"rotor_inertia_kg_m2", b.rotation.mass_kg},
          {"rotor_damping_nms_per_rad", b.rotation.damping_ns_per_m},
          {"states", std::move(states)}};
}

}  // namespace haptic::tools
