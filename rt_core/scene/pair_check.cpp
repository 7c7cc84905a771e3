// SPDX-License-Identifier: Apache-2.0
// The pairs of a blob: their place among the pieces, their graphs where stored, their capacities
// and the bounds in the header.
#include <algorithm>

#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/graph_limits.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {
namespace {

/// The stored neighbor list of every node is exactly the G-neighbors of the paper's Appendix,
/// ascending.
RtStatus check_graph(const PairView& pair, const NodeNumbering& n, std::uint64_t arc_count,
                     bool wide) noexcept {
  const PairRecord& r = *pair.record;
  std::uint32_t max_degree = 0;
  for (std::uint32_t node = 0; node < r.node_count; ++node) {
    const std::uint32_t begin = pair.neighbors.begin[node], end = pair.neighbors.begin[node + 1];
    if (begin > end || end > arc_count) return RtStatus::kBlobBadIndex;
    const auto [type, i, j] = node_features(pair, node);
    const NodeRecord& record = pair.nodes[node];
    if (record.a != i || record.b != j) return RtStatus::kBlobBadGraph;
    if (end > begin && pair.neighbors.at(node, end - begin - 1) >= r.node_count) {
      return RtStatus::kBlobBadIndex;
    }
    for (std::uint32_t k = 0; k + 1 < end - begin; ++k) {
      if (pair.neighbors.at(node, k) >= pair.neighbors.at(node, k + 1))
        return RtStatus::kBlobBadGraph;
    }
    std::uint32_t found = 0, generated = 0;
    for_each_neighbor(pair.a, pair.b, type, i, j, [&](std::uint32_t neighbor) {
      generated += 1;
      std::uint32_t low = 0, high = end - begin;
      while (low < high) {
        const std::uint32_t middle = low + (high - low) / 2;
        if (pair.neighbors.at(node, middle) < neighbor) {
          low = middle + 1;
        } else {
          high = middle;
        }
      }
      if (low < end - begin && pair.neighbors.at(node, low) == neighbor) found += 1;
    });
    if (generated != end - begin || found != generated) return RtStatus::kBlobBadGraph;
    const KeepRange keep = keep_range(n, type, i, generated,
                                      [&](std::uint32_t k) { return pair.neighbors.at(node, k); });
    if (record.keep_begin != keep.begin || record.keep_count != keep.count)
      return RtStatus::kBlobBadGraph;
    max_degree = std::max(max_degree, generated);
  }
  if (!wide && r.node_count > 65536) return RtStatus::kBlobBadCount;
  return max_degree == r.max_degree ? RtStatus::kOk : RtStatus::kBlobBadCapacity;
}

}  // namespace

RtStatus SceneView::check_pair(std::uint32_t index, std::uint64_t& stored_nodes) const noexcept {
  const PairRecord& r = pairs_[index];
  const std::uint32_t moving = bodies_[0].piece_count;
  const auto statics = static_cast<std::uint32_t>(pieces_.size()) - moving;
  if (pairs_.size() != std::uint64_t{moving} * statics) return RtStatus::kBlobBadCount;
  if (r.piece_a != index / statics || r.piece_b != moving + index % statics)
    return RtStatus::kBlobBadIndex;
  const PieceView a = piece(r.piece_a), b = piece(r.piece_b);
  const NodeNumbering n = numbering(a, b);
  if (r.node_count != n.count() || r.node_count_a != n.count_a() || r.node_count_b != n.count_b() ||
      r.reserved != 0) {
    return RtStatus::kBlobBadCount;
  }
  if (r.node_begin != kGraphNotStored) {
    if (r.node_begin != stored_nodes) return RtStatus::kBlobBadCount;
    stored_nodes += r.node_count;
    if (stored_nodes > nodes_.size() || stored_nodes >= neighbor_begin_.size())
      return RtStatus::kBlobBadCount;
    if (neighbor_begin_[0] != 0) return RtStatus::kBlobBadIndex;
    const RtStatus status = check_graph(pair(index), n, neighbor_count_, neighbors_wide_);
    if (status != RtStatus::kOk) return status;
  }
  if (index + 1 == pairs_.size() &&
      (stored_nodes != nodes_.size() || stored_nodes + 1 != neighbor_begin_.size() ||
       neighbor_begin_[stored_nodes] != neighbor_count_)) {
    return RtStatus::kBlobBadCount;
  }
  const LargestFeatures largest_a = largest_features(a), largest_b = largest_features(b);
  const bool capacities =
      r.max_degree == largest_degree(largest_a, largest_b) &&
      r.near_capacity == near_capacity(r.node_count, largest_a.face, largest_b.face) &&
      r.edge_pair_capacity == edge_pair_capacity(a.edge_count, b.edge_count);
  return capacities ? RtStatus::kOk : RtStatus::kBlobBadCapacity;
}

RtStatus SceneView::check_capacity() const noexcept {
  const SceneCapacity& stated = header_->capacity;
  const auto most_visits = static_cast<std::uint32_t>(std::max<std::size_t>(1, pairs_.size()));
  if (stated.max_pair_visits < 1 || stated.max_pair_visits > most_visits)
    return RtStatus::kBlobBadCapacity;
  const SceneCapacity needed =
      scene_capacity(bodies_, pieces_, pairs_, stated.max_pair_visits, proxy_passes(parameters()));
  const bool equal = stated.moving_lanes == needed.moving_lanes &&
                     stated.pair_count == needed.pair_count &&
                     stated.total_features == needed.total_features &&
                     stated.largest_pair_features == needed.largest_pair_features &&
                     stated.largest_near == needed.largest_near &&
                     stated.max_support_pairs == needed.max_support_pairs &&
                     stated.max_feature_evaluations == needed.max_feature_evaluations &&
                     stated.max_edge_pairs == needed.max_edge_pairs &&
                     stated.max_near_nodes == needed.max_near_nodes &&
                     stated.max_hull_points == needed.max_hull_points &&
                     stated.max_plane_gaps == needed.max_plane_gaps &&
                     stated.max_valid_nodes == needed.max_valid_nodes &&
                     stated.max_full_searches == needed.max_full_searches && stated.reserved == 0 &&
                     stated.unproven == needed.unproven;
  return equal ? RtStatus::kOk : RtStatus::kBlobBadCapacity;
}

}  // namespace haptic
