// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where to cut: reflex edges, candidate planes, their order and score, and the component-wise
/// recursion (METHOD section 5).

#include <map>
#include <memory>

#include "tools/graph_compiler/polyhedron/split.hpp"

namespace haptic::tools {

/// An edge with more than a half turn of solid around it: faces f (that has u -> v) and g (that has
/// v -> u) of the part. `touching`: more than two faces meet in the edge; parts of the solid meet
/// in it alone and must come apart.
struct ReflexEdge {
  std::uint32_t u = 0;
  std::uint32_t v = 0;
  std::size_t f = 0;
  std::size_t g = 0;
  bool touching = false;
};

/// Reflex edges of a canonical solid, in a fixed order. None: the solid is a piece.
std::vector<ReflexEdge> reflex_edges(ExactWorld& world, const Solid& solid);

/// Where a candidate plane comes from; bits, so that a strategy can name several.
enum CutKind : unsigned {
  kFacePlane = 1,     ///< the plane of a face at a reflex edge
  kSharingMitre = 2,  ///< spanned by two reflex edges that share a corner
  kParallelMitre = 4  ///< spanned by two parallel reflex edges
};

/// One fixed way to choose cuts. `seed` 0: no jitter.
struct CutStrategy {
  double alpha = 1.0;
  unsigned kinds = kFacePlane | kSharingMitre | kParallelMitre;
  std::uint64_t seed = 0;
  double jitter = 0.0;  ///< largest random addition to a score
};

/// Thrown when one strategy passes the piece limit.
class PieceLimitReached : public std::runtime_error {
 public:
  explicit PieceLimitReached(std::size_t limit)
      : std::runtime_error("more than " + std::to_string(limit) + " pieces") {}
};

/// Cuts one solid into convex pieces by any number of strategies; parts and cuts that strategies
/// have in common are computed once.
class Cutter {
 public:
  /// @param thin  distance [local units] below which a cut next to a corner is avoided
  Cutter(ExactWorld& world, double thin);

  /// Canonical convex pieces of a solid given as its connected parts (canonical), unmerged.
  /// @throws WorkLimitReached, PieceLimitReached, BrokenChain (no plane resolves a reflex edge)
  std::vector<Solid> cut(const std::vector<Solid>& parts, const CutStrategy& strategy,
                         std::size_t max_pieces);

 private:
  using PartIndex = std::size_t;
  struct Candidate {
    std::uint32_t plane = 0;
    unsigned kind = 0;
    double rank = 0.0;
  };
  struct Part {
    Solid solid;
    std::vector<ReflexEdge> reflex;
    std::size_t plane_pairs =
        0;  ///< distinct pairs of planes at reflex edges: a groove cut in two counts once
    bool ranked = false;
    std::vector<Candidate> candidates;
    std::map<std::uint32_t, std::vector<PartIndex>> cuts;  ///< by plane; empty: it does not cut
  };

  PartIndex intern(Solid solid);
  void find_candidates(Part& part);
  void add_mitre_planes(const Part& part, std::map<std::uint32_t, unsigned>& planes);
  bool spans_solid(const Part& part, const ReflexEdge& edge, std::uint32_t plane);
  bool may_span_solid(const Part& part, const ReflexEdge& edge,
                      const std::array<double, 3>& n) const;
  void add_mitre_plane(const Part& part, const ReflexEdge& a, const ReflexEdge& b,
                       std::uint32_t third, unsigned kind,
                       std::map<std::uint32_t, unsigned>& planes);
  double rank(const Part& part, std::uint32_t plane, const std::vector<std::uint32_t>& vertices);
  const std::vector<PartIndex>& apply(PartIndex index, std::uint32_t plane);
  const std::vector<PartIndex>& best_cut(PartIndex index, const CutStrategy& strategy);

  ExactWorld& world_;
  Splitter splitter_;
  double thin_;
  std::vector<std::unique_ptr<Part>> parts_;
  std::unordered_multimap<std::size_t, PartIndex> lookup_;  ///< never iterated
};

}  // namespace haptic::tools
