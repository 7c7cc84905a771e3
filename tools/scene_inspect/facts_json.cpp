// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/scene_inspect/facts_text.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTypeKeys[3] = {"a", "b", "c"};

Json neighborhoods_json(const std::array<NeighborhoodFacts, 3>& types) {
  Json result;
  for (std::size_t k = 0; k < 3; ++k) {
    result[kTypeKeys[k]] = {{"nodes", types[k].nodes},
                            {"smallest", types[k].smallest},
                            {"mean", types[k].mean},
                            {"largest", types[k].largest}};
  }
  return result;
}

Json body_json(const BodyFacts& body, bool moving) {
  Json pieces = Json::array();
  for (const PieceFacts& p : body.pieces) {
    pieces.push_back({{"volume_m3", p.volume_m3},
                      {"radius_m", p.radius_m},
                      {"vertices", p.vertices},
                      {"edges", p.edges},
                      {"faces", p.faces},
                      {"mesh_vertices", p.source.mesh_vertices},
                      {"cut_vertices", p.source.cut_vertices},
                      {"mesh_faces", p.source.mesh_faces},
                      {"cut_faces", p.source.cut_faces},
                      {"source_vertices", p.source.vertices},
                      {"source_faces", p.source.faces}});
  }
  const BodyRecheck& r = body.recheck;
  return {{"name", body.name},
          {"role", moving ? "moving" : "static"},
          {"reference_m", body.reference_m},
          {"volume_m3", body.volume_m3},
          {"planes", body.planes},
          {"pieces", std::move(pieces)},
          {"recheck",
           {{"largest_outside_m", r.largest_outside_m},
            {"largest_off_m", r.largest_off_m},
            {"tolerance_m", r.tolerance_m},
            {"convex", r.convex},
            {"source_conflicts", r.source_conflicts},
            {"piece_pairs", r.piece_pairs},
            {"separated_pairs", r.separated_pairs},
            {"overlapping", r.separated_pairs != r.piece_pairs}}}};
}

Json parameters_json(const SceneParameters& p) {
  Json result = {
      {"law", "paper"},
      {"k_f_n_per_m", p.k_f_n_per_m},
      {"epsilon_m", p.epsilon_m},
      {"rate_hz", p.rate_hz},
      {"start_position_m", p.start_p_wa_m},
      {"start_quaternion_wxyz",
       {p.start_q_wa_xyzw[3], p.start_q_wa_xyzw[0], p.start_q_wa_xyzw[1], p.start_q_wa_xyzw[2]}}};
  if (p.motion_limits_given != 0) {
    result["motion_limits"] = {{"linear_m_per_s", p.max_linear_speed_m_per_s},
                               {"angular_rad_per_s", p.max_angular_speed_rad_per_s}};
  }
  const DeviceParameters& d = p.device;
  if (d.given != 0) {
    result["device"] = {{"mass_kg", d.mass_kg},
                        {"damping_ns_per_m", d.damping_ns_per_m},
                        {"coulomb_friction_n", d.coulomb_friction_n},
                        {"encoder_step_m", d.encoder_step_m},
                        {"max_force_n", d.max_force_n},
                        {"max_torque_nm", d.max_torque_nm},
                        {"max_force_rate_n_per_s", d.max_force_rate_n_per_s},
                        {"max_torque_rate_nm_per_s", d.max_torque_rate_nm_per_s},
                        {"max_stiffness_n_per_m", d.max_stiffness_n_per_m},
                        {"max_damping_ns_per_m", d.max_damping_ns_per_m},
                        {"delay_s", d.delay_s}};
  }
  return result;
}

}  // namespace

Json pairs_as_json(const SceneFacts& facts) {
  Json pairs = Json::array();
  for (const PairFacts& p : facts.pairs) {
    pairs.push_back({{"piece_a", p.piece_a},
                     {"piece_b", p.piece_b},
                     {"nodes", p.nodes},
                     {"a", p.types[0].nodes},
                     {"b", p.types[1].nodes},
                     {"c", p.types[2].nodes},
                     {"arcs", p.arcs},
                     {"max_degree", p.max_degree},
                     {"near_capacity", p.near_capacity},
                     {"neighborhood_capacity", p.neighborhood_capacity},
                     {"neighborhoods", neighborhoods_json(p.types)}});
  }
  return pairs;
}

Json sections_as_json(const SceneFacts& facts) {
  Json sections = Json::array();
  for (const SectionFacts& s : facts.sections) {
    sections.push_back({{"name", s.name},
                        {"id", static_cast<std::uint32_t>(s.id)},
                        {"element_bytes", s.element_bytes},
                        {"count", s.count},
                        {"bytes", s.bytes}});
  }
  return sections;
}

Json capacity_as_json(const SceneCapacity& c) {
  return {{"state_bytes", c.state_bytes},
          {"moving_vertices", c.moving_vertices},
          {"moving_faces", c.moving_faces},
          {"moving_edges", c.moving_edges},
          {"pair_count", c.pair_count},
          {"largest_pair_nodes", c.largest_pair_nodes},
          {"total_near", c.total_near},
          {"largest_near", c.largest_near},
          {"largest_neighborhood", c.largest_neighborhood},
          {"max_nodes_evaluated", c.max_nodes_evaluated},
          {"max_support_pairs", c.max_support_pairs}};
}

Json facts_as_json(const SceneFacts& facts) {
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(facts.content_hash));
  Json bodies = Json::array();
  for (std::size_t i = 0; i < facts.bodies.size(); ++i) {
    bodies.push_back(body_json(facts.bodies[i], i == 0));
  }
  return {{"name", facts.name},
          {"bytes", facts.bytes},
          {"content_hash", hash},
          {"scalar_bytes", facts.scalar_bytes},
          {"parts", std::move(bodies)},
          {"nodes", facts.nodes},
          {"arcs", facts.arcs},
          {"neighborhoods", neighborhoods_json(facts.types)},
          {"pairs", pairs_as_json(facts)},
          {"sections", sections_as_json(facts)},
          {"capacity", capacity_as_json(facts.capacity)},
          {"parameters", parameters_json(facts.parameters)}};
}

}  // namespace haptic::tools
