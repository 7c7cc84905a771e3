// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/disjoint.hpp"

#include <algorithm>
#include <utility>

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

}  // namespace haptic::tools
