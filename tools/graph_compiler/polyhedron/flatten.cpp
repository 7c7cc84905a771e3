// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/flatten.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/polyhedron/flatten_split.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"
#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {
namespace {

// From fitted planes and merged faces to the corners and planes that have to meet exactly, in
// local units.

/// Corners (equal positions are one corner, also across shells) and planes in local units.
struct CornerGraph {
  CornerPlaneGraph graph;
  std::vector<std::uint32_t> vertex_corner;  ///< per vertex of the surface; kNone: gone
  std::vector<std::uint32_t> corner_vertex;  ///< first vertex of each corner
};

constexpr double kParallelSine = 0.02;  // below: a wish would only tilt two almost equal planes

/// Adds the planes within the tolerance of a corner that they do not bound.
void add_wishes(const Surface& s, double scale, CornerPlaneGraph& graph) {
  const double tol = s.plane_tolerance_m * scale;
  for (std::uint32_t c = 0; c < graph.corners.size(); ++c) {
    const std::vector<std::uint32_t>& own = graph.corner_planes[c];
    for (std::uint32_t p = 0; p < graph.planes.size(); ++p) {
      const WantedPlane& plane = graph.planes[p];
      const double distance = std::abs(vec::dot(plane.normal, graph.corners[c]) - plane.offset);
      if (distance > tol || std::binary_search(own.begin(), own.end(), p)) continue;
      const bool parallel = std::any_of(own.begin(), own.end(), [&](std::uint32_t q) {
        return vec::norm(vec::cross(plane.normal, graph.planes[q].normal)) < kParallelSine;
      });
      if (!parallel) graph.wishes.push_back({c, p, distance});
    }
  }
}

/// Without wishes. @param scale  local units per metre.
CornerGraph build_graph(const Surface& s, const PlaneFit& fit, const MergedSurface& merged,
                        double scale) {
  CornerGraph out;
  out.vertex_corner.assign(s.vertices.size(), kNone);
  std::map<Point3, std::uint32_t> at_position;
  std::vector<bool> kept(s.vertices.size(), false);
  for (const MergedEdge& e : merged.edges) kept[e.u] = kept[e.v] = true;
  for (std::uint32_t v = 0; v < s.vertices.size(); ++v) {
    if (!kept[v]) continue;
    Point3 x = vec::scaled(s.vertices[v], scale);
    for (double& c : x) c += 0.0;  // -0 and +0 are one position
    const auto [it, fresh] =
        at_position.emplace(x, static_cast<std::uint32_t>(out.corner_vertex.size()));
    if (fresh) {
      out.corner_vertex.push_back(v);
      out.graph.corners.push_back(x);
      out.graph.corner_planes.emplace_back();
    }
    out.vertex_corner[v] = it->second;
    std::vector<std::uint32_t>& own = out.graph.corner_planes[it->second];
    own.insert(own.end(), merged.vertex_planes[v].begin(), merged.vertex_planes[v].end());
  }
  for (std::vector<std::uint32_t>& own : out.graph.corner_planes) {
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
  }
  for (const FittedPlane& p : fit.planes) {
    out.graph.planes.push_back(
        {p.normal, p.normal_tail, p.offset_m * scale, p.offset_tail_m * scale, p.axis});
  }
  return out;
}

constexpr double kCoincidentTolerances = 10.0;  // unmerged planes closer than this are reported
constexpr double kCleanResidual =
    0x1p-32;  // local units: below, the mesh carries more digits than the coarse grid
constexpr int kFineNormalBits = 56;
// Grids of normals where corners may move: this much finer than the movement, in bits, and no
// coarser than a bound that keeps like planes apart.
constexpr int kMoveGridBits = 12;
constexpr int kLeastNormalBits = 16;
constexpr int kOffsetGridBits = 4;
constexpr std::size_t kMaxComparedPlanes = 2000;

/// Largest movement of a corner [local units] and the corner; accurate because the difference is
/// taken exactly.
std::pair<double, std::uint32_t> largest_move(const CornerPlaneGraph& graph,
                                              const Realisation& real) {
  double largest = 0.0;
  std::uint32_t corner = 0;
  for (std::uint32_t c = 0; c < graph.corners.size(); ++c) {
    Point3 move{};
    for (std::size_t i = 0; i < 3; ++i) {
      move[i] = to_double(real.corners[c][i] - Rational(graph.corners[c][i]));
    }
    if (vec::norm(move) > largest) {
      largest = vec::norm(move);
      corner = c;
    }
  }
  return {largest, corner};
}

std::string face_names(const Surface& s, const PlaneFit& fit, const CornerPlaneGraph& graph,
                       const std::vector<std::uint32_t>& corners) {
  std::set<std::uint32_t> faces;
  for (const std::uint32_t c : corners) {
    for (const std::uint32_t p : graph.corner_planes[c]) {
      faces.insert(s.faces[fit.planes[p].widest_face].source_face + 1);
    }
  }
  std::string text;
  std::size_t count = 0;
  for (const std::uint32_t f : faces) {
    if (count++ == 6) break;
    text += (text.empty() ? "" : ", ") + std::to_string(f);
  }
  return text;
}

class Realiser {
 public:
  Realiser(const Surface& s, PlaneFit& fit, MergedSurface& merged, const CornerGraph& corners,
           double scale, const FlattenLimits& limits)
      : s_(s), fit_(fit), merged_(merged), corners_(corners), scale_(scale), limits_(limits) {}

  /// Tries from the most faithful to the most forgiving; throws the refusal of the last attempt.
  Realisation run() {
    const CornerPlaneGraph& graph = corners_.graph;
    Realisation real;
    if (realise_unmoved(graph, true, real) && real.largest_bits <= limits_.first_bits) return real;
    const RealiseRules fine = rules(true, limits_.first_bits);
    const RealiseRules coarse = rules(false, limits_.first_bits);
    if (is_clean() && accept(real = realise(graph, fine))) return real;
    if (accept(real = realise(graph, coarse))) return real;
    if (realise_unmoved(graph, false, real) && real.largest_bits <= limits_.max_bits) return real;
    if (may_move() && (realise_in_layers(limits_.first_bits, real) ||
                       realise_in_layers(limits_.max_bits, real))) {
      return real;
    }
    RealiseRules last = rules(false, limits_.max_bits);
    last.wishes = false;
    if (accept(real = realise(graph, last))) return real;
    Realisation split;
    if (realise_with_triangles(last, true, split) || realise_with_triangles(last, false, split)) {
      return split;
    }
    if (!may_move() && realise_in_layers(limits_.max_bits, split)) return split;
    refuse(real);
  }
  [[nodiscard]] std::size_t split_count() const { return split_count_; }

 private:
  [[nodiscard]] bool is_clean() const { return fit_.largest_residual_m * scale_ <= kCleanResidual; }
  [[nodiscard]] static RealiseRules rules(bool fine, std::size_t bits) {
    RealiseRules out;
    out.max_bits = bits;
    if (fine) {
      out.normal_bits = kFineNormalBits;
      out.position_bits = 0;
    }
    return out;
  }
  bool realise_with_triangles(const RealiseRules& rules, bool crowded_only, Realisation& real);
  bool realise_in_layers(std::size_t max_bits, Realisation& real);
  /// Corners have room to move: grids need be no finer than that, and faces may be split early.
  [[nodiscard]] bool may_move() const { return limits_.max_move_m.has_value(); }
  [[nodiscard]] bool accept(const Realisation& real) const {
    return real.outcome == RealiseOutcome::kDone &&
           largest_move(corners_.graph, real).first <= largest_allowed_move_m() * scale_;
  }
  [[nodiscard]] double largest_allowed_move_m() const {
    return limits_.max_move_m.value_or(kMoveTolerances * s_.plane_tolerance_m);
  }
  [[nodiscard]] Point3 place(std::uint32_t corner) const {
    return s_.vertices[corners_.corner_vertex[corner]];
  }
  [[noreturn]] void refuse(const Realisation& real) const;

  const Surface& s_;
  PlaneFit& fit_;
  MergedSurface& merged_;
  const CornerGraph& corners_;
  double scale_;
  const FlattenLimits& limits_;
  std::size_t split_count_ = 0;
};

/// Short chains of placements instead of the best conditioned ones: fewest bits, larger movements.
bool Realiser::realise_in_layers(std::size_t max_bits, Realisation& real) {
  RealiseRules layers = rules(false, max_bits);
  layers.wishes = false;
  layers.order = PeelOrder::kLayers;
  if (may_move()) {
    const int allowed = -std::ilogb(largest_allowed_move_m() * scale_);
    layers.normal_bits = std::clamp(allowed + kMoveGridBits, kLeastNormalBits, layers.normal_bits);
    layers.position_bits = std::min(layers.normal_bits + kOffsetGridBits, layers.position_bits);
  }
  if (accept(real = realise(corners_.graph, layers))) return true;
  return realise_with_triangles(layers, true, real) || realise_with_triangles(layers, false, real);
}

bool Realiser::realise_with_triangles(const RealiseRules& rules, bool crowded_only,
                                      Realisation& real) {
  const std::vector<LooseFace> loose =
      find_loose_faces(s_, fit_, merged_, corners_.vertex_corner, corners_.graph, crowded_only);
  if (loose.empty()) return false;
  const CornerPlaneGraph graph = without_faces(corners_.graph, merged_, loose);
  // Corners on a grid just below the tolerance: the two triangles then differ by a clear angle or
  // not at all. A fold of the size of a rounding would leave slivers without thickness where their
  // planes cut.
  RealiseRules on_grid = rules;
  on_grid.position_bits = std::clamp(2 - std::ilogb(s_.plane_tolerance_m * scale_), 4, 40);
  if (!accept(real = realise(graph, on_grid))) return false;
  PlaneFit fit = fit_;
  MergedSurface merged = merged_;
  bool ok = false;
  const std::size_t split = close_faces(loose, fit, merged, real, ok);
  if (!ok || real.largest_bits > rules.max_bits) return false;
  split_count_ = split;
  fit_ = std::move(fit);
  merged_ = std::move(merged);
  return true;
}

void Realiser::refuse(const Realisation& real) const {
  const Point3 near = real.failed_corners.empty() ? Point3{0, 0, 0} : place(real.failed_corners[0]);
  if (real.outcome == RealiseOutcome::kStuck) {
    throw InputError(s_.file + ": planes and corners near " + place_text(s_, near) +
                     " cannot all hold (" + std::to_string(real.stuck_count) +
                     " elements); split one of the faces " +
                     face_names(s_, fit_, corners_.graph, real.failed_corners) + " into triangles");
  }
  if (real.outcome == RealiseOutcome::kTooManyBits) {
    throw InputError(s_.file + ": coordinates need more than " + std::to_string(limits_.max_bits) +
                     " bits near " + place_text(s_, near) +
                     ": a curved strip; --simplify DISTANCE, or triangulate it in the source");
  }
  const auto [move, corner] = largest_move(corners_.graph, real);
  // Named: the plane that the given corner is farthest from.
  std::uint32_t worst = corners_.graph.corner_planes[corner][0];
  double worst_distance = -1.0;
  for (const std::uint32_t p : corners_.graph.corner_planes[corner]) {
    const WantedPlane& plane = corners_.graph.planes[p];
    const double distance =
        std::abs(vec::dot(plane.normal, corners_.graph.corners[corner]) - plane.offset);
    if (distance > worst_distance) worst_distance = distance, worst = p;
  }
  char text[160];
  std::snprintf(text, sizeof text,
                "face %u is not flat: corner would move by %.3g m (limit %.3g m)",
                s_.faces[fit_.planes[worst].widest_face].source_face + 1, move / scale_,
                largest_allowed_move_m());
  throw InputError(s_.file + ": at " + place_text(s_, place(corner)) + ": " + text +
                   "; split the face into triangles");
}

/// An edge that was shorter than the movement may have turned over: its face would cross itself.
void check_edges(const Surface& s, const MergedSurface& merged, const CornerGraph& corners,
                 const Realisation& real) {
  std::vector<Point3> x;
  for (const Rational3& c : real.corners)
    x.push_back({to_double(c[0]), to_double(c[1]), to_double(c[2])});
  for (const MergedEdge& e : merged.edges) {
    const Point3 before = vec::sub(s.vertices[e.v], s.vertices[e.u]);
    const Point3 after = vec::sub(x[corners.vertex_corner[e.v]], x[corners.vertex_corner[e.u]]);
    // Two vertices at one place are one corner.
    if (corners.vertex_corner[e.u] == corners.vertex_corner[e.v]) continue;
    if (!(vec::dot(before, after) > 0.0)) refuse_thin(s, s.vertices[e.u]);
  }
}

/// The exact world and the solids: planes, corners and chains through their final indices.
void assemble(const Surface& s, const PlaneFit& fit, const MergedSurface& merged,
              const CornerGraph& corners, const Realisation& real, FlatBody& body) {
  ExactWorld& world = body.world;
  std::vector<std::uint32_t> plane_index(fit.planes.size());
  std::vector<int> plane_sign(fit.planes.size(), 1);
  for (std::size_t p = 0; p < fit.planes.size(); ++p) {
    plane_index[p] = world.find_or_add_plane(real.normals[p], real.offsets[p], plane_sign[p]);
    // Placed normals are divided by their largest component: they may point against the fitted
    // ones.
    const Point3 n{to_double(real.normals[p][0]), to_double(real.normals[p][1]),
                   to_double(real.normals[p][2])};
    if (vec::dot(n, fit.planes[p].normal) < 0.0) plane_sign[p] = -plane_sign[p];
  }
  std::vector<std::uint32_t> corner_index(real.corners.size());
  for (std::size_t c = 0; c < real.corners.size(); ++c) {
    corner_index[c] = world.find_or_add_vertex(real.corners[c]);
    world.source_vertex[corner_index[c]] =
        static_cast<std::int64_t>(s.source_vertex[corners.corner_vertex[c]]);
  }
  using Key = std::tuple<std::uint32_t, std::uint32_t, int>;
  using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;
  std::map<Key, std::map<DirectedEdge, int>> chains;
  std::map<Key, std::uint32_t> widest;
  const auto add = [&](std::uint32_t face, std::uint32_t u, std::uint32_t v) {
    const MergedFace& f = merged.faces[face];
    const Key key{f.shell, plane_index[f.plane], f.sign * plane_sign[f.plane]};
    widest.emplace(key, f.widest_face);
    std::map<DirectedEdge, int>& chain = chains[key];
    if (const auto back = chain.find({v, u}); back != chain.end()) {
      if (--back->second == 0) chain.erase(back);
    } else {
      ++chain[{u, v}];
    }
  };
  for (const MergedEdge& e : merged.edges) {
    const std::uint32_t u = corner_index[corners.vertex_corner[e.u]];
    const std::uint32_t v = corner_index[corners.vertex_corner[e.v]];
    if (u == v) continue;
    add(e.left, u, v);
    add(e.right, v, u);
  }
  body.solids.resize(s.solid_count);
  for (std::uint32_t k = 0; k < s.shells.size(); ++k)
    body.solids.at(s.shells[k].solid).shells.push_back(k);
  for (const auto& [key, chain] : chains) {
    if (chain.empty()) continue;
    ExactFace face;
    face.plane = std::get<1>(key);
    face.sign = std::get<2>(key);
    face.source_face = static_cast<std::int64_t>(s.faces[widest.at(key)].source_face);
    for (const auto& [edge, count] : chain) {
      for (int k = 0; k < count; ++k) face.edges.push_back(edge);
    }
    body.solids[s.shells[std::get<0>(key)].solid].solid.faces.push_back(std::move(face));
  }
}

/// Planes that stayed apart although all vertices of one lie within ten tolerances of the other.
void warn_coincident(const Surface& s, const PlaneFit& fit, std::vector<std::string>& warnings) {
  if (fit.planes.size() > kMaxComparedPlanes) return;
  const double limit = kCoincidentTolerances * s.plane_tolerance_m;
  std::size_t count = 0;
  std::string first;
  for (std::size_t a = 0; a < fit.planes.size(); ++a) {
    for (std::size_t b = 0; b < fit.planes.size(); ++b) {
      const FittedPlane& large = fit.planes[a];
      const FittedPlane& small = fit.planes[b];
      if (a == b || 1.0 - std::abs(vec::dot(large.normal, small.normal)) > 1e-6) continue;
      double worst = 0.0;
      for (const std::uint32_t v : small.vertices) {
        worst = std::max(worst, std::abs(vec::dot(large.normal, s.vertices[v]) - large.offset_m));
        if (worst > limit) break;
      }
      if (worst > limit || count++ > 0) continue;
      char apart[48];
      std::snprintf(apart, sizeof apart, "%.3g m", worst);
      first = "faces " + std::to_string(s.faces[large.widest_face].source_face + 1) + " and " +
              std::to_string(s.faces[small.widest_face].source_face + 1) + ", " + apart +
              " apart near " + place_text(s, s.vertices[small.vertices[0]]);
    }
  }
  if (count > 0) {
    warnings.push_back(s.file + ": almost equal planes were not joined (" + first + ", " +
                       std::to_string(count) +
                       " such cases); a larger --plane-tolerance joins them");
  }
}

/// One warning for all pairs of shells with parallel faces that lie close and became two planes,
/// with the closest. Those that became one are no step any more.
void warn_close_shells(const Surface& s, const PlaneFit& fit, std::vector<std::string>& warnings) {
  if (s.close_faces.empty()) return;
  std::map<std::uint32_t, std::set<std::uint32_t>> planes_of;  // by face of the file
  for (std::uint32_t f = 0; f < s.faces.size(); ++f) {
    planes_of[s.faces[f].source_face].insert(fit.face_plane[f]);
  }
  const CloseFaces* closest = nullptr;
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const CloseFaces& c : s.close_faces) {
    if (planes_of[c.source_face] == planes_of[c.other_source_face]) continue;
    if (closest == nullptr || c.distance_m < closest->distance_m) closest = &c;
    pairs.insert(std::minmax(c.shell, c.other_shell));
  }
  if (closest == nullptr) return;
  std::string text = "shells " + std::to_string(closest->shell) + " and " +
                     std::to_string(closest->other_shell) +
                     formatted(" have parallel faces only %.3g m apart at ", closest->distance_m) +
                     place_text(s, closest->place) + " that are not merged";
  if (pairs.size() > 1) {
    text += "; the closest of " + std::to_string(pairs.size()) + " such pairs";
  }
  warnings.push_back(s.file + ": " + text);
}

/// Coordinates of few digits are taken as exact. That is said only where it matters: where planes
/// would be one if the last place were rounded.
void warn_few_digits(const Surface& s, std::size_t planes, std::vector<std::string>& warnings) {
  if (!(s.taken_as_exact_m > 0.0)) return;
  Surface rounded = s;
  rounded.plane_tolerance_m = kTolerancesOfPrint * s.taken_as_exact_m;
  const FaceNeighbors neighbors(rounded);
  const std::size_t fewer = fit_planes(rounded, neighbors).planes.size();
  if (fewer >= planes) return;
  warnings.push_back(s.file + ": " +
                     formatted("the coordinates have few digits (last place %.3g m) and are taken "
                               "as exact: %zu planes; rounded ones would have %zu; if they are "
                               "rounded, give --plane-tolerance %.3g",
                               s.taken_as_exact_m, planes, fewer, rounded.plane_tolerance_m));
}

}  // namespace

FlatBody flatten(const Surface& surface, const FlattenLimits& limits) {
  if (surface.faces.empty()) throw InputError(surface.file + ": no faces; give a closed mesh");
  const FaceNeighbors neighbors(surface);
  PlaneFit fit = fit_planes(surface, neighbors);
  const std::size_t planes = fit.planes.size();
  MergedSurface merged = merge_faces(surface, neighbors, fit);
  FlatBody body = flatten(surface, std::move(fit), std::move(merged), limits);
  warn_few_digits(surface, planes, body.warnings);
  return body;
}

FlatBody flatten(const Surface& surface, PlaneFit fit, MergedSurface merged,
                 const FlattenLimits& limits) {
  FlatBody body;
  body.reflex_edge_count = count_reflex(surface, fit, merged);
  if (body.reflex_edge_count > limits.max_reflex_edges) {
    throw ReflexLimitError(
        surface.file + ": " + std::to_string(body.reflex_edge_count) + " reflex edges, limit " +
            std::to_string(limits.max_reflex_edges) +
            ": too curved for an exact decomposition; --simplify DISTANCE removes bevels, fillets "
            "and small rounds, or raise --max-reflex (time grows about with its square)",
        body.reflex_edge_count, planes_through_reflex(surface, fit, merged));
  }
  body.world.centre_m = surface.centre_m;
  body.world.scale = std::ldexp(1.0, -std::ilogb(surface.diagonal_m));
  body.world.max_coordinate_bits = limits.max_bits;
  const double scale = body.world.scale;
  CornerGraph corners = build_graph(surface, fit, merged, scale);
  // Without reflex edges nothing will be cut, and no plane is ever extended.
  if (body.reflex_edge_count > 0) add_wishes(surface, scale, corners.graph);
  Realiser realiser(surface, fit, merged, corners, scale, limits);
  const Realisation real = realiser.run();
  check_edges(surface, merged, corners, real);
  assemble(surface, fit, merged, corners, real, body);
  const double moved = largest_move(corners.graph, real).first / scale;
  body.largest_bits = real.largest_bits;
  body.largest_move_m = std::max({moved, merged.largest_gone_m, fit.largest_residual_m});
  body.steps = {{"fit planes", fit.planes.size(), fit.largest_residual_m},
                {"merge coplanar faces", merged.vertices_gone, merged.largest_gone_m},
                {"realise corners", corners.graph.corners.size(), moved}};
  body.merged_plane_count = fit.planes.size();
  body.warnings = surface.warnings;
  warn_close_shells(surface, fit, body.warnings);
  if (realiser.split_count() > 0) {
    char text[200];
    std::snprintf(
        text, sizeof text,
        "%zu faces with four corners were split into triangles, and corners moved by up to %.3g m: "
        "the surface is curved there, and planes through four corners do not exist",
        realiser.split_count(), moved);
    body.warnings.push_back(surface.file + ": " + text);
  } else {
    warn_coincident(surface, fit, body.warnings);
  }
  return body;
}

}  // namespace haptic::tools
