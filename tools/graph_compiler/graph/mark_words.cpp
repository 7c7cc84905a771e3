// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/mark_words.hpp"

#include <string>

#include "rt_core/scene/graph_rule.hpp"
#include "rt_core/scene/node_marks.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

void set_bit(std::vector<std::uint64_t>& words, std::uint64_t first_word, std::uint64_t k) {
  words[first_word + k / 64] |= std::uint64_t{1} << (k % 64);
}

bool bit(const std::vector<std::uint64_t>& words, std::uint64_t first_word, std::uint64_t k) {
  return NodeMarks::bit(words.data() + first_word, k);
}

}  // namespace

std::vector<std::uint64_t> mark_words(const PieceView& a, const PieceView& b,
                                      const PairMarks& marks) {
  const NodeNumbering n = numbering(a, b);
  if (marks.reachable.size() != n.count() || marks.exposed.size() != n.count()) {
    throw InputError("marks of " + std::to_string(marks.reachable.size()) + " and " +
                     std::to_string(marks.exposed.size()) + " basic contacts for a pair of " +
                     std::to_string(n.count()));
  }
  const FeatureNumbering features{n.nfa, n.nea, n.nfb, n.neb};
  const std::uint64_t node_words = haptic::mark_words(n.count());
  const std::uint64_t feature_words = haptic::mark_words(features.count());
  std::vector<std::uint64_t> words(2 * (node_words + feature_words));
  bool any_reachable = false, all_live = true;
  const auto mark = [&](std::uint32_t node, std::uint32_t first, std::uint32_t second) {
    const bool live = marks.live(node);
    all_live = all_live && live;
    if (!marks.reachable[node]) return;
    any_reachable = true;
    for (const bool of_live : {false, true}) {
      if (of_live && !live) continue;
      set_bit(words, of_live ? node_words : 0, node);
      const std::uint64_t at = 2 * node_words + (of_live ? feature_words : 0);
      set_bit(words, at, first);
      set_bit(words, at, second);
    }
  };
  const auto open_face = [&](std::uint32_t node, std::uint32_t face) {
    const std::uint64_t at = 2 * node_words;
    if (marks.exposed[node] && bit(words, at, face)) set_bit(words, at + feature_words, face);
  };
  for (std::uint32_t f = 0; f < n.nfa; ++f) {
    const std::uint32_t face = features.face_a(f);
    for (std::uint32_t v = 0; v < n.nvb; ++v) mark(n.type_a(f, v), face, face);
    for (std::uint32_t v = 0; v < n.nvb; ++v) open_face(n.type_a(f, v), face);
  }
  for (std::uint32_t f = 0; f < n.nfb; ++f) {
    const std::uint32_t face = features.face_b(f);
    for (std::uint32_t v = 0; v < n.nva; ++v) mark(n.type_b(v, f), face, face);
    for (std::uint32_t v = 0; v < n.nva; ++v) open_face(n.type_b(v, f), face);
  }
  for (std::uint32_t e = 0; e < n.nea; ++e) {
    for (std::uint32_t g = 0; g < n.neb; ++g)
      mark(n.type_c(e, g), features.edge_a(e), features.edge_b(g));
  }
  if (all_live || !any_reachable) words.clear();
  return words;
}

}  // namespace haptic::tools
