// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Cuts a solid along a plane of the table, exactly, on its boundary chains (METHOD section 4).

#include <optional>

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

struct Halves {
  std::vector<Solid> below;  ///< connected parts with n.x <= d, canonical
  std::vector<Solid> above;  ///< connected parts with n.x >= d, canonical
};

/// Cuts solids of one world. Holds scratch memory, so that a cut allocates for its result only.
class Splitter {
 public:
  explicit Splitter(ExactWorld& world) : world_(world) {}

  /// Cuts `solid` (canonical) along plane `h`. Nothing if the plane has the solid on one side.
  /// Cost: one sign per vertex, one new point per crossed edge.
  /// @throws WorkLimitReached, BrokenChain
  std::optional<Halves> split(const Solid& solid, std::uint32_t h);

  /// Inserts vertices of the solid that lie inside other edges of it (parts that touch along a
  /// line), so that chains cancel edge by edge. Cuts keep this property; it is needed once, on what
  /// comes from outside.
  void subdivide_touching_edges(Solid& solid);

 private:
  struct FaceHalf {
    Chain chain;     ///< edges off the plane
    Chain on_plane;  ///< edges in the plane, including those that close the chain
  };

  [[nodiscard]] int side_of(std::uint32_t v) const { return sides_[v]; }
  [[nodiscard]] bool near_segment(std::uint32_t u, std::uint32_t v, std::uint32_t w) const;
  bool classify(const Solid& solid, std::uint32_t h);
  void distribute(const ExactFace& face, std::uint32_t h, FaceHalf& below, FaceHalf& above);
  void close(FaceHalf& half, std::uint32_t plane, std::uint32_t h);
  void subdivide(FaceHalf& half, std::uint32_t plane, std::uint32_t h);

  ExactWorld& world_;
  std::vector<std::int8_t> sides_;       ///< by vertex; valid for vertices of the solid being cut
  std::vector<std::uint32_t> on_plane_;  ///< vertices of the solid, and cut points, in the plane
  std::vector<std::pair<std::uint32_t, int>> balance_;
  std::vector<std::uint32_t> on_line_;
};

}  // namespace haptic::tools
