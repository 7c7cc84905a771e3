// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/report.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/memory_budget.hpp"
#include "tools/graph_compiler/simplify/surface_simplification.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/budget_text.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

std::string millimetres(double x_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", 1e3 * x_m);
  return text;
}

/// The worst piece of a part by one measure, and how many fall short of epsilon.
struct Shortfall {
  std::size_t pieces = 0, worst = 0;
  double least_m = 0.0;

  void add(std::size_t piece, double size_m, double epsilon_m) {
    if (size_m > epsilon_m) return;
    if (pieces == 0 || size_m < least_m) {
      worst = piece;
      least_m = size_m;
    }
    pieces += 1;
  }
};

std::string sentence(const std::string& mesh, const Shortfall& shortfall,
                     const std::string& feature, double epsilon_m) {
  std::string text = mesh + ": epsilon_m " + millimetres(epsilon_m) + " exceeds " + feature + " " +
                     millimetres(shortfall.least_m);
  if (shortfall.pieces > 1) {
    text += " (and so in " + std::to_string(shortfall.pieces - 1) + " more pieces)";
  }
  return text + "; the tracker stays exact but is slower; fix: epsilon_m below " +
         millimetres(shortfall.least_m / 2) + ", or a part without such features";
}

using Json = nlohmann::ordered_json;

/// View of what the compiler has written; the bytes must outlive it.
SceneView opened(const SceneBytes& bytes) {
  SceneView view;
  if (SceneView::open(bytes.span(), view) != RtStatus::kOk) {
    throw std::logic_error("the scene just written does not open");
  }
  return view;
}

SceneFacts facts_of_bytes(const std::vector<std::byte>& bytes) {
  const SceneBytes aligned{bytes};
  return facts_of(opened(aligned));
}

SceneParameters parameters_of(const std::vector<std::byte>& bytes) {
  const SceneBytes aligned{bytes};
  return opened(aligned).parameters();
}

std::size_t edge_count(const ConvexPiece& piece) {
  std::size_t corners = 0;
  for (const PieceFace& face : piece.faces) corners += face.loop.size();
  return corners / 2;
}

Json simplified_json(const std::optional<SimplifyAccount>& account) {
  if (!account) return nullptr;
  const SimplifyAccount& a = *account;
  return {{"limit_m", a.limit_m},
          {"share", a.share},
          {"changed", a.changed},
          {"hausdorff_m", a.hausdorff_m},
          {"hausdorff_at_least_m", a.hausdorff_at_least_m},
          {"planes_before", a.planes_before},
          {"planes_after", a.planes_after},
          {"reflex_edges_before", a.reflex_before},
          {"reflex_edges_after", a.reflex_after},
          {"volume_before_m3", a.volume_before_m3},
          {"volume_after_m3", a.volume_after_m3}};
}

Json collapsed_json(const CollapseAccount& a) {
  return {{"limit_m", a.limit_m},
          {"changed", a.changed()},
          {"hausdorff_m", a.hausdorff_m()},
          {"given_to_result_m", a.given_to_result_m},
          {"result_to_given_m", a.result_to_given_m},
          {"triangles_before", a.triangles_before},
          {"triangles_after", a.triangles_after},
          {"facets_before", a.facets_before},
          {"facets_after", a.facets_after},
          {"kept_by_distance", a.kept_by_distance},
          {"kept_by_topology", a.kept_by_topology},
          {"kept_by_crossing", a.kept_by_crossing},
          {"volume_change_m3", a.volume_change_m3}};
}

Json surface_json(const std::optional<SurfaceAccount>& account) {
  if (!account) return nullptr;
  const SurfaceAccount& a = *account;
  Json crossings = nullptr;
  if (a.self_intersections) crossings = *a.self_intersections;
  return {{"triangles_read", a.triangles_read},
          {"triangles", a.triangles},
          {"facets", a.facets},
          {"welded_vertices", a.welded_vertices},
          {"largest_weld_move_m", a.largest_weld_move_m},
          {"weld_radius_m", a.weld_radius_m},
          {"duplicate_facets", a.duplicate_facets},
          {"degenerate_absorbed", a.degenerate_absorbed},
          {"degenerate_loose", a.degenerate_loose},
          {"flipped", a.flipped},
          {"t_junction_edges", a.t_junction_edges},
          {"open_edges", a.open_edges},
          {"nonmanifold_edges", a.nonmanifold_edges},
          {"widest_crack_m", a.widest_crack_m},
          {"shells", a.shells},
          {"closed_shells", a.closed_shells},
          {"self_intersections", std::move(crossings)}};
}

Json certificate_json(const PartReport& part) {
  if (part.is_surface()) return nullptr;
  const Certificate& c = part.certificate;
  return {{"holds", c.holds()},
          {"convex", c.convex},
          {"partition", c.partition},
          {"disjoint", c.disjoint},
          {"volume_equal", c.volume_equal},
          {"cover", c.cover},
          {"removed", c.removed},
          {"nonzero_counts", c.nonzero_counts},
          {"volume_m3", c.volume_m3}};
}

Json shape_json(const std::optional<Shape>& shape) {
  if (!shape) return nullptr;
  return {{"kind", shape_word(*shape)},
          {"segments", segments_of(*shape)},
          {"chord_error_m", chord_error_m(*shape)}};
}

Json deflection_json(const std::optional<Deflection>& deflection) {
  if (!deflection) return nullptr;
  return {{"asked_m", deflection->asked_m}, {"found_m", deflection->found_m}};
}

Json part_json(const PartReport& part, bool moving) {
  Json steps = Json::array();
  for (const CleaningStep& step : part.steps) {
    steps.push_back(
        {{"name", step.name}, {"count", step.count}, {"largest_move_m", step.largest_move_m}});
  }
  Json pieces = Json::array();
  for (const ConvexPiece& piece : part.pieces) {
    pieces.push_back({{"volume_m3", piece.volume_m3},
                      {"vertices", piece.vertices.size()},
                      {"edges", edge_count(piece)},
                      {"faces", piece.faces.size()}});
  }
  return {{"role", moving ? "moving" : "static"},
          {"file", part.mesh},
          {"as", part.is_surface() ? "surface" : "solid"},
          {"reason", part.reason},
          {"surface", surface_json(part.surface)},
          {"shape", shape_json(part.shape)},
          {"deflection", deflection_json(part.deflection)},
          {"scale_to_m", part.scale_to_m},
          {"mesh_vertices", part.mesh_vertices},
          {"mesh_faces", part.mesh_faces},
          {"diagonal_m", part.diagonal_m},
          {"plane_tolerance_m", part.plane_tolerance_m},
          {"cleaning", std::move(steps)},
          {"largest_move_m", part.largest_move_m},
          {"simplified",
           part.collapsed ? collapsed_json(*part.collapsed) : simplified_json(part.simplified)},
          {"warnings", part.warnings},
          {"shells", part.shells},
          {"solids", part.solids},
          {"planes", part.planes},
          {"reflex_edges", part.reflex_edges},
          {"largest_bits", part.largest_bits},
          {"face_plane_only_pieces", part.face_plane_only_pieces},
          {"thinnest_m", part.thinnest_m},
          {"work", part.work},
          {"pieces", std::move(pieces)},
          {"volume_m3", part.volume_m3},
          {"certificate", certificate_json(part)}};
}

Json timing_json(const CompiledScene& compiled) {
  Json parts = Json::array();
  for (const PartReport& part : compiled.parts) {
    parts.push_back({{"file", part.mesh},
                     {"read_s", part.timing.read_s},
                     {"clean_s", part.timing.clean_s},
                     {"flatten_s", part.timing.flatten_s},
                     {"decompose_s", part.timing.decompose_s},
                     {"facets_s", part.timing.facets_s}});
  }
  return {{"parts", std::move(parts)},
          {"exposure_s", 1e-3 * compiled.pruning.exposure_ms},
          {"marks_s", 1e-3 * compiled.pruning.marks_ms},
          {"write_s", compiled.write_s},
          {"total_s", compiled.total_s}};
}

Json budget_json(const SceneBudget& budget) {
  Json result = Json::object();
  if (budget.constants) result["constants_bytes"] = budget.constants->bytes;
  if (budget.state) result["state_bytes"] = budget.state->bytes;
  if (budget.stack) result["stack_bytes"] = budget.stack->bytes;
  if (budget.pair_visits) result["pair_visits"] = *budget.pair_visits;
  if (budget.near_pairs) result["near_pairs"] = *budget.near_pairs;
  return result;
}

std::string certificate_text(const Certificate& c) {
  if (c.holds()) {
    return std::string("convex, partition, disjoint, volumes equal (exact)") +
           (c.cover         ? "; solids overlap: cover"
            : c.removed > 0 ? "; solids overlapped: cut apart"
                            : "");
  }
  std::string text = "FAILED:";
  if (!c.convex) text += " not convex";
  if (!c.partition) text += " not a partition";
  if (!c.disjoint) text += " not disjoint";
  if (!c.volume_equal) text += " volumes differ";
  return text;
}

std::string surface_text(const SurfaceAccount& a) {
  std::string text = formatted(
      "    vertices welded %zu (moved at most %.2g m), faces repeated %zu, without area %zu, "
      "turned "
      "%zu\n    open edges %zu, T-junctions %zu, non-manifold edges %zu, shells %zu (%zu "
      "closed)\n",
      a.welded_vertices, a.largest_weld_move_m, a.duplicate_facets,
      a.degenerate_absorbed + a.degenerate_loose, a.flipped, a.open_edges, a.t_junction_edges,
      a.nonmanifold_edges, a.shells, a.closed_shells);
  if (a.self_intersections && *a.self_intersections > 0) {
    text += formatted("    triangles that pass through each other %s%zu\n",
                      *a.self_intersections == kMostCrossingsCounted ? "at least " : "",
                      *a.self_intersections);
  }
  return text;
}

std::string part_text(const PartReport& part, bool moving) {
  std::string text = formatted("%s %s: %s: %s\n", moving ? "moving" : "static", part.mesh.c_str(),
                               part.is_surface() ? "surface" : "solid", part.reason.c_str());
  if (part.shape && segments_of(*part.shape) > 0) {
    text += formatted("    round surfaces in %u segments, facets off them by at most %.3g m\n",
                      segments_of(*part.shape), chord_error_m(*part.shape));
  }
  if (part.deflection) {
    text += formatted("    deflection_m = %.3g: facets off the round faces by at most %.3g m\n",
                      part.deflection->asked_m, part.deflection->found_m);
  }
  if (part.collapsed) text += "    " + collapse_text(*part.collapsed) + "\n";
  if (part.surface) return text + surface_text(*part.surface);
  text += formatted("    %zu vertices, %zu faces, tolerance %.3g m\n", part.mesh_vertices,
                    part.mesh_faces, part.plane_tolerance_m);
  for (const CleaningStep& step : part.steps) {
    if (step.count == 0) continue;
    text += formatted("    %-24s %8zu   moved at most %.2g m\n", step.name.c_str(), step.count,
                      step.largest_move_m);
  }
  if (part.simplified) text += "    " + simplify_text(*part.simplified) + "\n";
  text += formatted("    solids %zu, planes %zu, reflex edges %zu, volume %.9g m3\n", part.solids,
                    part.planes, part.reflex_edges, part.volume_m3);
  text += formatted("    convex pieces %zu", part.pieces.size());
  constexpr std::size_t kShown = 6;
  for (std::size_t i = 0; i < std::min(part.pieces.size(), kShown); ++i) {
    const ConvexPiece& p = part.pieces[i];
    text += formatted("%s%zuV %zuE %zuF", i == 0 ? ": " : ", ", p.vertices.size(), edge_count(p),
                      p.faces.size());
  }
  text += part.pieces.size() > kShown ? ", ...\n" : "\n";
  return text + "    certificate: " + certificate_text(part.certificate) + "\n";
}

/// The part in one line.
std::string part_line(const PartReport& part, bool moving) {
  std::string text = std::string(moving ? "moving       " : "static       ") + part.mesh + ": " +
                     (part.is_surface() ? "surface: " : "solid: ") + part.reason;
  if (part.is_surface()) return text + "\n";
  text += formatted("; solids %zu, volume %.9g m3", part.solids, part.volume_m3);
  constexpr double kToldMove_m = 1e-12;
  if (part.largest_move_m > kToldMove_m)
    text += formatted(", moved at most %.2g m", part.largest_move_m);
  return text + (part.certificate.holds() ? "\n" : "; certificate FAILED\n");
}

/// The parts that the hand may hold; empty: one alone moves.
std::string held_line(const SceneFacts& facts) {
  std::string names;
  std::size_t count = 0;
  for (const BodyFacts& body : facts.bodies) {
    if (body.held_bytes.value_or(0) == 0) continue;
    names += (count++ > 0 ? ", " : "") + body.name;
  }
  if (count <= 1) return "";
  if (facts.parts && facts.parts->hands > 1)
    return "held         one by each of two hands: " + names + "\n";
  return "held         one after another, " + grouped(count) + " parts: " + names + "\n";
}

/// The parts that their owner moves, a line each.
std::string driven_lines(const SceneFacts& facts) {
  std::string text;
  for (const BodyFacts& body : facts.bodies)
    if (body.driven)
      text += (body.driven->record.lead == Lead::kOwner ? "driven       " : "loose        ") +
              body.name + ": " + driven_as_text(*body.driven) + "\n";
  return text;
}

std::string stiffness_line(const SceneFacts& facts) {
  const CouplingParameters& k = facts.parameters.coupling;
  if (facts.parameters.law != LawId::kProxy) {
    return formatted("stiffness    %.6g N/m, law %s\n", facts.parameters.k_f_n_per_m,
                     law_name(facts.parameters.law));
  }
  const PassivityBudget& budget = facts.budget;
  return formatted("stiffness    %.6g N/m, %.4g N m/rad, damping %.4g N s/m; %s\n", k.k_t_n_per_m,
                   k.k_r_nm_per_rad, k.damping_ns_per_m,
                   !budget.unchecked.empty() ? (budget.unchecked + ": not checked").c_str()
                   : budget.holds()          ? "within what the device holds stable"
                                             : "BEYOND what the device holds stable");
}

Json steady_json(const CompiledScene& compiled) {
  if (!compiled.steady) return nullptr;
  Json pairs = Json::array();
  for (const PairSteadyWork& p : compiled.steady->pairs) {
    pairs.push_back({{"features", p.features},
                     {"age_ticks", p.age_ticks},
                     {"motion_m", p.motion_m},
                     {"median", p.median},
                     {"largest", p.largest},
                     {"renewed_median", p.renewed_median},
                     {"renewed_largest", p.renewed_largest}});
  }
  return {{"seed", compiled.steady->seed},
          {"samples", compiled.steady->samples},
          {"pairs", std::move(pairs)}};
}

/// The proxy's bound as a time, at the price of a unit that its budget was made with.
std::string work_text(const SceneFacts& facts) {
  const SceneCapacity& c = facts.capacity;
  if (c.max_work_units == 0) return {};
  const double bound_s = kUnitPrice_s * c.max_work_units;
  std::string text = formatted(
      "  budget of a tick %u units, with what it may have begun %u: at %.0f ns a unit %.0f us, "
      "%.1f %% of the period\n    (host_lab wcet measures the price on this machine)\n",
      facts.parameters.work_units, c.max_work_units, 1e9 * kUnitPrice_s, 1e6 * bound_s,
      100 * bound_s * facts.parameters.rate_hz);
  if (c.near_slots > kMaxNearPairs) {
    text +=
        "    (of thousands of facets that are near at once the cache does not hold all: there a "
        "unit "
        "has taken 170 to 450 ns,\n    and a tick may be late; host_lab cost SCENE --motion M "
        "measures it)\n";
  }
  return text;
}

std::string steady_text(const CompiledScene& compiled, const SceneFacts& facts) {
  if (!compiled.steady) {
    return std::string(compiled.scene.orientation || compiled.scene.workspace
                           ? "no speeds in [motion_limits]"
                           : "no [motion_limits]") +
           ": no speed certificate\n";
  }
  const SteadyWork& work = *compiled.steady;
  const SceneParameters& p = compiled.scene.parameters;
  std::string text = formatted(
      "steady work at %.9g m/s and %.9g rad/s, %.9g Hz: of %u sampled poses in contact per pair, "
      "seed %llu\n    (a figure; the proof is the bound above, of all faces and edges)\n",
      p.max_linear_speed_m_per_s, p.max_angular_speed_rad_per_s, p.rate_hz, work.samples,
      static_cast<unsigned long long>(work.seed));
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 0; i < std::min(work.pairs.size(), kShown); ++i) {
    const PairSteadyWork& w = work.pairs[i];
    text += "    " + pair_name(facts, i);
    text += formatted(
        ": of %u faces and edges a tick renews %.1f (median), %.1f (largest) on demand;\n"
        "      %u, %u if all bounds were %u ticks old, at %.3g mm of motion each\n",
        w.features, w.renewed_median, w.renewed_largest, w.median, w.largest, w.age_ticks,
        1e3 * w.motion_m);
  }
  if (work.pairs.size() > kShown) {
    text += "    ... and " + std::to_string(work.pairs.size() - kShown) +
            " more pairs (--report lists all)\n";
  }
  return text;
}

std::uint64_t graph_budget(const CompiledScene& compiled) {
  return compiled.scene.graph_bytes.value_or(kDefaultGraphBytes);
}

}  // namespace

std::vector<std::string> epsilon_warnings(const CompiledScene& compiled) {
  std::vector<std::string> result;
  if (compiled.account.edges.empty()) return result;  // a part that never turns has no such bounds
  const double epsilon_m = compiled.scene.parameters.epsilon_m;
  std::size_t first = 0;
  for (const PartReport& part : compiled.parts) {
    Shortfall width, depth;
    for (std::size_t i = 0; i < part.pieces.size(); ++i) {
      width.add(i, compiled.account.edges[first + i].width_m, epsilon_m);
      depth.add(i, compiled.account.vertices[first + i].depth_m, epsilon_m);
    }
    if (width.pieces > 0) {
      const EdgeRelaxation& edge = compiled.account.edges[first + width.worst];
      result.push_back(sentence(part.mesh, width,
                                "the width of face " + std::to_string(edge.face) + " across edge " +
                                    std::to_string(edge.edge) + " of piece " +
                                    std::to_string(width.worst) + ",",
                                epsilon_m));
    }
    if (depth.pieces > 0) {
      const VertexRelaxation& vertex = compiled.account.vertices[first + depth.worst];
      result.push_back(sentence(part.mesh, depth,
                                "the height of vertex " + std::to_string(vertex.vertex) +
                                    " of piece " + std::to_string(depth.worst) +
                                    " over its neighbors,",
                                epsilon_m));
    }
    first += part.surface ? part.surface->facets : part.pieces.size();
  }
  return result;
}

std::string report_as_json(const CompiledScene& compiled) {
  const SceneFacts facts = facts_of_bytes(compiled.bytes);
  Json parts = Json::array();
  for (std::size_t i = 0; i < compiled.parts.size(); ++i) {
    parts.push_back(part_json(compiled.parts[i], i == 0));
  }
  const Json report = {{"scene", facts.name},
                       {"parts", std::move(parts)},
                       {"nodes", facts.nodes},
                       {"arcs", facts.arcs},
                       {"pairs", pairs_as_json(facts)},
                       {"pruning", account_as_json(compiled.pruning)},
                       {"graph_budget_bytes", graph_budget(compiled)},
                       {"stored_graph_bytes", facts.stored_graph_bytes},
                       {"bytes", facts.bytes},
                       {"sections", sections_as_json(facts)},
                       {"capacity", capacity_as_json(facts)},
                       {"coupling", coupling_as_json(facts)},
                       {"passivity_budget", budget_as_json(facts)},
                       {"notes", compiled.notes},
                       {"steady_work", steady_json(compiled)},
                       {"state_bytes", facts.capacity.state_bytes},
                       {"state_parts", state_as_json(facts)},
                       {"budget", budget_json(compiled.scene.budget)},
                       {"warnings", warnings_of(compiled)},
                       {"timing", timing_json(compiled)}};
  // Names of files need not be UTF-8.
  return report.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string report_as_text(const CompiledScene& compiled) {
  const SceneFacts facts = facts_of_bytes(compiled.bytes);
  std::string text = "scene '" + facts.name + "'\n";
  for (std::size_t i = 0; i < compiled.parts.size(); ++i) {
    text += part_text(compiled.parts[i], i == 0);
  }
  text += driven_lines(facts);
  if (facts.pairs.empty()) {
    text += "contact graph: " + grouped(facts.pair_count) +
            " pairs, none listed: each is formed from its two pieces while it is near\n";
  } else {
    text += "contact graph: " + std::to_string(facts.pairs.size()) + " pairs, " +
            grouped(facts.nodes) + " nodes, " + grouped(facts.arcs) + " arcs\n" +
            nodes_as_text(facts) + pairs_as_text(facts, graph_budget(compiled));
  }
  text += account_as_text(compiled.pruning);
  text += "bounds\n" + bounds_as_text(facts) + work_text(facts) + steady_text(compiled, facts);
  text += std::string("law ") + law_name(facts.parameters.law) + "\n" + coupling_as_text(facts) +
          "passivity budget\n" + budget_as_text(facts);
  for (const std::string& note : compiled.notes) text += "note: " + note + "\n";
  text += "bytes: " + grouped(facts.bytes) + ", state " + grouped(facts.capacity.state_bytes) +
          "\n" + sections_as_text(facts);
  text += state_as_text(facts);
  return text + formatted("time %.3f s\n", compiled.total_s);
}

std::string summary_as_text(const CompiledScene& compiled, const std::string& output) {
  const SceneFacts facts = facts_of_bytes(compiled.bytes);
  const SceneCapacity& c = facts.capacity;
  const bool proxy = facts.parameters.law == LawId::kProxy;
  std::string text =
      formatted("scene        '%s', compiled in %.3f s\n", facts.name.c_str(), compiled.total_s);
  text += part_line(compiled.parts[0], true);
  if (compiled.parts.size() > 1) {
    std::string fixed = part_line(compiled.parts[1], false);
    if (const std::size_t more = compiled.parts.size() - 2; more > 0) {
      fixed.insert(fixed.size() - 1, "; and " + grouped(more) +
                                         (more == 1 ? " more part (--full lists it)"
                                                    : " more parts (--full lists them)"));
    }
    text += fixed;
  }
  text += held_line(facts) + driven_lines(facts);
  text += "pairs        " + grouped(facts.pair_count) + " pairs of pieces";
  if (proxy) {
    const bool follows_some = (c.unproven & kUnprovenNearPairs) != 0;
    text += follows_some ? "; a tick follows the nearest " + grouped(c.near_slots)
            : facts.pair_count > c.near_slots
                ? ", screened in bulk; a tick follows up to " + grouped(c.near_slots) + " of them"
                : std::string("; a tick can follow all of them");
  }
  text += "\n";
  if (c.max_work_units > 0) {
    const double bound_s = kUnitPrice_s * c.max_work_units;
    text += "tick         " + grouped(facts.parameters.work_units) +
            " units of work, with what it may have begun " + grouped(c.max_work_units) +
            formatted(": at %.0f ns a unit %.0f us, %.1f %% of the period\n", 1e9 * kUnitPrice_s,
                      1e6 * bound_s, 100 * bound_s * facts.parameters.rate_hz);
  }
  text += stiffness_line(facts);
  text += "memory       constants " + grouped(facts.bytes) + " bytes, state " +
          grouped(c.state_bytes) + " bytes\n";
  const std::size_t warned = warnings_of(compiled).size();
  text += "warnings     " + (warned > 0 ? grouped(warned) : std::string("none"));
  if (!compiled.notes.empty()) {
    text += "; note: " + compiled.notes[0];
    if (const std::size_t more = compiled.notes.size() - 1; more > 0)
      text += " (and " + grouped(more) + " more; --full lists them)";
  }
  text += "\n";
  text += "written      " + output + " (--full says more, --json all)\n";
  const std::vector<std::string> reasons = unproven_reasons(facts);
  if (reasons.empty()) {
    return text + "certificate  no list of a tick can overflow" +
           (proxy ? "; a tick whose units are spent lags, with a flag\n"
                  : "; every tick is exact\n");
  }
  text += "warning      " + reasons[0];
  if (reasons.size() > 1) {
    text += " (and " + grouped(reasons.size() - 1) + " more; --full lists them)";
  }
  return text + "\n";
}

std::vector<std::string> unproven_of(const CompiledScene& compiled) {
  return unproven_reasons(facts_of_bytes(compiled.bytes));
}

std::vector<std::string> warnings_of(const CompiledScene& compiled) {
  std::vector<std::string> result = compiled.scene.warnings;
  for (const PartReport& part : compiled.parts) {
    for (const std::string& warning : part.warnings) result.push_back(part.mesh + ": " + warning);
  }
  // Law kProxy forms no near sets, but for who asks at the goal pose.
  if (has_goal_contact(compiled.scene.parameters)) {
    for (std::string& warning : epsilon_warnings(compiled)) result.push_back(std::move(warning));
  }
  const DeviceParameters& device = compiled.scene.parameters.device;
  const SceneParameters p = parameters_of(compiled.bytes);
  const bool proxy = p.law == LawId::kProxy;
  const double k = proxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  if (device.given != 0 && device.max_stiffness_n_per_m > 0 && k > device.max_stiffness_n_per_m) {
    result.push_back(formatted("%s is %.9g, above the device's max_stiffness_n_per_m %.9g",
                               proxy ? "[coupling] k_t_n_per_m" : "[rendering] k_f_n_per_m", k,
                               device.max_stiffness_n_per_m));
  }
  for (std::string& reason : unproven_of(compiled)) {
    result.push_back("not certified: " + std::move(reason));
  }
  return result;
}

}  // namespace haptic::tools
