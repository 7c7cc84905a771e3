// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/polyhedron/chain.hpp"
#include "tools/graph_compiler/polyhedron/components.hpp"
#include "tools/graph_compiler/polyhedron/cuts.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"
#include "tools/graph_compiler/polyhedron/measure.hpp"
#include "tools/graph_compiler/polyhedron/merge.hpp"
#include "tools/graph_compiler/polyhedron/separation.hpp"
#include "tools/graph_compiler/polyhedron/split.hpp"

namespace haptic::tools {
namespace {

/// Cuts `chunk` by the planes of `tool` one after another: what lies outside of one of them is
/// kept, what is inside of all of them is removed.
void subtract_piece(ExactWorld& world, Splitter& splitter, Solid chunk, const Solid& tool,
                    std::vector<Solid>& kept, std::vector<Solid>& removed) {
  for (const ExactFace& face : tool.faces) {
    std::optional<Halves> halves = splitter.split(chunk, face.plane);
    if (!halves) {
      // All on one side: outside, and so kept whole, or inside of this plane.
      const std::vector<std::uint32_t> vertices = vertices_of(chunk);
      const bool outside = std::any_of(vertices.begin(), vertices.end(), [&](std::uint32_t v) {
        return face.sign * world.side(v, face.plane) > 0;
      });
      if (!outside) continue;
      kept.push_back(std::move(chunk));
      return;
    }
    std::vector<Solid>& out = face.sign > 0 ? halves->above : halves->below;
    std::vector<Solid>& in = face.sign > 0 ? halves->below : halves->above;
    for (Solid& part : out) kept.push_back(std::move(part));
    if (in.size() != 1) throw BrokenChain("a convex piece was cut in more than two");
    chunk = std::move(in[0]);
  }
  removed.push_back(std::move(chunk));
}

// Which face of the user's file each facet of a piece comes from.

using Point = std::array<double, 3>;

// Sample points inside a convex facet: its middle, and nine tenths of the way from there to each
// corner.
std::vector<Point> samples(const ExactWorld& world, const ExactFace& face) {
  Point middle{0.0, 0.0, 0.0};
  for (const auto& edge : face.edges) {
    for (std::size_t i = 0; i < 3; ++i) {
      middle[i] += world.vertices[edge.first].x_approx[i] / static_cast<double>(face.edges.size());
    }
  }
  std::vector<Point> points{middle};
  for (const auto& edge : face.edges) {
    Point p;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = middle[i] + 0.9 * (world.vertices[edge.first].x_approx[i] - middle[i]);
    }
    points.push_back(p);
  }
  return points;
}

bool inside(const ExactWorld& world, const ExactFace& face, const Point& point) {
  const Point& n = world.planes[face.plane].unit_normal;
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(n[i]) > std::abs(n[axis])) axis = i;
  }
  const std::size_t first = (axis + 1) % 3;
  const std::size_t second = (axis + 2) % 3;
  int winding = 0;
  for (const auto& [u, v] : face.edges) {
    const Point& a = world.vertices[u].x_approx;
    const Point& b = world.vertices[v].x_approx;
    const double turn = (a[first] - point[first]) * (b[second] - point[second]) -
                        (a[second] - point[second]) * (b[first] - point[first]);
    if (a[second] <= point[second] && b[second] > point[second] && turn > 0.0) ++winding;
    if (b[second] <= point[second] && a[second] > point[second] && turn < 0.0) --winding;
  }
  return winding != 0;
}

/// Sets ExactFace::source_face of every facet: the face of its solid that it shares area with, -1
/// if a cut made all of it. For messages and reports only, so sample points in double are enough.
void find_source_faces(const ExactWorld& world, const std::vector<FlatSolid>& solids,
                       std::vector<Solid>& pieces, const std::vector<std::uint32_t>& piece_solid) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (ExactFace& facet : pieces[i].faces) {
      facet.source_face = -1;
      const std::vector<Point> points = samples(world, facet);
      for (const ExactFace& face : solids[piece_solid[i]].solid.faces) {
        if (face.plane != facet.plane || face.sign != facet.sign) continue;
        bool shared = false;
        for (const Point& p : points) shared = shared || inside(world, face, p);
        if (shared && (facet.source_face < 0 || face.source_face < facet.source_face)) {
          facet.source_face = face.source_face;
        }
      }
    }
  }
}

// A piece or a cut closer to a corner than this part of the diagonal is called thin.
constexpr double kThinRelative = 1.0e-5;

constexpr unsigned kAllKinds = kFacePlane | kSharingMitre | kParallelMitre;
constexpr unsigned kSharingKinds = kFacePlane | kSharingMitre;

// The fixed ways to choose cuts, the most successful first; the second measures what face planes
// alone reach. The jitter reorders cuts whose scores differ by less than about one piece.
constexpr std::array<CutStrategy, 12> kStrategies{{
    {0.5, kAllKinds, 0, 0.0},
    {0.5, kFacePlane, 0, 0.0},
    {1.0, kAllKinds, 0, 0.0},
    {0.75, kSharingKinds, 0, 0.0},
    {0.3, kAllKinds, 11, 0.6},
    {0.5, kAllKinds, 12, 1.2},
    {1.0, kSharingKinds, 13, 0.6},
    {0.75, kAllKinds, 14, 1.2},
    {0.5, kFacePlane, 15, 0.6},
    {0.5, kSharingKinds, 16, 1.2},
    {1.0, kAllKinds, 17, 2.0},
    {0.3, kFacePlane, 18, 1.2},
}};

struct Attempt {
  std::vector<Solid> pieces;
  std::size_t strategy = 0;
};

struct SolidResult {
  std::vector<Solid> pieces;
  std::size_t face_plane_only = 0;
};

std::string format(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// Centre of a solid in the file frame, for messages.
std::string place(const ExactWorld& world, const Solid& solid) {
  std::array<double, 3> sum{0.0, 0.0, 0.0};
  const std::vector<std::uint32_t> vertices = vertices_of(solid);
  for (const std::uint32_t v : vertices) {
    for (std::size_t i = 0; i < 3; ++i) sum[i] += world.vertices[v].x_approx[i];
  }
  std::string text = "(";
  for (std::size_t i = 0; i < 3; ++i) {
    const double mean = vertices.empty() ? 0.0 : sum[i] / static_cast<double>(vertices.size());
    const double at = mean / world.scale + world.centre_m[i];
    // A thousandth of a per cent of the part's size is plenty; the rest is rounding around zero.
    text += format(std::abs(at) < 1.0e-5 / world.scale ? 0.0 : at) + (i < 2 ? ", " : ")");
  }
  return text;
}

/// Decomposes the solids of one body, one after another.
class Decomposer {
 public:
  Decomposer(FlatBody& body, const std::string& file, const DecompositionLimits& limits,
             const Progress& progress)
      : body_(body),
        world_(body.world),
        file_(file),
        limits_(limits),
        progress_(progress),
        start_work_(body.world.work) {}

  Decomposition run() {
    std::size_t face_plane_only = 0;
    for (std::uint32_t s = 0; s < body_.solids.size(); ++s) {
      SolidResult solid = decompose_solid(s);
      face_plane_only += solid.face_plane_only;
      for (Solid& piece : solid.pieces) {
        result_.pieces.push_back(std::move(piece));
        result_.piece_solid.push_back(s);
      }
    }
    if (result_.pieces.empty())
      throw InputError(file_ + ": no solid to decompose; the file holds no closed surface");
    if (result_.pieces.size() > limits_.max_pieces) refuse_pieces("the body");
    result_.face_plane_only_pieces = face_plane_only;
    result_.certificate = certify(world_, body_.solids, result_.pieces, result_.piece_solid);
    if (!result_.certificate.holds()) refuse_certificate("the body", result_.certificate);
    if (result_.certificate.cover && limits_.disjoint) {
      cut_apart();
    } else if (result_.certificate.cover) {
      warn_of_overlaps();
    }
    find_source_faces(world_, body_.solids, result_.pieces, result_.piece_solid);
    find_thinnest();
    result_.work = world_.work - start_work_;
    return std::move(result_);
  }

 private:
  [[nodiscard]] std::string name_of(std::uint32_t s) const {
    return "solid " + std::to_string(s + 1) + " of " + std::to_string(body_.solids.size()) +
           " near " + place(world_, body_.solids[s].solid) + " m";
  }

  [[noreturn]] void refuse_pieces(const std::string& what) const {
    throw LimitError(file_ + ": " + what + " needs more than " +
                     std::to_string(limits_.max_pieces) +
                     " convex pieces, the limit; --simplify DISTANCE, or raise --max-pieces");
  }

  [[noreturn]] void refuse_certificate(const std::string& what, const Certificate& c) const {
    std::string failed;
    if (!c.convex) failed += " a piece is not convex;";
    if (!c.partition)
      failed += " " + std::to_string(c.nonzero_counts) + " boundary counts are not zero;";
    if (c.convex && !c.disjoint) failed += " pieces of one solid overlap;";
    if (!c.volume_equal) failed += " volumes differ;";
    throw InputError(
        file_ + ": " + what + ": the pieces do not prove to be the part:" + failed +
        " a surface that passes through itself must be repaired in the CAD program; if it "
        "does not, this is an internal error: please report it with the file");
  }

  // The connected parts of the solid. Throws InputError where it is none.
  std::vector<Solid> prepare(std::uint32_t s) {
    try {
      Solid boundary = body_.solids[s].solid;
      Splitter(world_).subdivide_touching_edges(boundary);
      normalise(boundary);
      std::vector<Solid> parts = components(world_, boundary);
      if (parts.empty()) throw BrokenChain("the boundary encloses nothing");
      return parts;
    } catch (const BrokenChain& broken) {
      throw InputError(
          file_ + ": " + name_of(s) + ": " + broken.what() +
          "; the surface passes through itself or is open: repair it in the CAD program");
    }
  }

  SolidResult decompose_solid(std::uint32_t s) {
    std::vector<Attempt> attempts;
    SolidResult best;
    std::string trouble;
    try {
      const std::vector<Solid> parts = prepare(s);
      Cutter cutter(world_, kThinRelative * diagonal(world_, vertices_of(body_.solids[s].solid)));
      // Nothing has fewer pieces than one for each connected part, two where there is a reflex
      // edge.
      std::size_t least = 0;
      for (const Solid& part : parts) least += reflex_edges(world_, part).empty() ? 1U : 2U;
      const std::size_t count =
          std::min(kStrategies.size(), static_cast<std::size_t>(std::max(limits_.strategies, 1)));
      const double share = 1.0 / static_cast<double>(body_.solids.size());
      for (std::size_t k = 0; k < count; ++k) {
        if (progress_) progress_(share * (s + static_cast<double>(k) / static_cast<double>(count)));
        try {
          std::vector<Solid> pieces = cutter.cut(parts, kStrategies[k], limits_.max_pieces);
          pieces = merge_pieces(world_, std::move(pieces));
          if (kStrategies[k].kinds == kFacePlane &&
              (best.face_plane_only == 0 || pieces.size() < best.face_plane_only)) {
            best.face_plane_only = pieces.size();
          }
          attempts.push_back({std::move(pieces), k});
        } catch (const PieceLimitReached&) {
          trouble = "pieces";
        } catch (const BrokenChain& broken) {
          trouble = broken.what();
        }
        if (!attempts.empty() && attempts.back().pieces.size() <= least) break;
      }
    } catch (const WorkLimitReached& limit) {
      if (attempts.empty()) {
        throw LimitError(
            file_ + ": " + name_of(s) + ": " + limit.what() + " (" +
            std::to_string(body_.reflex_edge_count) +
            " reflex edges) before a first decomposition was complete; --simplify DISTANCE, or "
            "raise --work-limit");
      }
      result_.warnings.push_back(file_ + ": " + name_of(s) + ": " + limit.what() + " after " +
                                 std::to_string(attempts.size()) +
                                 " strategies; the best result so far is used");
    }
    if (attempts.empty()) {
      if (trouble == "pieces") refuse_pieces(name_of(s));
      throw InputError(file_ + ": " + name_of(s) + ": " + trouble +
                       "; a surface that passes through itself or through another of the same "
                       "solid, such as a cavity given twice, must be repaired in the CAD program; "
                       "if none does, this is an internal error: please report it with the file");
    }
    best.pieces = first_certified(s, attempts);
    if (best.face_plane_only == 0) best.face_plane_only = best.pieces.size();
    return best;
  }

  // Fewest pieces first, then the order of the strategies.
  std::vector<Solid> first_certified(std::uint32_t s, std::vector<Attempt>& attempts) {
    std::stable_sort(attempts.begin(), attempts.end(), [](const Attempt& a, const Attempt& b) {
      return a.pieces.size() < b.pieces.size();
    });
    Certificate last;
    const std::vector<FlatSolid> alone{body_.solids[s]};
    for (Attempt& attempt : attempts) {
      last = certify(world_, alone, attempt.pieces,
                     std::vector<std::uint32_t>(attempt.pieces.size(), 0));
      if (last.holds()) return std::move(attempt.pieces);
    }
    refuse_certificate(name_of(s), last);
  }

  // Certified as a cover before; what is cut is certified again.
  void cut_apart() {
    DisjointPieces apart;
    try {
      apart = make_disjoint(world_, result_.pieces, result_.piece_solid);
    } catch (const WorkLimitReached& limit) {
      throw LimitError(file_ + ": " + limit.what() +
                       " while overlapping solids were cut apart; compile without --disjoint, or "
                       "raise --work-limit");
    }
    if (apart.pieces.size() > limits_.max_pieces) refuse_pieces("the body, cut apart,");
    result_.certificate = certify(world_, body_.solids, apart.pieces, apart.piece_solid, &apart);
    result_.certificate.cover = false;
    if (!result_.certificate.holds()) refuse_certificate("the body", result_.certificate);
    result_.pieces = std::move(apart.pieces);
    result_.piece_solid = std::move(apart.piece_solid);
  }

  void warn_of_overlaps() {
    std::vector<PieceHull> hulls(result_.pieces.begin(), result_.pieces.end());
    std::set<std::pair<std::uint32_t, std::uint32_t>> overlaps;
    for (std::size_t i = 0; i < hulls.size(); ++i) {
      for (std::size_t k = i + 1; k < hulls.size(); ++k) {
        const std::pair pair(result_.piece_solid[i], result_.piece_solid[k]);
        if (pair.first == pair.second || overlaps.contains(pair)) continue;
        if (separated(world_, result_.pieces[i], hulls[i], result_.pieces[k], hulls[k])) continue;
        overlaps.insert(pair);
      }
    }
    std::string pairs;
    for (const auto& [a, b] : overlaps) {
      pairs +=
          (pairs.empty() ? "" : ", ") + std::to_string(a + 1) + " and " + std::to_string(b + 1);
    }
    result_.warnings.push_back(
        file_ + ": solids overlap (" + pairs +
        "): their pieces are used as a cover of the union; the volume counts "
        "common parts once for every solid; --disjoint cuts them apart");
  }

  void find_thinnest() {
    double body_diagonal = 0.0;
    for (const FlatSolid& solid : body_.solids) {
      body_diagonal = std::max(body_diagonal, diagonal(world_, vertices_of(solid.solid)));
    }
    double least = std::numeric_limits<double>::infinity();
    const Solid* thinnest = nullptr;
    std::size_t thin = 0;
    for (const Solid& piece : result_.pieces) {
      const double width = thickness(world_, piece);
      if (width < kThinRelative * body_diagonal) ++thin;
      if (width < least) thinnest = &piece;
      least = std::min(least, width);
    }
    if (thin > 0) {
      const std::string others =
          thin > 1 ? " (" + std::to_string(thin - 1) + " more pieces are thin)" : "";
      result_.warnings.push_back(file_ + ": the piece near " + place(world_, *thinnest) +
                                 " m is only " + format(least / world_.scale) + " m thick" +
                                 others + ": two almost equal planes; raise the plane tolerance");
    }
    result_.thinnest_m = least / world_.scale;
  }

  FlatBody& body_;
  ExactWorld& world_;
  const std::string& file_;
  const DecompositionLimits& limits_;
  const Progress& progress_;
  double start_work_;
  Decomposition result_;
};

}  // namespace

DisjointPieces make_disjoint(ExactWorld& world, const std::vector<Solid>& pieces,
                             const std::vector<std::uint32_t>& piece_solid) {
  DisjointPieces out;
  Splitter splitter(world);
  for (std::size_t begin = 0; begin < pieces.size();) {
    std::size_t end = begin;
    while (end < pieces.size() && piece_solid[end] == piece_solid[begin]) ++end;
    std::vector<Solid> chunks(pieces.begin() + static_cast<std::ptrdiff_t>(begin),
                              pieces.begin() + static_cast<std::ptrdiff_t>(end));
    std::vector<Solid> removed;
    for (const Solid& tool : out.pieces) {
      const PieceHull tool_hull(tool);
      std::vector<Solid> left;
      for (Solid& chunk : chunks) {
        if (separated(world, chunk, PieceHull(chunk), tool, tool_hull)) {
          left.push_back(std::move(chunk));
        } else {
          subtract_piece(world, splitter, std::move(chunk), tool, left, removed);
        }
      }
      chunks = std::move(left);
    }
    for (Solid& piece : merge_pieces(world, std::move(chunks))) {
      out.pieces.push_back(std::move(piece));
      out.piece_solid.push_back(piece_solid[begin]);
    }
    for (Solid& part : removed) {
      out.removed.push_back(std::move(part));
      out.removed_solid.push_back(piece_solid[begin]);
    }
    begin = end;
  }
  return out;
}

Decomposition decompose(FlatBody& body, const std::string& file, const DecompositionLimits& limits,
                        const Progress& progress) {
  Decomposition result = Decomposer(body, file, limits, progress).run();
  if (progress) progress(1.0);
  return result;
}

}  // namespace haptic::tools
