// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/scene_pruning.hpp"

#include <algorithm>
#include <chrono>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/pruning/workspace_reach.hpp"

namespace haptic::tools {
namespace {

void append(std::vector<PieceShape>& to, std::vector<PieceShape> from) {
  std::move(from.begin(), from.end(), std::back_inserter(to));
}

void count_hidden(const std::vector<PieceShape>& shapes, PruningAccount& account) {
  const auto add = [](HiddenCount& count, const auto& open) {
    count.all += open.size();
    for (const auto& left : open) count.hidden += left.empty() ? 1u : 0u;
  };
  for (const PieceShape& shape : shapes) {
    add(account.faces, shape.open_faces);
    add(account.edges, shape.open_edges);
    add(account.vertices, shape.open_vertices);
  }
}

void count_pair(const PieceShape& a, const PieceShape& b, const PairMarks& marks,
                PruningAccount& account) {
  const PairCounts counts = count_nodes(a, b, marks);
  account.counts.nodes += counts.nodes;
  account.counts.reachable += counts.reachable;
  account.counts.open += counts.open;
  account.counts.live += counts.live;
  account.largest_pair_before = std::max(account.largest_pair_before, counts.nodes.all());
  account.largest_pair_after = std::max(account.largest_pair_after, counts.live.all());
  account.pairs += 1;
  account.pairs_out_of_reach += marks.near ? 0 : 1;
}

/// A plane separates as long as the depth behind it is within the tolerance of law proxy, of which
/// it takes up to 1.5; scenes with one above r_A / 1000 are refused.
constexpr double kToleranceShare = 2.0e-3;

/// Motion of one tick: 0 where no speed is given, the box then holds every pose there is.
/// `radius_m` of the whole moving part.
ReachLimits reach_limits(const SceneParameters& p, double radius_m) {
  double motion_m = 0.0;
  if (p.motion_limits_given != 0) {
    motion_m = (p.max_linear_speed_m_per_s + p.max_angular_speed_rad_per_s * radius_m) / p.rate_hz;
  }
  return {p.exact_band_m + motion_m, p.epsilon_m, p.epsilon_m + kToleranceShare * radius_m};
}

std::vector<NearCones> all_near_cones(const std::vector<PieceShape>& shapes, double epsilon_m) {
  std::vector<NearCones> result;
  for (const PieceShape& shape : shapes) result.push_back(near_cones(shape, epsilon_m));
  return result;
}

double radius_of(const std::vector<PieceShape>& moving) {
  double radius_m = 0.0;
  for (const PieceShape& shape : moving) {
    for (const auto& v : shape.vertices) radius_m = std::max(radius_m, vec::norm(v));
  }
  return radius_m;
}

}  // namespace

PruningAccount prune_scene(SceneDescription& description) {
  const auto begin = std::chrono::steady_clock::now();
  PruningAccount account;
  account.pruned = description.prune;
  description.marks.clear();
  if (!description.prune) description.exposure.clear();
  const auto envelope =
      description.prune ? description.orientation : std::optional<OrientationEnvelope>{};
  const PieceExposure* exposure =
      description.exposure.empty() ? nullptr : description.exposure.data();
  std::vector<PieceShape> moving =
      piece_shapes(description.moving, &description.grip_m, exposure, envelope);
  std::vector<PieceShape> fixed;
  for (const PlacedBody& body : description.statics) {
    append(fixed,
           piece_shapes(body, nullptr,
                        exposure == nullptr ? nullptr : exposure + moving.size() + fixed.size(),
                        envelope));
  }
  account.moving_pieces = moving.size();
  account.static_pieces = fixed.size();
  count_hidden(moving, account);
  count_hidden(fixed, account);
  for (const PieceExposure& piece : description.exposure) {
    account.partly_covered_faces += static_cast<std::size_t>(
        std::count_if(piece.face_fragments.begin(), piece.face_fragments.end(),
                      [](const auto& fragments) { return !fragments.empty(); }));
  }
  const ReachLimits limits = reach_limits(description.parameters, radius_of(moving));
  const auto confine = [&](const PieceShape& a, const PieceShape& b, PairMarks& marks) {
    if (!description.workspace || !description.prune) return;
    mark_workspace_reach(a, b, {*description.workspace, envelope}, limits, marks);
  };
  const std::vector<NearCones> near_fixed = all_near_cones(fixed, limits.epsilon_m);
  for (const PieceShape& a : moving) {
    const NearCones near_a = near_cones(a, limits.epsilon_m);
    for (std::size_t j = 0; j < fixed.size(); ++j) {
      const PieceShape& b = fixed[j];
      PairMarks touching = prune_pair(a, b, envelope);
      confine(a, b, touching);
      count_pair(a, b, touching, account);
      if (!description.prune) continue;
      PairMarks near = near_marks(a, b, near_a, near_fixed[j], envelope);
      confine(a, b, near);
      description.marks.push_back(std::move(near));
    }
  }
  const auto spent = std::chrono::steady_clock::now() - begin;
  account.marks_ms = std::chrono::duration<double, std::milli>(spent).count();
  return account;
}

}  // namespace haptic::tools
