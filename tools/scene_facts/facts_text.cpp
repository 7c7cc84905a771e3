// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_facts/facts_text.hpp"

#include <algorithm>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_facts/parts_text.hpp"

namespace haptic::tools {
namespace {

/// Rows of one kind that the text shows; the JSON has all.
constexpr std::size_t kShownRows = 20;
constexpr const char* kTypeNames[3] = {"A (face, vertex)", "B (vertex, face)", "C (edge, edge)"};

std::string rest_line(std::size_t count) {
  if (count <= kShownRows) return "";
  return "    ... and " + std::to_string(count - kShownRows) + " more (--json lists all)\n";
}

std::string recheck_text(const BodyRecheck& r) {
  std::string text =
      formatted("    recheck: vertices within %.2g m of their planes (limit %.2g m): %s\n",
                std::max(r.largest_off_m, r.largest_outside_m), r.tolerance_m,
                r.convex ? "convex" : "NOT CONVEX");
  if (r.source_conflicts > 0) {
    text += formatted("    recheck: %llu vertices contradict the mesh vertex that they name\n",
                      static_cast<unsigned long long>(r.source_conflicts));
  }
  if (r.piece_pairs > 0) {
    const bool apart = r.separated_pairs == r.piece_pairs;
    text += formatted("    recheck: %llu of %llu pairs of pieces separated by a plane: %s\n",
                      static_cast<unsigned long long>(r.separated_pairs),
                      static_cast<unsigned long long>(r.piece_pairs),
                      apart ? "disjoint" : "overlapping: a cover");
  }
  return text;
}

std::string body_text(const BodyFacts& body, std::size_t index) {
  std::string text = formatted("  %s '%s': %zu pieces, %u planes, volume %.9g m3\n",
                               index == 0  ? "moving"
                               : body.role ? role_name(*body.role)
                                           : "static",
                               body.name.c_str(), body.pieces.size(), body.planes, body.volume_m3);
  text += formatted("    %s (%.9g, %.9g, %.9g) m\n",
                    index == 0 ? "grip point in the mesh frame" : "reference point in W",
                    body.reference_m[0], body.reference_m[1], body.reference_m[2]);
  if (body.driven) {
    text += (body.driven->record.lead == Lead::kOwner ? "    moved by its owner: " : "    ") +
            driven_as_text(*body.driven) + "\n";
  } else if (body.held_bytes) {
    text += *body.held_bytes > 0 ? formatted("    may be held, in a scene of %llu bytes\n",
                                             static_cast<unsigned long long>(*body.held_bytes))
                                 : std::string("    never held\n");
  }
  if (body.simplified) {
    text += formatted("    SIMPLIFIED: surface within %.6g m of that of the mesh",
                      body.simplified->distance_m);
    if (body.volume_m3 > 0) {
      text += formatted(", volume %+.6g m3", body.simplified->volume_change_m3);
    }
    text += "\n";
  }
  if (index > 0) {
    text += formatted("    friction %.9g against the moving part, %.9g while it sticks\n",
                      body.friction, body.friction_static);
  }
  for (std::size_t i = 0; i < std::min(body.pieces.size(), kShownRows); ++i) {
    const PieceFacts& p = body.pieces[i];
    text += formatted(
        "    piece %zu: %u vertices, %u edges, %u faces, %.6g m3; from the mesh %u vertices, %u "
        "faces; "
        "from cuts %u, %u\n",
        i, p.vertices, p.edges, p.faces, p.volume_m3, p.source.mesh_vertices, p.source.mesh_faces,
        p.source.cut_vertices, p.source.cut_faces);
    text += formatted("      reach %.6g m, vertex relaxation %.6g m, edge relaxation ratio %.6g\n",
                      p.reach_m, p.vertex_relax_m, p.edge_relax_ratio);
  }
  return text + rest_line(body.pieces.size()) + recheck_text(body.recheck);
}

std::string parameters_text(const SceneParameters& p) {
  std::string text =
      formatted("  law %s, k_F %.9g N/m, epsilon %.9g m, exact within %.9g m, loop %.9g Hz\n",
                law_name(p.law), p.k_f_n_per_m, p.epsilon_m, p.exact_band_m, p.rate_hz);
  if (p.goal_contact == 0) text += "  the contact at the device's pose is not searched\n";
  text +=
      formatted("  start pose (%.9g, %.9g, %.9g) m, quaternion w x y z (%.9g, %.9g, %.9g, %.9g)\n",
                p.start_p_wa_m[0], p.start_p_wa_m[1], p.start_p_wa_m[2], p.start_q_wa_xyzw[3],
                p.start_q_wa_xyzw[0], p.start_q_wa_xyzw[1], p.start_q_wa_xyzw[2]);
  if (p.motion_limits_given != 0) {
    text += formatted("  motion limits %.9g m/s, %.9g rad/s\n", p.max_linear_speed_m_per_s,
                      p.max_angular_speed_rad_per_s);
  }
  const DeviceParameters& d = p.device;
  if (d.given != 0) {
    text += formatted(
        "  device: mass %.9g kg, damping %.9g N s/m, friction %.9g N, encoder step %.9g m, delay "
        "%.9g s\n"
        "  device limits (0: not given): %.9g N, %.9g N m, %.9g N/s, %.9g N m/s, %.9g N/m, %.9g N "
        "s/m, %.9g N m/rad\n"
        "  rotor: inertia (%.9g, %.9g, %.9g) kg m2, damping (%.9g, %.9g, %.9g) N m s/rad, friction "
        "%.9g N m, encoder step %.9g rad\n",
        d.mass_kg, d.damping_ns_per_m, d.coulomb_friction_n, d.encoder_step_m, d.delay_s,
        d.max_force_n, d.max_torque_nm, d.max_force_rate_n_per_s, d.max_torque_rate_nm_per_s,
        d.max_stiffness_n_per_m, d.max_damping_ns_per_m, d.max_rotary_stiffness_nm_per_rad,
        d.rotor_inertia_kg_m2[0], d.rotor_inertia_kg_m2[1], d.rotor_inertia_kg_m2[2],
        d.rotor_damping_nms_per_rad[0], d.rotor_damping_nms_per_rad[1],
        d.rotor_damping_nms_per_rad[2], d.coulomb_torque_nm, d.encoder_step_rad);
  } else {
    text += "  no device given\n";
  }
  const HeldPartParameters& h = p.held;
  if (h.mass_kg > 0) {
    text += formatted(
        "  held part: %.9g kg, centre (%.9g, %.9g, %.9g) m from the grip, gravity (%.9g, %.9g, "
        "%.9g) m/s2\n"
        "  inertia about the grip (%.9g, %.9g, %.9g, xy %.9g, xz %.9g, yz %.9g) kg m2\n",
        h.mass_kg, h.centre_m[0], h.centre_m[1], h.centre_m[2], h.gravity_m_per_s2[0],
        h.gravity_m_per_s2[1], h.gravity_m_per_s2[2], h.inertia_kg_m2[0], h.inertia_kg_m2[1],
        h.inertia_kg_m2[2], h.inertia_kg_m2[3], h.inertia_kg_m2[4], h.inertia_kg_m2[5]);
  }
  return text;
}

}  // namespace

std::string grouped(std::uint64_t n) {
  std::string text = std::to_string(n);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, 1, ' ');
  return text;
}

std::string sections_as_text(const SceneFacts& facts) {
  std::string text;
  for (const SectionFacts& s : facts.sections) {
    text +=
        formatted("    %-18s %12s bytes  (%s x %llu)\n", s.name.c_str(), grouped(s.bytes).c_str(),
                  grouped(s.count).c_str(), static_cast<unsigned long long>(s.element_bytes));
  }
  return text;
}

std::string nodes_as_text(const SceneFacts& facts) {
  std::string text;
  for (std::size_t k = 0; k < 3; ++k) {
    const NeighborhoodFacts& type = facts.types[k];
    text += formatted(
        "    type %-16s %10s nodes; neighbor subgraph of one node %u to %u, mean %.1f\n",
        kTypeNames[k], grouped(type.nodes).c_str(), type.smallest, type.largest, type.mean);
  }
  return text;
}

std::string pairs_as_text(const SceneFacts& facts,
                          std::optional<std::uint64_t> graph_budget_bytes) {
  std::string text;
  for (std::size_t i = 0; i < std::min(facts.pairs.size(), kShownRows); ++i) {
    const PairFacts& p = facts.pairs[i];
    text += formatted(
        "    pair %zu (pieces %u, %u): %u nodes, %llu arcs, largest degree %u, near capacity %u; ",
        i, p.piece_a, p.piece_b, p.nodes, static_cast<unsigned long long>(p.arcs), p.max_degree,
        p.near_capacity);
    text += graph_form(p, graph_budget_bytes) + "\n";
  }
  return text + rest_line(facts.pairs.size());
}

std::string driven_as_text(const DrivenFacts& driven) {
  const DrivenRecord& d = driven.record;
  if (d.lead == Lead::kAnchor)
    return formatted(
        "loose: stays, and gives way to more than %.6g N; %s scenes with parts that may "
        "be held",
        d.push_n, grouped(driven.scenes).c_str());
  if (d.lead == Lead::kWeight)
    return formatted(
        "loose: %.6g N of weight, sinks at up to %.6g m/s; %s scenes with parts that may "
        "be held",
        d.push_n, d.fastest_m_per_s, grouped(driven.scenes).c_str());
  return formatted("at up to %.6g m/s and %.6g rad/s, late after %.6g s, pushes with up to %.6g N",
                   d.fastest_m_per_s, d.fastest_rad_per_s, d.late_s, d.push_n) +
         "; " + grouped(driven.scenes) + (driven.scenes == 1 ? " scene" : " scenes") +
         " with parts that may be held, " + grouped(driven.scene_bytes) + " bytes";
}

std::string facts_as_text(const SceneFacts& facts) {
  std::string text =
      formatted("scene '%s': %s bytes, %s scalars, content %016llx\n", facts.name.c_str(),
                grouped(facts.bytes).c_str(), facts.scalar_bytes == 8 ? "double" : "float",
                static_cast<unsigned long long>(facts.content_hash));
  text += "parts\n";
  for (std::size_t i = 0; i < facts.bodies.size(); ++i) text += body_text(facts.bodies[i], i);
  text += "contact graph: " + grouped(facts.nodes) + " nodes, " + grouped(facts.arcs) + " arcs\n";
  text += nodes_as_text(facts) + pairs_as_text(facts, std::nullopt);
  text += "bytes by table\n" + sections_as_text(facts);
  text += "bounds\n" + bounds_as_text(facts);
  text += "parameters\n" + parameters_text(facts.parameters);
  return text + "coupling\n" + coupling_as_text(facts) + "passivity budget\n" +
         budget_as_text(facts);
}

}  // namespace haptic::tools
