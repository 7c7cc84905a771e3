// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_facts/facts_text.hpp"
#include "tools/scene_facts/parts_text.hpp"

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

Json simplified_json(const BodyFacts& body) {
  if (!body.simplified) return nullptr;
  return {{"distance_m", body.simplified->distance_m},
          {"volume_change_m3", body.simplified->volume_change_m3}};
}

Json driven_json(const BodyFacts& body) {
  if (!body.driven) return nullptr;
  const DrivenRecord& d = body.driven->record;
  return {{"fastest_m_per_s", d.fastest_m_per_s},
          {"fastest_rad_per_s", d.fastest_rad_per_s},
          {"late_s", d.late_s},
          {"push_n", d.push_n},
          {"stiffness_ratio", d.ratio},
          {"middle_m", d.middle_m},
          {"radius_m", d.radius_m},
          {"scenes", body.driven->scenes},
          {"scene_bytes", body.driven->scene_bytes}};
}

Json body_json(const BodyFacts& body, bool moving) {
  Json pieces = Json::array();
  for (const PieceFacts& p : body.pieces) {
    pieces.push_back({{"volume_m3", p.volume_m3},
                      {"radius_m", p.radius_m},
                      {"reach_m", p.reach_m},
                      {"vertex_relax_m", p.vertex_relax_m},
                      {"edge_relax_ratio", p.edge_relax_ratio},
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
          {"role", moving        ? "moving"
                   : body.driven ? "driven"
                                 : "static"},
          {"part_role", body.role ? Json(role_name(*body.role)) : Json()},
          {"reference_m", body.reference_m},
          {"volume_m3", body.volume_m3},
          {"friction", body.friction},
          {"friction_static", body.friction_static},
          {"simplified", simplified_json(body)},
          {"held_scene_bytes", body.held_bytes ? Json(*body.held_bytes) : Json()},
          {"driven", driven_json(body)},
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

Json parts_json(const SceneFacts& facts) {
  if (!facts.parts) return nullptr;
  const PartsFacts& parts = *facts.parts;
  Json pairs = Json::array();
  for (const PartPairFacts& pair : parts.pairs) {
    pairs.push_back({{"a", pair.a},
                     {"b", pair.b.empty() ? Json() : Json(pair.b)},
                     {"scene_bytes", pair.bytes},
                     {"pairs", pair.pairs}});
  }
  const SceneCapacity& c = parts.bounds;
  return {{"hands", parts.hands},
          {"moving_at_once", parts.moving},
          {"pairs", std::move(pairs)},
          {"rooms", parts.rooms},
          {"room_bytes",
           {{"scene", parts.scene_bytes}, {"state", parts.state_bytes}, {"law", parts.law_bytes}}},
          {"bounds",
           {{"max_work_units", c.max_work_units},
            {"max_list_visits", c.max_list_visits},
            {"max_full_searches", c.max_full_searches},
            {"max_proxy_passes", c.max_proxy_passes},
            {"max_proxy_rounds", c.max_proxy_rounds},
            {"max_qp_programs", c.max_qp_programs},
            {"max_qp_rows", c.max_qp_rows},
            {"max_qp_iterations", c.max_qp_iterations}}}};
}

Json parameters_json(const SceneParameters& p) {
  Json result = {
      {"law", law_name(p.law)},
      {"goal_contact", p.goal_contact != 0},
      {"k_f_n_per_m", p.k_f_n_per_m},
      {"epsilon_m", p.epsilon_m},
      {"exact_band_m", p.exact_band_m},
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
                        {"delay_s", d.delay_s},
                        {"rotor_inertia_kg_m2", d.rotor_inertia_kg_m2},
                        {"rotor_damping_nms_per_rad", d.rotor_damping_nms_per_rad},
                        {"coulomb_torque_nm", d.coulomb_torque_nm},
                        {"encoder_step_rad", d.encoder_step_rad},
                        {"max_rotary_stiffness_nm_per_rad", d.max_rotary_stiffness_nm_per_rad}};
  }
  const HeldPartParameters& h = p.held;
  if (h.mass_kg > 0) {
    result["held_part"] = {{"mass_kg", h.mass_kg},
                           {"inertia_kg_m2", h.inertia_kg_m2},
                           {"centre_m", h.centre_m},
                           {"gravity_m_per_s2", h.gravity_m_per_s2}};
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
                     {"live_nodes", p.live_nodes},
                     {"a", p.types[0].nodes},
                     {"b", p.types[1].nodes},
                     {"c", p.types[2].nodes},
                     {"arcs", p.arcs},
                     {"max_degree", p.max_degree},
                     {"near_capacity", p.near_capacity},
                     {"edge_pairs", p.edge_pairs},
                     {"edge_pair_capacity", p.edge_pair_capacity},
                     {"graph", p.stored ? "stored" : "formed"},
                     {"graph_bytes", p.graph_bytes},
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

Json capacity_as_json(const SceneFacts& facts) {
  const SceneCapacity& c = facts.capacity;
  return {{"state_bytes", c.state_bytes},
          {"moving_lanes", c.moving_lanes},
          {"pair_count", c.pair_count},
          {"total_features", c.total_features},
          {"largest_pair_features", c.largest_pair_features},
          {"largest_near", c.largest_near},
          {"max_pair_visits", c.max_pair_visits},
          {"max_support_pairs", c.max_support_pairs},
          {"max_feature_evaluations", c.max_feature_evaluations},
          {"max_edge_pairs", c.max_edge_pairs},
          {"max_near_nodes", c.max_near_nodes},
          {"max_hull_points", c.max_hull_points},
          {"near_slots", c.near_slots},
          {"work_units", facts.parameters.work_units},
          {"max_work_units", c.max_work_units},
          {"max_list_visits", c.max_list_visits},
          {"max_plane_gaps", c.max_work_units},
          {"max_valid_nodes", c.max_work_units},
          {"max_full_searches", c.max_full_searches},
          {"max_search_work", c.max_work_units},
          {"max_proxy_passes", c.max_proxy_passes},
          {"max_proxy_rejected", c.max_proxy_rejected},
          {"max_proxy_rounds", c.max_proxy_rounds},
          {"max_qp_rows", c.max_qp_rows},
          {"max_qp_iterations", c.max_qp_iterations},
          {"max_qp_programs", c.max_qp_programs},
          {"max_qp_steps", c.max_qp_steps},
          {"certifiable", c.unproven == 0},
          {"unproven", unproven_reasons(facts)}};
}

Json facts_as_json(const SceneFacts& facts) {
  Json bodies = Json::array();
  for (std::size_t i = 0; i < facts.bodies.size(); ++i) {
    bodies.push_back(body_json(facts.bodies[i], i == 0));
  }
  return {{"name", facts.name},
          {"bytes", facts.bytes},
          {"content_hash", hash_text(facts.content_hash)},
          {"scalar_bytes", facts.scalar_bytes},
          {"parts", std::move(bodies)},
          {"moving_parts", parts_json(facts)},
          {"nodes", facts.nodes},
          {"arcs", facts.arcs},
          {"neighborhoods", neighborhoods_json(facts.types)},
          {"pairs", pairs_as_json(facts)},
          {"stored_graph_bytes", facts.stored_graph_bytes},
          {"sections", sections_as_json(facts)},
          {"capacity", capacity_as_json(facts)},
          {"parameters", parameters_json(facts.parameters)},
          {"coupling", coupling_as_json(facts)},
          {"passivity_budget", budget_as_json(facts)}};
}

}  // namespace haptic::tools
