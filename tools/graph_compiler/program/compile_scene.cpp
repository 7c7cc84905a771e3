// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/compile_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <variant>

#include "rt_core/proxy/proxy_law.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"
#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/program/flush_faces.hpp"
#include "tools/graph_compiler/program/memory_budget.hpp"
#include "tools/graph_compiler/program/odd_sizes.hpp"
#include "tools/graph_compiler/program/part_mesh.hpp"
#include "tools/graph_compiler/program/plausible_values.hpp"
#include "tools/graph_compiler/program/scene_guide.hpp"
#include "tools/graph_compiler/program/scene_stages.hpp"
#include "tools/graph_compiler/program/start_pose.hpp"
#include "tools/graph_compiler/program/tolerance_proposal.hpp"
#include "tools/graph_compiler/pruning/exposure.hpp"
#include "tools/graph_compiler/pruning/scene_pruning.hpp"
#include "tools/graph_compiler/shapes/mating.hpp"
#include "tools/graph_compiler/simplify/simplification.hpp"
#include "tools/graph_compiler/simplify/surface_simplification.hpp"
#include "tools/graph_compiler/surface/surface_body.hpp"
#include "tools/plan/plan_limits.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

/// Time since the last call (or construction) [s].
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

template <typename T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Two parts of one file have the same to say of it.
void add_new(std::vector<std::string>& to, const std::vector<std::string>& from) {
  for (const std::string& text : from) {
    if (std::ranges::find(to, text) == to.end()) to.push_back(text);
  }
}

/// Some steps start a warning with the file, some do not.
std::string without_file(const std::string& warning, const std::string& file) {
  const std::string start = file + ": ";
  return warning.rfind(start, 0) == 0 ? warning.substr(start.size()) : warning;
}

struct WrittenPart {
  PlacedBody placed;
  std::vector<PieceExposure> exposure;  ///< by piece of the body
  double exposure_s = 0.0;
};

struct CompiledPart {
  std::variant<WrittenPart, SurfacePart> shape;
  PartReport report;
  std::vector<std::string> notes;  ///< of reading it
};

using Tell = std::function<void(const char* step, double fraction)>;

/// A part as exact convex pieces, and what was done on the way.
struct ExactPart {
  FlatBody flat;
  Decomposition pieces;
  std::optional<SimplifyAccount> simplified;
  double flatten_s = 0.0;
};

FlattenLimits flatten_limits(const CompileOptions& options) {
  FlattenLimits limits;
  if (options.max_reflex) limits.max_reflex_edges = *options.max_reflex;
  return limits;
}

Decomposition decomposed(FlatBody& flat, const std::string& file, const ScenePart& part,
                         const CompileOptions& options, const Tell& tell) {
  DecompositionLimits limits;
  if (options.max_pieces) limits.max_pieces = *options.max_pieces;
  if (options.work_limit) flat.world.work_limit = *options.work_limit;
  limits.disjoint = options.disjoint || part.disjoint;
  return decompose(flat, file, limits, [&](double fraction) { tell("decomposing", fraction); });
}

ExactPart exact_part(const Surface& surface, const ScenePart& part, const CompileOptions& options,
                     const Tell& tell) {
  ExactPart out;
  Stopwatch watch;
  tell("flattening", 0.0);
  out.flat = flatten(surface, flatten_limits(options));
  out.flatten_s = watch.lap();
  out.pieces = decomposed(out.flat, surface.file, part, options, tell);
  return out;
}

/// Where the simplified surface proves not to be a solid, or strays too far, smaller steps may
/// still do: what they leave has more edges, hardly ever fewer, so the refusal of a limit ends the
/// search.
ExactPart exact_part_simplified(const Surface& surface, double distance_m, const ScenePart& part,
                                const CompileOptions& options, const Tell& tell) {
  constexpr std::array<double, 6> kShares{1.0, 0.8, 0.6, 0.4, 0.2, 0.1};
  std::string refusals;
  for (const double share : kShares) {
    ExactPart out;
    Stopwatch watch;
    tell("simplifying", 0.0);
    try {
      Simplified simplified = simplify(surface, {distance_m, share}, flatten_limits(options));
      out.flat = std::move(simplified.body);
      out.simplified = simplified.account;
      out.flatten_s = watch.lap();
      out.pieces = decomposed(out.flat, surface.file, part, options, tell);
      return out;
    } catch (const LimitError& error) {
      if (refusals.empty()) throw;
      throw InputError(refusals + " (smaller steps of the simplification: " +
                       without_file(error.what(), surface.file) + ")");
    } catch (const InputError& error) {
      if (refusals.empty()) refusals = error.what();
    }
  }
  throw InputError(refusals + " (smaller steps of the simplification were tried too)");
}

/// The tolerance of the command line, else the part's own.
std::optional<double> tolerance_of(const ScenePart& part, const CompileOptions& options) {
  return options.simplify_m ? options.simplify_m : part.tolerance_m;
}

/// "1 open edge", "2 306 open edges"
std::string counted(std::size_t n, const char* what) {
  return grouped(n) + " " + what + (n == 1 ? "" : "s");
}

/// Solids with more reflex edges than the default limit are tried up to so many, and with so many
/// units of exact work; beyond these, cutting takes longer than it is worth.
constexpr std::size_t kMostTriedReflex = 3000;
constexpr double kTriedWork = 5.0e7;

/// Cost of contact all over a part, as a solid and as a surface.
struct KindCost {
  std::size_t pieces = 0, facets = 0;
  double solid = 0.0, surface = 0.0;  ///< of the work of a tick
};

KindCost cost_of_kinds(std::size_t pieces, std::size_t facets, const SceneFile& scene) {
  const double rate_hz = scene.parameters.rate_hz;
  const std::uint32_t passes = scene.coupling.passes.value_or(kDefaultProxyPasses);
  return {pieces, facets, contact_share(pieces, false, rate_hz, passes),
          contact_share(facets, true, rate_hz, passes)};
}

/// "contact all over takes 3 % of the work of a tick with 5 convex pieces, 84 % with 1 152 facets"
std::string cost_text(const KindCost& cost, const char* about) {
  const auto percent = [](double share) {
    return grouped(static_cast<std::uint64_t>(std::llround(100.0 * share))) + " %";
  };
  return "contact all over takes " + percent(cost.solid) + " of the work of a tick with " + about +
         counted(cost.pieces, "convex piece") + ", " + percent(cost.surface) + " with " +
         counted(cost.facets, "facet");
}

/// The mesh as a solid: the part's report, and what goes into the scene.
WrittenPart compile_solid(const PartMesh& source, const ScenePart& part, const SceneFile& scene,
                          const CompileOptions& options, const Tell& tell, PartReport& report) {
  const RawMesh& raw = source.mesh;
  WrittenPart result;
  Stopwatch watch;
  tell("cleaning", 0.0);
  CleaningOptions cleaning;
  cleaning.scale_to_m = source.scale_to_m;
  cleaning.plane_tolerance_m =
      options.plane_tolerance_m ? options.plane_tolerance_m : scene.plane_tolerance_m;
  const Surface surface = clean_surface(raw, cleaning);
  report.plane_tolerance_m = surface.plane_tolerance_m;
  report.diagonal_m = surface.diagonal_m;
  report.shells = surface.shells.size();
  report.timing.clean_s = watch.lap();

  const std::optional<double> tolerance_m = tolerance_of(part, options);
  report.timing.flatten_s = 0.0;
  ExactPart exact = tolerance_m ? exact_part_simplified(surface, *tolerance_m, part, options, tell)
                                : exact_part(surface, part, options, tell);
  FlatBody& flat = exact.flat;
  const Decomposition& pieces = exact.pieces;
  report.simplified = exact.simplified;
  report.solids = flat.solids.size();
  report.planes = flat.merged_plane_count;
  report.reflex_edges = flat.reflex_edge_count;
  report.largest_move_m = flat.largest_move_m;
  report.largest_bits = flat.largest_bits;
  report.timing.flatten_s = exact.flatten_s;
  report.face_plane_only_pieces = pieces.face_plane_only_pieces;
  report.thinnest_m = pieces.thinnest_m;
  report.work = pieces.work;
  report.certificate = pieces.certificate;
  append(report.steps, surface.steps);
  append(report.steps, flat.steps);
  // Those of the surface are among those of its flat faces.
  for (const std::vector<std::string>& warnings : {flat.warnings, pieces.warnings}) {
    for (const std::string& warning : warnings) {
      report.warnings.push_back(without_file(warning, raw.file));
    }
  }

  // The scene is not that of the file: said also where no report is asked for.
  if (report.simplified && report.simplified->changed) {
    const SimplifyAccount& account = *report.simplified;
    report.warnings.push_back(simplify_text(account));
    result.placed.simplified = {account.hausdorff_m,
                                account.volume_after_m3 - account.volume_before_m3};
  }

  // Coordinates stay about the part's own centre, where doubles are finest; the writer adds the
  // centre.
  result.placed.mesh_origin_m = std::exchange(flat.world.centre_m, {0.0, 0.0, 0.0});
  std::vector<std::size_t> order;
  result.placed.body = to_body(flat, pieces, body_name(part), &order);
  report.volume_m3 = result.placed.body.volume_m3;
  report.pieces = result.placed.body.pieces;
  report.timing.decompose_s = watch.lap() - exact.flatten_s;
  report.reason = "closed, " + counted(report.reflex_edges, "reflex edge") + "; " +
                  counted(report.mesh_faces, "face") + ", " +
                  counted(report.pieces.size(), "convex piece");
  if (!options.prune) return result;

  tell("finding seams", 0.0);
  std::vector<PieceExposure> exposure = exposure_of(flat, pieces.pieces);
  for (const std::size_t k : order) result.exposure.push_back(std::move(exposure[k]));
  result.exposure_s = watch.lap();
  return result;
}

/// The first defect of a refusal: "file: defect; fix" without the file and the fix.
std::string defect_of(const std::string& refusal, const std::string& file) {
  const std::string text = without_file(refusal, file);
  return text.substr(0, text.find("; "));
}

/// `why` is what the mesh lacks for a solid; empty where a surface was asked for.
SurfacePart compile_surface(const PartMesh& source, const std::string& why,
                            std::optional<double> tolerance_m, double flat_share, const Tell& tell,
                            PartReport& report) {
  Stopwatch watch;
  tell("making facets", 0.0);
  SurfaceOptions surface_options;
  surface_options.flat_share = flat_share;
  surface_options.scale_to_m = source.scale_to_m;
  SurfaceAccount account;
  SurfacePart surface;
  if (tolerance_m) {
    SimplifiedPart simplified =
        simplified_surface(source.mesh, surface_options, *tolerance_m,
                           [&](double fraction) { tell("simplifying", fraction); });
    surface = std::move(simplified.part);
    account = simplified.found;
    report.collapsed = simplified.collapsed;
    // The scene is not that of the file: said also where no report is asked for.
    if (report.collapsed->changed()) report.warnings.push_back(collapse_text(*report.collapsed));
  } else {
    surface = make_surface_part(source.mesh, surface_options, &account);
  }
  report.diagonal_m = account.diagonal_m;
  report.shells = account.shells;
  report.reason = why.empty() ? "as the scene asks" : why;
  if (!why.empty() && account.open_edges > 0) {
    report.reason = counted(account.open_edges, "open edge") + " (a solid needs none)";
  }
  report.reason +=
      "; " + counted(account.triangles, "triangle") + ", " + counted(account.facets, "facet");
  if (account.degenerate_loose > 0) {
    report.warnings.push_back(counted(account.degenerate_loose, "triangle") +
                              " without area that no facet borders on: left out");
  }
  if (account.widest_crack_m > 0.0) {
    report.warnings.push_back(
        formatted("a crack of %.3g m between open edges: a real slot, since it is wider than the "
                  "%.3g m within which edges are joined",
                  account.widest_crack_m, account.weld_radius_m));
  }
  report.surface = account;
  report.timing.facets_s = watch.lap();
  return surface;
}

CompiledPart compile_part(const ScenePart& part, const SceneFile& scene,
                          const CompileOptions& options, MeshFiles& files) {
  CompiledPart result;
  PartReport& report = result.report;
  report.mesh = part.mesh;
  const auto tell = [&](const char* step, double fraction) {
    if (options.progress) options.progress(part.mesh, step, fraction);
  };
  Stopwatch watch;
  tell("reading", 0.0);
  const PartMesh source = read_part_mesh(part, scene.file, &files);
  const RawMesh& raw = source.mesh;
  result.notes = part.notes;
  append(result.notes, raw.notes);
  report.shape = part.shape;
  report.deflection = source.deflection;
  if (source.deflection && source.deflection->found_m > source.deflection->asked_m) {
    report.warnings.push_back(
        formatted("facets lie off the round faces by up to %.3g m, more than the deflection of "
                  "%.3g m that was asked for; a smaller deflection_m makes finer facets",
                  source.deflection->found_m, source.deflection->asked_m));
  }
  if (part.node) {
    // A warning about what was left out of the file is given once for all its nodes.
    for (const std::string& warning : raw.warnings) {
      result.notes.push_back(part.path.string() + ": " + warning);
    }
  } else {
    append(report.warnings, raw.warnings);
  }
  report.scale_to_m = source.unit_m;
  report.file = raw.file;
  report.mesh_vertices = raw.vertices.size();
  report.mesh_faces = raw.faces.size();
  report.timing.read_s = watch.lap();
  std::string why;
  std::optional<std::size_t> planes;  // along which a solid with many reflex edges is cut
  if (part.kind != PartKind::kSurface) {
    PartReport solid = report;
    // The other laws need depths: what keeps the part from being a solid is what must be repaired.
    const bool must = part.kind == PartKind::kSolid || scene.parameters.law != LawId::kProxy;
    try {
      result.shape = compile_solid(source, part, scene, options, tell, solid);
      report = std::move(solid);
      return result;
    } catch (const SizeError&) {
      throw;
    } catch (const ReflexLimitError& refusal) {
      if (must) throw;
      why = defect_of(refusal.what(), raw.file);
      if (!options.max_reflex && refusal.edges <= kMostTriedReflex) planes = refusal.planes;
    } catch (const InputError& refusal) {
      if (must) throw;
      why = defect_of(refusal.what(), raw.file);
    }
  }
  PartReport solid = report;
  const bool is_cut_apart = options.disjoint || part.disjoint;
  if (part.kind != PartKind::kSurface && is_cut_apart) {
    report.warnings.push_back("a surface part has no solids to cut apart");
  }
  result.shape =
      compile_surface(source, why, tolerance_of(part, options), options.flat_share, tell, report);
  if (!planes) return result;
  KindCost cost = cost_of_kinds(*planes + 1, report.surface->facets, scene);
  const char* about = "about ";
  if (cost.solid < cost.surface) {
    CompileOptions more = options;
    more.max_reflex = kMostTriedReflex;
    if (!more.work_limit) more.work_limit = kTriedWork;
    try {
      WrittenPart written = compile_solid(source, part, scene, more, tell, solid);
      cost = cost_of_kinds(solid.pieces.size(), report.surface->facets, scene);
      about = "";
      if (cost.solid < cost.surface) {
        solid.reason += "; " + cost_text(cost, about);
        result.shape = std::move(written);
        report = std::move(solid);
        return result;
      }
    } catch (const InputError& refusal) {
      report.reason += "; cutting: " + defect_of(refusal.what(), raw.file);
    }
  }
  report.reason += "; " + cost_text(cost, about);
  return result;
}

/// Radius of the moving part about its grip.
double radius_about(const PlacedBody& placed, const std::array<double, 3>& grip_m) {
  double square = 0.0;
  for (const ConvexPiece& piece : placed.body.pieces) {
    for (const auto& v : piece.vertices) {
      double s = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = v[k] + (placed.mesh_origin_m[k] - grip_m[k]);
        s += x * x;
      }
      square = std::max(square, s);
    }
  }
  return std::sqrt(square);
}

/// Sets the coefficients of a static part against the moving one, with a note where there should be
/// some.
void set_friction(const SceneFile& scene, const ScenePart& part, PlacedBody& placed,
                  std::vector<std::string>& notes) {
  const auto pair = friction_of(scene.friction, scene.moving.material, part.material);
  const auto named = [](const ScenePart& p) {
    return p.material.empty() ? p.mesh + " without material" : p.mesh + " of " + p.material;
  };
  const bool any =
      !scene.friction.empty() || !part.material.empty() || !scene.moving.material.empty();
  if (!pair && any) {
    notes.push_back("no [[friction]] between " + named(scene.moving) + " and " + named(part) +
                    ": coefficient 0");
  }
  const FrictionPair friction = pair.value_or(FrictionPair{});
  if (friction.mu_static > 0.0 && scene.parameters.law != LawId::kProxy) {
    notes.push_back("friction of " + part.mesh + " is not rendered by this law; law proxy does");
  }
  placed.friction = friction.mu;
  placed.friction_static = friction.mu_static;
}

/// Sizes that the proxy law does not serve are refused, a raised tolerance is noted.
void check_size(const SceneFile& scene, const SceneView& view, std::vector<std::string>& notes) {
  if (scene.parameters.law != LawId::kProxy) return;
  const ServedSize size = served_size(view);
  const std::string refusal = size_refusal(size);
  if (!refusal.empty()) throw InputError(scene.file + ": " + refusal);
  if (size.floored) {
    notes.push_back("the coordinates' rounding raises the tolerance of law proxy to " +
                    short_length(size.tolerance_m));
  }
}

/// Surfaces have no depth: only law proxy renders them.
void check_law(const SceneFile& scene, const std::vector<CompiledPart>& parts) {
  if (scene.parameters.law == LawId::kProxy) return;
  for (const CompiledPart& part : parts) {
    if (!part.report.is_surface()) continue;
    throw InputError(part.report.file + ": surface: " + part.report.reason + ": law " +
                     law_name(scene.parameters.law) +
                     " needs the depth in a solid; give law = \"proxy\", or repair the mesh");
  }
}

/// Two shapes that fit into each other keep half of what is between them.
void check_clearances(const SceneFile& scene, const CompileOptions& options) {
  for (std::size_t i = 0; i < scene.statics.size(); ++i) {
    const ScenePart& fixed = scene.statics[i];
    if (!scene.moving.shape || !fixed.shape) continue;
    const auto clearance_m = least_clearance_m(*scene.moving.shape, *fixed.shape);
    if (!clearance_m) continue;
    for (const ScenePart* part : {&scene.moving, &fixed}) {
      const double tolerance_m = tolerance_of(*part, options).value_or(0.0);
      if (!(tolerance_m > 0.5 * *clearance_m)) continue;
      throw InputError(
          scene.file + ": " + part->mesh +
          formatted(": tolerance_m %.9g is more than half of the clearance of %.3g m between %s "
                    "and %s; give tolerance_m below %.3g, or leave it out",
                    tolerance_m, *clearance_m, scene.moving.mesh.c_str(), fixed.mesh.c_str(),
                    0.5 * *clearance_m));
    }
  }
}

StartShape start_shape_of(const CompiledPart& part, const ScenePart& placed) {
  const StartPose pose{placed.position_m, placed.quaternion_wxyz};
  StartShape shape;
  if (const auto* surface = std::get_if<SurfacePart>(&part.shape)) {
    shape = start_shape(*surface, *part.report.surface, pose);
  } else {
    const PlacedBody& solid = std::get<WrittenPart>(part.shape).placed;
    shape = start_shape(solid.body, solid.mesh_origin_m, pose);
  }
  shape.mesh = part.report.mesh;
  return shape;
}

/// About the box round the mesh, where the part starts.
PartBall ball_of(const StartShape& shape) {
  PartBall ball{shape.mesh, {0, 0, 0}, 0};
  if (shape.triangles.empty()) return ball;
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const TriangleCorners& triangle : shape.triangles) {
    for (const auto& corner : triangle) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], corner[k]);
        high[k] = std::max(high[k], corner[k]);
      }
    }
  }
  double square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    ball.middle_m[k] = 0.5 * (low[k] + high[k]);
    square += (high[k] - low[k]) * (high[k] - low[k]);
  }
  ball.radius_m = 0.5 * std::sqrt(square);
  return ball;
}

/// A start in collision is refused where a surface is involved, and warned of between solids.
void check_start(const SceneFile& scene, std::vector<CompiledPart>& parts) {
  std::vector<StartShape> fixed;
  for (std::size_t i = 0; i < scene.statics.size(); ++i) {
    fixed.push_back(start_shape_of(parts[i + 1], scene.statics[i]));
  }
  const StartShape moving = start_shape_of(parts[0], scene.moving);
  std::vector<PartBall> balls;
  for (const StartShape& shape : fixed) balls.push_back(ball_of(shape));
  const std::string far = far_start_text(ball_of(moving), balls);
  if (!far.empty()) parts[0].report.warnings.push_back(far);
  for (CompiledPart& part : parts) {
    const std::string odd = odd_size_text(part.report.diagonal_m);
    if (!odd.empty()) part.report.warnings.push_back(odd);
  }
  const auto found = start_collision(moving, fixed);
  if (!found) return;
  const std::string text =
      start_collision_text(*found, fixed[found->fixed], scene.moving.position_m);
  if (found->free_move_m) throw InputError(scene.file + ": " + scene.moving.mesh + ": " + text);
  parts[0].report.warnings.push_back(text);
}

/// The core holds the part inside the scene's limits: a hand that begins at a start outside them
/// pulls at a part that cannot come, and feels nothing. A warning and no refusal, for a motion of
/// its own need not begin there.
void warn_of_start_limits(const SceneView& view, PartReport& moving) {
  const SceneParameters& p = view.parameters();
  const double* const q = p.start_q_wa_xyzw;
  const Eigen::Quaterniond q_wa(q[3], q[0], q[1], q[2]);
  const Eigen::Vector3d grip_w =
      Eigen::Vector3d(p.start_p_wa_m) + q_wa * Eigen::Vector3d(view.bodies()[0].reference_m);
  const PlanPose start{{grip_w[0], grip_w[1], grip_w[2]}, {q[3], q[0], q[1], q[2]}};
  const std::string left = PlanLimits(p.envelope).left_by(start);
  if (left.empty()) return;
  moving.warnings.push_back(
      "the start pose lies outside the scene's limits, and a hand that "
      "begins there feels nothing: " +
      left + "; move the start inside, or widen the limit");
}

std::size_t pieces_of(const PartReport& report) {
  return report.surface ? report.surface->facets : report.pieces.size();
}

ProposalPart proposal_part(const ScenePart& part, const PartReport& report,
                           const SceneFile& scene) {
  ProposalPart out;
  out.pieces = pieces_of(report);
  out.diagonal_m = report.diagonal_m;
  if (!report.surface) return out;
  const PartMesh source = read_part_mesh(part, scene.file);
  SurfaceOptions options;
  options.scale_to_m = source.scale_to_m;
  options.merge = false;
  options.count_crossings = false;
  SurfaceAccount account;
  out.mesh = triangle_mesh(make_surface_part(source.mesh, options, &account));
  out.weld_radius_m = account.weld_radius_m;
  out.closed = account.tight;
  return out;
}

/// A note on the dearest pair of parts with a surface, where contact all over exceeds the budget.
void add_contact_cost(const SceneFile& scene, const CompileOptions& options, const SceneView& view,
                      CompiledScene& result) {
  const SceneParameters p = view.parameters();
  if (p.law != LawId::kProxy) return;
  const std::size_t moving = pieces_of(result.parts[0]);
  std::size_t dearest = 0;
  for (std::size_t i = 1; i < result.parts.size(); ++i) {
    if (!result.parts[0].is_surface() && !result.parts[i].is_surface()) continue;
    if (dearest == 0 || pieces_of(result.parts[i]) > pieces_of(result.parts[dearest])) dearest = i;
  }
  if (dearest == 0) return;
  const PartReport& fixed = result.parts[dearest];
  const std::uint32_t passes = p.coupling.passes;
  const TickBudget budget{double{1} * p.work_units,
                          double{1} * work_units_at(p.rate_hz, 0, 0, 0, true)};
  const double units = budget.least_units();
  if (contact_cost(moving, pieces_of(fixed), passes).units <= units) return;
  std::optional<ToleranceProposal> proposal;
  if (options.propose_tolerance) {
    const ScenePart& with = scene.statics[dearest - 1];
    std::optional<double> clearance_m;
    if (scene.moving.shape && with.shape) {
      clearance_m = least_clearance_m(*scene.moving.shape, *with.shape);
    }
    proposal = propose_tolerance(
        proposal_part(scene.moving, result.parts[0], scene), proposal_part(with, fixed, scene),
        passes, units, clearance_m ? 0.5 * *clearance_m : std::numeric_limits<double>::infinity(),
        [&](double fraction) {
          if (options.progress) options.progress(scene.name, "trying tolerances", fraction);
        });
  }
  result.notes.push_back(contact_cost_text(result.parts[0].mesh, fixed.mesh, moving,
                                           pieces_of(fixed), passes, budget,
                                           options.propose_tolerance, proposal));
}

/// Notes on faces of fixed parts that are almost in one plane: real steps first, the highest first.
void add_flush_notes(const SceneFile& scene, const SceneView& view,
                     const std::vector<PieceExposure>& exposure, std::vector<std::string>& notes) {
  if (scene.parameters.law != LawId::kProxy) return;
  constexpr std::size_t kMostTold = 6;
  constexpr double kUsualClimb_m = 5e-6;  // told of by, where none is climbed
  const ProxyScale scale = proxy_scale(view);
  const auto climb_m = static_cast<double>(scale.climb_m);
  std::vector<FlushStep> steps =
      flush_steps(view, exposure, static_cast<double>(scale.tolerance_m),
                  kToldClimbs * (climb_m > 0.0 ? climb_m : kUsualClimb_m));
  // A part that moves too stands beside a fixed one for a moment.
  std::erase_if(steps, [&](const FlushStep& step) {
    const auto moves = [&](std::size_t body) {
      const PartRole role = scene.statics[body - 1].role;
      return role == PartRole::kDriven || role == PartRole::kHand2 || role == PartRole::kLoose;
    };
    return step.body != step.other && (moves(step.body) || moves(step.other));
  });
  std::ranges::stable_sort(steps, std::ranges::greater{}, &FlushStep::height_m);
  for (std::size_t k = 0; k < std::min(steps.size(), kMostTold); ++k) {
    const FlushStep& step = steps[k];
    notes.push_back(flush_step_text(step, scene.statics[step.body - 1].mesh,
                                    scene.statics[step.other - 1].mesh, climb_m));
  }
  if (steps.size() > kMostTold) {
    notes.push_back("and " + grouped(steps.size() - kMostTold) +
                    " more pairs of fixed parts with lower steps between flush faces");
  }
}

SizedPart sized_part(const ScenePart& part, const PartReport& report) {
  SizedPart sized{part.mesh, report.diagonal_m, {}};
  const auto& [x, y, z] = part.scale_to_m;
  const bool states_unit = part.shape || part.link || import_format_of(part.path);
  if (!states_unit && x == y && y == z) sized.scale_to_m = x;
  return sized;
}

/// Notes on fixed parts whose file seems to be in another unit than that of the moving part.
void add_unit_notes(const SceneFile& scene, CompiledScene& result) {
  const SizedPart moving = sized_part(scene.moving, result.parts[0]);
  for (std::size_t i = 0; i < scene.statics.size(); ++i) {
    if (!scene.moving.path.empty() && scene.statics[i].path == scene.moving.path) continue;
    const SizedPart fixed = sized_part(scene.statics[i], result.parts[i + 1]);
    if (!moving.scale_to_m && !fixed.scale_to_m) continue;
    const std::string text = odd_sizes_text(moving, fixed);
    if (!text.empty()) result.notes.push_back(text);
  }
}

/// The part for the scene writer, at the pose of `placed`. A facet has no seam.
WrittenPart written_part(CompiledPart part, const ScenePart& placed, const PartReport& report) {
  WrittenPart written;
  if (auto* solid = std::get_if<WrittenPart>(&part.shape)) {
    written = std::move(*solid);
  } else {
    written.placed.body = surface_body(std::get<SurfacePart>(part.shape), body_name(placed));
    written.exposure.resize(written.placed.body.pieces.size());
    if (report.collapsed && report.collapsed->changed()) {
      written.placed.simplified = {report.collapsed->hausdorff_m(), 0.0};
    }
  }
  written.placed.position_m = placed.position_m;
  written.placed.quaternion_wxyz = placed.quaternion_wxyz;
  return written;
}

}  // namespace

namespace {

/// It has a scene in which it is the moving body. Part 0 is the moving one.
bool may_hold(const SceneFile& scene, std::size_t part) {
  const PartRole role = numbered_part(scene, part).role;
  return part == 0 || role == PartRole::kPlaced || role == PartRole::kHand2 ||
         role == PartRole::kLoose;
}

HeldPart part_of(const ScenePart& part) {
  HeldPart held;
  held.role = part.role;
  const std::array<double, 4>& q = part.quaternion_wxyz;
  for (int k = 0; k < 3; ++k) held.start.p_wa_m[k] = part.position_m[static_cast<std::size_t>(k)];
  for (int k = 0; k < 4; ++k) held.start.q_wa_xyzw[k] = q[static_cast<std::size_t>(k + 1) % 4];
  return held;
}

/// Both are loose and differ by name, place and what leads them alone.
bool are_alike(const ScenePart& one, const ScenePart& other) {
  return one.role == PartRole::kLoose && other.role == PartRole::kLoose && one.mesh == other.mesh &&
         one.path == other.path && one.shape == other.shape && one.link == other.link &&
         one.link_frame == other.link_frame && one.node == other.node && one.given == other.given &&
         one.scale_to_m == other.scale_to_m && one.material == other.material &&
         one.deflection_m == other.deflection_m && one.tolerance_m == other.tolerance_m &&
         one.disjoint == other.disjoint && one.kind == other.kind;
}

/// The parts of a scene file as they were compiled, the moving one first: each once, whichever of
/// them is held, and loose ones that are alike once.
class CompiledParts {
 public:
  CompiledParts(const SceneFile& scene, const CompileOptions& options) {
    for (std::size_t k = 0; k <= scene.statics.size(); ++k)
      if (may_hold(scene, k))
        check_clearances(scene_holding(scene, k, parts_met(scene, k)), options);
    MeshFiles files;
    for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
      const ScenePart& part = numbered_part(scene, k);
      std::size_t first = 0;
      while (first < k && !are_alike(numbered_part(scene, first), part)) ++first;
      first_alike_.push_back(first);
      parts_.push_back(first < k ? parts_[first] : compile_part(part, scene, options, files));
    }
  }
  /// All, the moving one first.
  [[nodiscard]] const std::vector<CompiledPart>& all() const { return parts_; }
  /// The first part of the same shape: a scene of that is one of this too, but for its start.
  [[nodiscard]] std::size_t first_alike(std::size_t part) const { return first_alike_[part]; }
  /// Those of scene_holding(scene, part, others), in their order.
  [[nodiscard]] std::vector<CompiledPart> holding(std::size_t part,
                                                  const std::vector<std::size_t>& others) const {
    std::vector<CompiledPart> parts{parts_[part]};
    for (const std::size_t other : others) parts.push_back(parts_[other]);
    return parts;
  }

 private:
  std::vector<CompiledPart> parts_;
  std::vector<std::size_t> first_alike_;
};

/// @param parts  those of `scene`, the moving one first; its law and its start have been checked.
CompiledScene compiled_with(const SceneFile& scene, std::vector<CompiledPart> parts,
                            const CompileOptions& options) {
  CompiledScene result;
  result.scene = scene;
  SceneDescription description;
  description.name = scene.name;
  description.parameters = scene.parameters;
  description.graph_bytes = scene.graph_bytes.value_or(kDefaultGraphBytes);
  description.max_pair_visits = scene.budget.pair_visits.value_or(kDefaultPairVisits);
  description.orientation = scene.orientation;
  description.workspace = scene.workspace;
  description.prune = options.prune;

  if (options.for_questions) {
    result.start_shapes.push_back(start_shape_of(parts[0], scene.moving));
    for (std::size_t i = 0; i < scene.statics.size(); ++i)
      result.start_shapes.push_back(start_shape_of(parts[i + 1], scene.statics[i]));
  }
  for (CompiledPart& part : parts) {
    add_new(result.notes, part.notes);
    result.parts.push_back(std::move(part.report));
  }
  add_unit_notes(scene, result);

  WrittenPart moving = written_part(std::move(parts[0]), scene.moving, result.parts[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    // Default grip: the centre of volume, which the body gives about its own origin.
    description.grip_m[k] = scene.moving.grip_m ? (*scene.moving.grip_m)[k]
                                                : moving.placed.body.centre_of_volume_m[k] +
                                                      moving.placed.mesh_origin_m[k];
  }
  description.moving = std::move(moving.placed);
  description.exposure = std::move(moving.exposure);
  double exposure_s = moving.exposure_s;
  const double radius_m = radius_about(description.moving, description.grip_m);
  const std::string far_grip = far_grip_text(radius_m, result.parts[0].diagonal_m);
  if (!far_grip.empty()) result.parts[0].warnings.push_back(far_grip);
  CouplingChoice choice =
      choose_coupling(scene.parameters, scene.coupling, radius_m, scene.never_turns(), scene.file);
  description.parameters.coupling = choice.coupling;
  description.parameters.coupling.near_pairs = scene.budget.near_pairs.value_or(0);
  // First, for what is rendered is not what the file asks for.
  result.notes.insert(result.notes.begin(), choice.notes.begin(), choice.notes.end());
  for (std::size_t i = 0; i < scene.statics.size(); ++i) {
    const ScenePart& part = scene.statics[i];
    WrittenPart fixed = written_part(std::move(parts[i + 1]), part, result.parts[i + 1]);
    set_friction(scene, part, fixed.placed, result.notes);
    if (scene.moving.shape && part.shape) {
      append(result.parts[i + 1].warnings,
             fit_warnings(*scene.moving.shape, *part.shape, "[moving] " + scene.moving.mesh,
                          "[[static]] " + part.mesh));
    }
    description.statics.push_back(std::move(fixed.placed));
    append(description.exposure, fixed.exposure);
    exposure_s += fixed.exposure_s;
  }
  result.pruning = prune_scene(description);
  result.pruning.exposure_ms = 1e3 * exposure_s;
  Stopwatch watch;
  const auto tell = [&](double fraction) {
    if (options.progress) options.progress(scene.name, "bounding the search", fraction);
  };
  result.bytes = write_scene(description, &result.account, tell);
  if (scene.guide) {
    // A plan is a proof about the scene without it.
    const SceneBytes without{result.bytes};
    SceneView planned;
    if (SceneView::open(without.span(), planned) != RtStatus::kOk) {
      throw std::logic_error("the scene just written does not open");
    }
    description.guide = make_guide(*scene.guide, planned, scene.file, result.notes);
    result.bytes = write_scene(description, &result.account, tell);
  }
  result.write_s = watch.lap();
  const SceneBytes aligned{result.bytes};
  SceneView view;
  if (SceneView::open(aligned.span(), view) != RtStatus::kOk) {
    throw std::logic_error("the scene just written does not open");
  }
  warn_of_start_limits(view, result.parts[0]);
  check_budgets(scene, view, options.image);
  check_size(scene, view, result.notes);
  add_flush_notes(scene, view, description.exposure, result.notes);
  add_contact_cost(scene, options, view, result);
  if (options.progress) options.progress(scene.name, "sampling the steady work", 0.0);
  result.steady = steady_work(view);
  return result;
}

/// The scene of a part that is held says what is to be said of that part against the others.
void take_warnings(const CompiledScene& held, std::size_t part,
                   const std::vector<std::size_t>& others, CompiledScene& result) {
  add_new(result.parts[part].warnings, held.parts[0].warnings);
  for (std::size_t k = 0; k < others.size(); ++k)
    add_new(result.parts[others[k]].warnings, held.parts[k + 1].warnings);
  add_new(result.notes, held.notes);
}

/// The scene in which `part` moves, seen from driven part `driven`, which alone stands there.
SceneFile scene_of_pair(const SceneFile& scene, std::size_t part, std::size_t driven) {
  SceneFile pair = scene_holding(scene, part, {driven});
  ScenePart &a = pair.moving, &b = pair.statics[0];
  const auto turn_of = [](const ScenePart& p) {
    const std::array<double, 4>& q = p.quaternion_wxyz;
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  };
  // R_B^T (x_A - x_B) and R_B^T R_A.
  const Eigen::Quaterniond back = turn_of(b).conjugate();
  const Eigen::Quaterniond q = back * turn_of(a);
  const Eigen::Vector3d p =
      back * (Eigen::Vector3d(a.position_m.data()) - Eigen::Vector3d(b.position_m.data()));
  a.position_m = {p[0], p[1], p[2]};
  a.quaternion_wxyz = {q.w(), q.x(), q.y(), q.z()};
  b.position_m = {0, 0, 0};
  b.quaternion_wxyz = {1, 0, 0, 0};
  return pair;
}

/// Largest force of the spring that leads a driven part, where that of the hand pulls with `pull_n`
/// at most; 0: that one has no limit.
double push_of(const SceneFile& scene, const ScenePart& part, double pull_n) {
  constexpr double kPulls = 10, kPush_n = 100;
  const DrivenRequest& driven = part.driven;
  if (!driven.push_n) return pull_n > 0 ? kPulls * pull_n : kPush_n;
  if (*driven.push_n > pull_n) return *driven.push_n;
  throw InputError(scene.file + ":" + std::to_string(driven.push_at.line) + ":" +
                   std::to_string(driven.push_at.column) +
                   formatted(": [[part]] push_n: is %.9g N, and the hand's spring pulls with up to "
                             "%.9g N ([device] max_force_n), so that the hand would push '%s' "
                             "back; give more than that, or leave it out for %.9g N",
                             *driven.push_n, pull_n, part.name.c_str(), kPulls * pull_n));
}

/// The spring of a loose part: one that holds its anchor, or one that its weight stretches by the
/// way that it sinks in a tick.
void lead_loose(const LooseRequest& loose, const SceneParameters& hand, DrivenRecord& record) {
  record.fastest_m_per_s = loose.fall_m_per_s;
  record.fastest_rad_per_s = 1;
  record.late_s = 1 / hand.rate_hz;
  if (loose.weight_n) {
    record.lead = Lead::kWeight;
    record.push_n = *loose.weight_n;
    record.ratio = record.push_n / (loose.fall_m_per_s * record.late_s) / hand.coupling.k_t_n_per_m;
  } else {
    record.lead = Lead::kAnchor;
    record.push_n = loose.yield_n.value_or(kDefaultYield_n);
    record.ratio = kLooseRatio;
  }
}

/// The box and the radius of a mover in its mesh frame, and what the scene says of it. `hand`: of
/// the scene in which the first part is held.
DrivenRecord driven_record(const SceneFile& scene, std::size_t part, const CompiledPart& compiled,
                           const SceneParameters& hand) {
  const ScenePart& driven = numbered_part(scene, part);
  const PlacedBody placed = written_part(compiled, driven, compiled.report).placed;
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const ConvexPiece& piece : placed.body.pieces) {
    for (const auto& v : piece.vertices) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], v[k] + placed.mesh_origin_m[k]);
        high[k] = std::max(high[k], v[k] + placed.mesh_origin_m[k]);
      }
    }
  }
  DrivenRecord record{};
  record.part = static_cast<std::uint32_t>(part);
  if (driven.role == PartRole::kLoose) {
    lead_loose(driven.loose, hand, record);
  } else {
    record.fastest_m_per_s = driven.driven.fastest_m_per_s;
    record.fastest_rad_per_s = driven.driven.fastest_rad_per_s;
    record.late_s = driven.driven.late_s;
    record.push_n = push_of(scene, driven, hand.coupling.max_pull_n);
    record.ratio = kDrivenRatio;
  }
  // A loose part is turned about its grip point, for it moves in scenes of its own.
  std::array<double, 3> middle_m{};
  for (std::size_t k = 0; k < 3; ++k) {
    const bool is_loose = driven.role == PartRole::kLoose;
    middle_m[k] = is_loose ? placed.body.centre_of_volume_m[k] + placed.mesh_origin_m[k]
                           : 0.5 * (low[k] + high[k]);
    record.middle_m[k] = middle_m[k];
  }
  // Rounded up, for the scene has its vertices in Real.
  constexpr double kRounding = 8 * static_cast<double>(std::numeric_limits<Real>::epsilon());
  record.radius_m = (1 + kRounding) * radius_about(placed, middle_m);
  return record;
}

/// Those of the scene as it was written: with what the hand's spring comes to.
SceneParameters parameters_of(const CompiledScene& scene) {
  const SceneBytes bytes{scene.bytes};
  SceneView view;
  if (SceneView::open(bytes.span(), view) != RtStatus::kOk)
    throw std::logic_error("the scene just written does not open");
  return view.parameters();
}

/// `part` and `other` have a scene of the two, in which `part` is A: the smaller one, but what is
/// driven, which has no such scene of its own. Two driven parts have none.
bool is_a_of_pair(const SceneFile& scene, const CompiledParts& parts, std::size_t part,
                  std::size_t other) {
  const auto role = [&](std::size_t k) { return numbered_part(scene, k).role; };
  const auto moves = [&](std::size_t k) {
    return role(k) == PartRole::kDriven || role(k) == PartRole::kLoose ||
           (k < 2 && scene.has_second_hand());
  };
  if (role(part) == PartRole::kDriven) return false;
  if (role(other) == PartRole::kDriven) return true;
  if (!moves(other) && role(part) != PartRole::kLoose) return false;
  if (!moves(other) && other != 0) return false;
  const auto size_m = [&](std::size_t k) { return parts.all()[k].report.diagonal_m; };
  return part < other ? size_m(part) <= size_m(other) : size_m(part) < size_m(other);
}

/// Scenes of two parts, by the first that are alike.
using PairScenes = std::map<std::pair<std::size_t, std::size_t>, std::vector<std::byte>>;

/// The scenes in which `part` may be held: that of the parts that stand, and one with each that it
/// may meet and that moves too. `all`: those of the parts before it. `result` is the scene around,
/// which takes the warnings.
void compile_held(const SceneFile& scene, const CompiledParts& parts, std::size_t part,
                  const CompileOptions& options, PairScenes& known, std::vector<HeldPart>& all,
                  CompiledScene& result) {
  HeldPart& held = all[part];
  const HeldPart& alike = all[parts.first_alike(part)];
  const std::vector<std::size_t> met = parts_met(scene, part);
  const std::vector<std::size_t> others = parts_standing(scene, part);
  held.others.assign(others.begin(), others.end());
  if (part == 0 && others.size() == scene.statics.size()) {
    held.scene = result.bytes;
  } else {
    std::vector<CompiledPart> among = parts.holding(part, met);
    check_start(scene_holding(scene, part, met), among);
    add_new(result.parts[part].warnings, among[0].report.warnings);
    if (&alike != &held && alike.others == held.others) {
      held.scene = alike.scene;
    } else {
      const CompiledScene standing =
          compiled_with(scene_holding(scene, part, others), parts.holding(part, others), options);
      take_warnings(standing, part, others, result);
      held.scene = standing.bytes;
    }
  }
  for (const std::size_t other : met) {
    if (!is_a_of_pair(scene, parts, part, other)) continue;
    std::vector<std::byte>& bytes = known[{parts.first_alike(part), parts.first_alike(other)}];
    if (bytes.empty()) {
      const std::vector<std::size_t> alone{other};
      const CompiledScene pair =
          compiled_with(scene_of_pair(scene, part, other), parts.holding(part, alone), options);
      take_warnings(pair, part, alone, result);
      bytes = pair.bytes;
    }
    held.pairs.push_back({static_cast<std::uint32_t>(other), bytes});
  }
}

/// The scene of the part that is held at first, against all others; and in it those of the parts
/// that may be held, each against those that it may meet.
CompiledScene compiled_with_parts(const SceneFile& given, const CompileOptions& options) {
  const CompiledParts parts(given, options);
  SceneFile scene = given;
  std::string laid;
  if (scene.assembled) {
    std::vector<PartBall> balls;
    for (std::size_t k = 0; k <= scene.statics.size(); ++k)
      balls.push_back(ball_of(start_shape_of(parts.all()[k], numbered_part(scene, k))));
    laid = lay_apart(scene, balls);
  }
  check_law(scene, parts.all());
  std::vector<CompiledPart> all = parts.all();
  check_start(scene, all);
  CompiledScene result = compiled_with(scene, std::move(all), options);
  if (!laid.empty()) result.notes.insert(result.notes.begin(), laid);
  if (!scene.has_parts()) return result;
  const SceneParameters hand = parameters_of(result);
  std::vector<DrivenRecord> driven;
  for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
    const PartRole role = numbered_part(scene, k).role;
    if (role == PartRole::kDriven || role == PartRole::kLoose)
      driven.push_back(driven_record(scene, k, parts.all()[k], hand));
  }
  std::vector<HeldPart> held;
  PairScenes known;
  for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
    held.push_back(part_of(numbered_part(scene, k)));
    if (may_hold(scene, k)) compile_held(scene, parts, k, options, known, held, result);
  }
  result.bytes = with_parts(result.bytes, held, driven);
  add_stages(result);
  return result;
}

}  // namespace

CompiledScene compile_scene(const SceneFile& scene, const CompileOptions& options) {
  // A merged facet is flat to within the rounding of its part's size. Near the origin of its body
  // coordinates round by less, so that it may not be flat to within that: then fewer are merged.
  constexpr int kMostTries = 4;
  constexpr double kLess = 1.0 / 16;
  Stopwatch total;
  CompileOptions tried = options;
  for (int k = 1;; ++k, tried.flat_share *= kLess) {
    try {
      CompiledScene result = compiled_with_parts(scene, tried);
      result.total_s = total.lap();
      return result;
    } catch (const FacetNotFlat&) {
      if (k == kMostTries) throw;
    }
  }
}

}  // namespace haptic::tools
