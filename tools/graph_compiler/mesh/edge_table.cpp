// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/edge_table.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace haptic::tools {

EdgeTable::EdgeTable(const std::vector<WorkFace>& faces) {
  std::size_t count = 0;
  for (const WorkFace& face : faces) {
    count += face.loop.size();
  }
  half_edges.reserve(count);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const std::vector<std::uint32_t>& loop = faces[f].loop;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const std::uint32_t from = loop[i];
      const std::uint32_t to = loop[i + 1 == loop.size() ? 0 : i + 1];
      half_edges.push_back({std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(f),
                            static_cast<std::uint32_t>(i), from < to});
    }
  }
  std::sort(half_edges.begin(), half_edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.face, a.corner) < std::tie(b.low, b.high, b.face, b.corner);
  });
  for (std::size_t begin = 0; begin < half_edges.size();) {
    std::size_t end = begin + 1;
    while (end < half_edges.size() && half_edges[end].low == half_edges[begin].low &&
           half_edges[end].high == half_edges[begin].high) {
      ++end;
    }
    edges.push_back({begin, end});
    begin = end;
  }
}

ParitySets::ParitySets(std::size_t size) : parent_(size), parity_(size, 0) {
  std::iota(parent_.begin(), parent_.end(), 0U);
}

std::uint32_t ParitySets::root_of(std::uint32_t element) {
  std::uint32_t root = element;
  std::uint8_t parity = 0;
  while (parent_[root] != root) {
    parity ^= parity_[root];
    root = parent_[root];
  }
  // Second pass: hang the whole path on the root.
  while (parent_[element] != root && element != root) {
    const std::uint32_t next = parent_[element];
    const std::uint8_t own = parity_[element];
    parent_[element] = root;
    parity_[element] = parity;
    parity ^= own;
    element = next;
  }
  return root;
}

bool ParitySets::parity_of(std::uint32_t element) {
  const std::uint32_t root = root_of(element);
  return element != root && parity_[element] != 0;
}

bool ParitySets::unite(std::uint32_t a, std::uint32_t b, bool opposite) {
  const bool parity_a = parity_of(a);
  const bool parity_b = parity_of(b);
  std::uint32_t root_a = root_of(a);
  std::uint32_t root_b = root_of(b);
  const bool between_roots = (parity_a != parity_b) != opposite;
  if (root_a == root_b) {
    return !between_roots;
  }
  if (root_b < root_a) {
    std::swap(root_a, root_b);
  }
  parent_[root_b] = root_a;
  parity_[root_b] = between_roots ? 1 : 0;
  return true;
}

}  // namespace haptic::tools
