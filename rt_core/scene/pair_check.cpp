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
  const PairRecord& r = pair.record;
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

/// No bit of a set of `bits` lies beyond it.
bool ends_clean(const std::uint64_t* set, std::uint64_t bits) noexcept {
  return bits % 64 == 0 || (set[bits / 64] >> (bits % 64)) == 0;
}

/// Live nodes are reachable, some node is not live, and each feature is marked as its nodes are,
/// reachable faces as live also without.
RtStatus check_marks(const PairView& pair) noexcept {
  const PairRecord& r = pair.record;
  const NodeMarks& m = pair.marks;
  const FeatureNumbering& features = m.features;
  const std::uint64_t* const set[4] = {m.words, m.words + m.node_words, m.words + 2 * m.node_words,
                                       m.words + 2 * m.node_words + m.feature_words};
  const std::uint64_t bits[4] = {r.node_count, r.node_count, features.count(), features.count()};
  for (int k = 0; k < 4; ++k) {
    if (!ends_clean(set[k], bits[k])) return RtStatus::kBlobBadGraph;
  }
  for (std::uint64_t w = 0; w < m.node_words; ++w) {
    if ((set[1][w] & ~set[0][w]) != 0) return RtStatus::kBlobBadGraph;
  }
  const std::uint64_t reachable = count_bits(set[0], 0, r.node_count);
  if (reachable == 0 || count_bits(set[1], 0, r.node_count) == r.node_count)
    return RtStatus::kBlobBadGraph;
  for (const NodeScope scope : {NodeScope::kReachable, NodeScope::kLive}) {
    const std::uint64_t* const nodes = set[scope == NodeScope::kLive ? 1 : 0];
    const NodeNumbering n = numbering(pair.a, pair.b);
    const auto agrees = [&](std::uint32_t feature, bool any) {
      return m.feature(scope, feature) == any;
    };
    const auto face_agrees = [&](std::uint32_t face, bool any) {
      return agrees(face, any) ||
             (scope == NodeScope::kLive && !any && m.feature(NodeScope::kReachable, face));
    };
    const auto any_in_row = [&](std::uint32_t begin, std::uint32_t count) {
      return count_bits(nodes, begin, std::uint64_t{begin} + count) > 0;
    };
    const auto any_in_column = [&](std::uint32_t begin, std::uint32_t rows, std::uint32_t step) {
      for (std::uint32_t k = 0; k < rows; ++k) {
        if (has_bit(nodes, begin + std::uint64_t{k} * step)) return true;
      }
      return false;
    };
    for (std::uint32_t f = 0; f < n.nfa; ++f) {
      if (!face_agrees(features.face_a(f), any_in_row(n.type_a(f, 0), n.nvb)))
        return RtStatus::kBlobBadGraph;
    }
    for (std::uint32_t e = 0; e < n.nea; ++e) {
      if (!agrees(features.edge_a(e), any_in_row(n.type_c(e, 0), n.neb)))
        return RtStatus::kBlobBadGraph;
    }
    for (std::uint32_t f = 0; f < n.nfb; ++f) {
      if (!face_agrees(features.face_b(f), any_in_column(n.type_b(0, f), n.nva, n.nfb)))
        return RtStatus::kBlobBadGraph;
    }
    for (std::uint32_t e = 0; e < n.neb; ++e) {
      if (!agrees(features.edge_b(e), any_in_column(n.type_c(0, e), n.nea, n.neb)))
        return RtStatus::kBlobBadGraph;
    }
  }
  return RtStatus::kOk;
}

}  // namespace

/// Pairs come in the order of their pieces, those of A first. All of them do but where a workspace
/// is given: then those that it never brings together are missing.
RtStatus SceneView::check_place(std::uint32_t index) const noexcept {
  const PairRecord& r = graph_.pairs[index];
  const std::uint32_t moving = bodies_[0].piece_count;
  const auto statics = static_cast<std::uint32_t>(tables_.pieces.size()) - moving;
  if ((parameters_->envelope.given & kWorkspaceGiven) == 0) {
    if (graph_.pairs.size() != std::uint64_t{moving} * statics) return RtStatus::kBlobBadCount;
    return r.piece_a == index / statics && r.piece_b == moving + index % statics
               ? RtStatus::kOk
               : RtStatus::kBlobBadIndex;
  }
  if (r.piece_a >= moving || r.piece_b < moving || r.piece_b >= tables_.pieces.size())
    return RtStatus::kBlobBadIndex;
  if (index == 0) return RtStatus::kOk;
  const PairRecord& before = graph_.pairs[index - 1];
  const bool ascends =
      before.piece_a < r.piece_a || (before.piece_a == r.piece_a && before.piece_b < r.piece_b);
  return ascends ? RtStatus::kOk : RtStatus::kBlobBadIndex;
}

RtStatus SceneView::check_pairs(SceneFault& fault) const noexcept {
  for (std::uint32_t i = 0; i < tables_.pieces.size(); ++i) {
    fault = {SectionId::kPieces, i};
    if (tables_.pieces[i].mark_begin != kNotMarked) return RtStatus::kBlobBadCount;
  }
  fault = {SectionId::kPairs, 0};
  if (graph_.pairs.empty()) return RtStatus::kBlobBadCount;
  std::uint64_t stored_nodes = 0, mark_words = 0;
  for (std::uint32_t i = 0; i < graph_.pairs.size(); ++i) {
    fault.index = i;
    const RtStatus status = check_pair(i, stored_nodes, mark_words);
    if (status != RtStatus::kOk) return status;
  }
  return RtStatus::kOk;
}

/// The pieces have all that a pair is formed from; of their marks each follows the one before, and
/// says that some feature is hidden.
RtStatus SceneView::check_formed_pairs(SceneFault& fault) const noexcept {
  fault = {SectionId::kPairs, 0};
  const std::uint32_t moving = bodies_[0].piece_count;
  if (!graph_.pairs.empty() || !graph_.nodes.empty() || graph_.neighbor_begin.size() != 1 ||
      graph_.neighbor_begin[0] != 0 || graph_.neighbor_count != 0) {
    return RtStatus::kBlobBadCount;
  }
  const PieceRecord a = largest_counts(tables_.pieces.first(moving));
  const PieceRecord b = largest_counts(tables_.pieces.subspan(moving));
  if (basic_contacts(a, b) >= kGraphNotStored) return RtStatus::kBlobBadCount;
  std::uint64_t words = 0;
  for (std::uint32_t i = 0; i < tables_.pieces.size(); ++i) {
    fault = {SectionId::kPieces, i};
    if (tables_.pieces[i].mark_begin == kNotMarked) continue;
    if (tables_.pieces[i].mark_begin != words) return RtStatus::kBlobBadCount;
    const std::uint64_t bits = feature_bits(tables_.pieces[i]);
    const std::uint64_t* const open = graph_.marks.data() + words;
    words += mark_words(bits);
    if (words > graph_.marks.size()) return RtStatus::kBlobBadCount;
    if (!ends_clean(open, bits) || count_bits(open, 0, bits) == bits)
      return RtStatus::kBlobBadGraph;
  }
  return words == graph_.marks.size() ? RtStatus::kOk : RtStatus::kBlobBadCount;
}

RtStatus SceneView::check_pair(std::uint32_t index, std::uint64_t& stored_nodes,
                               std::uint64_t& mark_words) const noexcept {
  const PairRecord& r = graph_.pairs[index];
  RtStatus status = check_place(index);
  if (status != RtStatus::kOk) return status;
  const PieceView a = piece(r.piece_a), b = piece(r.piece_b);
  const NodeNumbering n = numbering(a, b);
  if (r.node_count != n.count() || r.node_count_a != n.count_a() || r.node_count_b != n.count_b())
    return RtStatus::kBlobBadCount;
  if (r.mark_begin != kNotMarked) {
    // The lists of a stored graph are those of all nodes.
    if (r.mark_begin != mark_words || r.node_begin != kGraphNotStored)
      return RtStatus::kBlobBadCount;
    mark_words += marks_at(nullptr, r, *a.record, *b.record).word_count();
    if (mark_words > graph_.marks.size()) return RtStatus::kBlobBadCount;
    status = check_marks(pair(index));
    if (status != RtStatus::kOk) return status;
  }
  if (r.node_begin != kGraphNotStored) {
    if (r.node_begin != stored_nodes) return RtStatus::kBlobBadCount;
    stored_nodes += r.node_count;
    if (stored_nodes > graph_.nodes.size() || stored_nodes >= graph_.neighbor_begin.size())
      return RtStatus::kBlobBadCount;
    if (graph_.neighbor_begin[0] != 0) return RtStatus::kBlobBadIndex;
    status = check_graph(pair(index), n, graph_.neighbor_count, graph_.wide);
    if (status != RtStatus::kOk) return status;
  }
  if (index + 1 == graph_.pairs.size() &&
      (stored_nodes != graph_.nodes.size() || stored_nodes + 1 != graph_.neighbor_begin.size() ||
       graph_.neighbor_begin[static_cast<std::size_t>(stored_nodes)] != graph_.neighbor_count ||
       mark_words != graph_.marks.size())) {
    return RtStatus::kBlobBadCount;
  }
  const NodeMarks marks = pair(index).marks;
  const LiveCounts reachable = live_counts(marks, NodeScope::kReachable, r, *a.record, *b.record);
  const LiveCounts live = live_counts(marks, NodeScope::kLive, r, *a.record, *b.record);
  const LargestFeatures largest_a = largest_features(a), largest_b = largest_features(b);
  const bool capacities = r.max_degree == largest_degree(largest_a, largest_b) &&
                          r.near_capacity == near_capacity(static_cast<std::uint32_t>(live.nodes),
                                                           largest_a.face, largest_b.face) &&
                          r.edge_pair_capacity == edge_pair_capacity(reachable.edge_pairs);
  return capacities ? RtStatus::kOk : RtStatus::kBlobBadCapacity;
}

RtStatus SceneView::check_capacity() const noexcept {
  const SceneCapacity& stated = header_->capacity;
  const PairIndex most_visits = std::max(PairIndex{1}, pair_count());
  if (stated.max_pair_visits < 1 || stated.max_pair_visits > most_visits)
    return RtStatus::kBlobBadCapacity;
  SceneCapacity needed = scene_capacity(bodies_, tables_.pieces, graph_.pairs, graph_.marks,
                                        stated.max_pair_visits, parameters());
  needed.state_bytes = stated.state_bytes;  // HapticCore compares it with what it needs
  return stated == needed ? RtStatus::kOk : RtStatus::kBlobBadCapacity;
}

}  // namespace haptic
