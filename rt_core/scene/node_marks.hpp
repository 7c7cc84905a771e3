// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Marks of the basic contacts of one pair: which of them any pose of the scene's envelope can need
/// (reachable), and which of those can carry a force (live; the others lie where the part goes on
/// in another piece, and only ever separate). A face or edge is marked as any of its nodes is, and
/// a reachable face as live also where only nodes that are not reachable could carry a force: what
/// a search passes over must not depend on the envelope. In kNodeMarks a marked pair has four sets
/// of bits, each from a word of its own: reachable nodes, live nodes, reachable features, live
/// features. Features: faces of A, edges of A, faces of B, edges of B. Bits beyond a set are zero.
///
/// Where pairs are not listed (scene/formed_pairs.hpp) the marks are those of the pieces: a bit for
/// each face, edge and vertex that the other pieces of its body leave open. Every node is then
/// reachable, and live where both of its features are open.

#include <cstddef>
#include <cstdint>

#include "rt_core/scene/scene_format.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// Which nodes a search looks at.
enum class NodeScope : std::uint8_t { kReachable, kLive };

/// Words of a set of `bits`.
[[nodiscard]] constexpr std::uint64_t mark_words(std::uint64_t bits) noexcept {
  return (bits + 63) / 64;
}

/// Numbers of the features of a pair in its marks.
struct FeatureNumbering {
  std::uint32_t nfa, nea, nfb, neb;

  [[nodiscard]] constexpr std::uint32_t face_a(std::uint32_t f) const noexcept { return f; }
  [[nodiscard]] constexpr std::uint32_t edge_a(std::uint32_t e) const noexcept { return nfa + e; }
  [[nodiscard]] constexpr std::uint32_t face_b(std::uint32_t f) const noexcept {
    return nfa + nea + f;
  }
  [[nodiscard]] constexpr std::uint32_t edge_b(std::uint32_t e) const noexcept {
    return nfa + nea + nfb + e;
  }
  [[nodiscard]] constexpr std::uint32_t count() const noexcept { return nfa + nea + nfb + neb; }
};

[[nodiscard]] constexpr FeatureNumbering feature_numbering(const PieceRecord& a,
                                                           const PieceRecord& b) noexcept {
  return {a.face_count, a.edge_count, b.face_count, b.edge_count};
}

/// Bit `k` of a set.
[[nodiscard]] constexpr bool has_bit(const std::uint64_t* set, std::uint64_t k) noexcept {
  return (set[k / 64] >> (k % 64) & 1u) != 0;
}

/// The features of a piece that are open: a bit for each face, then edge, then vertex. Without
/// words all are.
struct PieceMarks {
  const std::uint64_t* words = nullptr;
  std::uint32_t faces = 0, edges = 0, vertices = 0;

  [[nodiscard]] constexpr bool face(std::uint32_t f) const noexcept { return open(f); }
  [[nodiscard]] constexpr bool edge(std::uint32_t e) const noexcept { return open(faces + e); }
  [[nodiscard]] constexpr bool vertex(std::uint32_t v) const noexcept {
    return open(faces + edges + v);
  }

 private:
  [[nodiscard]] constexpr bool open(std::uint32_t k) const noexcept {
    return words == nullptr || has_bit(words, k);
  }
};

[[nodiscard]] constexpr std::uint64_t feature_bits(const PieceRecord& piece) noexcept {
  return std::uint64_t{piece.face_count} + piece.edge_count + piece.vertex_count;
}

/// `words`: kNodeMarks.
[[nodiscard]] constexpr PieceMarks piece_marks(const std::uint64_t* words,
                                               const PieceRecord& piece) noexcept {
  return {piece.mark_begin == kNotMarked ? nullptr : words + piece.mark_begin, piece.face_count,
          piece.edge_count, piece.vertex_count};
}

/// The marks of one pair in place. Without any, every node and feature is reachable and live.
struct NodeMarks {
  const std::uint64_t* words = nullptr;  ///< of the pair; null: those of its pieces, if any
  std::uint64_t node_words = 0;
  std::uint64_t feature_words = 0;
  FeatureNumbering features{};
  PieceMarks a{}, b{};  ///< of the pieces of a pair that is not listed

  [[nodiscard]] constexpr bool given() const noexcept {
    return (words != nullptr || a.words != nullptr || b.words != nullptr);
  }
  [[nodiscard]] constexpr bool node(NodeScope scope, std::uint32_t number) const noexcept {
    if (!given()) return true;
    if (words == nullptr) return scope == NodeScope::kReachable || opens(number);
    return has_bit(words + (scope == NodeScope::kLive ? node_words : 0), number);
  }
  [[nodiscard]] constexpr bool feature(NodeScope scope, std::uint32_t number) const noexcept {
    if (!given()) return true;
    if (words == nullptr) return scope == NodeScope::kReachable || opens_feature(number);
    return has_bit(words + 2 * node_words + (scope == NodeScope::kLive ? feature_words : 0),
                   number);
  }
  [[nodiscard]] constexpr std::uint64_t word_count() const noexcept {
    return 2 * (node_words + feature_words);
  }

 private:
  /// Both features of a node are open (numbers: PairRecord).
  [[nodiscard]] constexpr bool opens(std::uint32_t number) const noexcept {
    const std::uint32_t of_type_a = a.faces * b.vertices, of_type_b = a.vertices * b.faces;
    if (number < of_type_a) return a.face(number / b.vertices) && b.vertex(number % b.vertices);
    number -= of_type_a;
    if (number < of_type_b) return a.vertex(number / b.faces) && b.face(number % b.faces);
    number -= of_type_b;
    return a.edge(number / b.edges) && b.edge(number % b.edges);
  }
  [[nodiscard]] constexpr bool opens_feature(std::uint32_t number) const noexcept {
    if (number < features.edge_a(0)) return a.face(number);
    if (number < features.face_b(0)) return a.edge(number - features.edge_a(0));
    if (number < features.edge_b(0)) return b.face(number - features.face_b(0));
    return b.edge(number - features.edge_b(0));
  }
};

/// Those of a pair that is not listed.
[[nodiscard]] constexpr NodeMarks marks_of_pieces(const PieceMarks& a,
                                                  const PieceMarks& b) noexcept {
  NodeMarks marks;
  marks.features = {a.faces, a.edges, b.faces, b.edges};
  marks.a = a;
  marks.b = b;
  return marks;
}

[[nodiscard]] constexpr NodeMarks marks_at(const std::uint64_t* words, const PairRecord& pair,
                                           const PieceRecord& a, const PieceRecord& b) noexcept {
  NodeMarks marks;
  marks.words = words;
  marks.node_words = mark_words(pair.node_count);
  marks.features = feature_numbering(a, b);
  marks.feature_words = mark_words(marks.features.count());
  return marks;
}

/// What a search of a pair can meet, by scope.
struct LiveCounts {
  std::uint64_t nodes = 0;       ///< of all types
  std::uint64_t edge_pairs = 0;  ///< nodes of type C
  std::uint64_t features = 0;    ///< faces and edges
};

/// Bits of a word that are set; std::popcount calls the compiler's run-time library where the
/// machine has no instruction for it, which an image without libraries does not have.
[[nodiscard]] constexpr std::uint64_t set_bits(std::uint64_t word) noexcept {
  word -= (word >> 1) & 0x5555555555555555u;
  word = (word & 0x3333333333333333u) + ((word >> 2) & 0x3333333333333333u);
  word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  return (word * 0x0101010101010101u) >> 56;
}

/// Bits [begin, end) that are set. Cost: the words they lie in.
[[nodiscard]] constexpr std::uint64_t count_bits(const std::uint64_t* set, std::uint64_t begin,
                                                 std::uint64_t end) noexcept {
  std::uint64_t count = 0;
  while (begin < end) {
    const std::uint64_t from = begin % 64;
    const std::uint64_t bits = end - begin < 64 - from ? end - begin : 64 - from;
    std::uint64_t word = set[begin / 64] >> from;
    if (bits < 64) word &= (std::uint64_t{1} << bits) - 1;
    count += set_bits(word);
    begin += bits;
  }
  return count;
}

/// Counts of a pair that is listed; `marks` may be not given. Cost: its words.
[[nodiscard]] constexpr LiveCounts live_counts(const NodeMarks& marks, NodeScope scope,
                                               const PairRecord& pair, const PieceRecord& a,
                                               const PieceRecord& b) noexcept {
  const FeatureNumbering features = feature_numbering(a, b);
  const std::uint64_t faces = std::uint64_t{pair.node_count_a} + pair.node_count_b;
  if (!marks.given()) return {pair.node_count, pair.node_count - faces, features.count()};
  const bool live = scope == NodeScope::kLive;
  const std::uint64_t* const nodes = marks.words + (live ? marks.node_words : 0);
  const std::uint64_t* const set =
      marks.words + 2 * marks.node_words + (live ? marks.feature_words : 0);
  return {count_bits(nodes, 0, pair.node_count), count_bits(nodes, faces, pair.node_count),
          count_bits(set, 0, features.count())};
}

/// True if a search for what carries force must be made apart: some node only separates.
[[nodiscard]] constexpr bool has_hidden(const LiveCounts& reachable,
                                        const LiveCounts& live) noexcept {
  return live.nodes < reachable.nodes;
}

}  // namespace haptic
