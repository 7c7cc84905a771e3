// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Order in which corners and planes can be placed such that each meets at most three earlier ones,
/// in good condition (METHOD section 3, "Corners on more than three planes").

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {

/// One element to be placed: a plane or a corner, and the neighbours that stand by then.
struct PlacementStep {
  bool is_plane = false;
  std::uint32_t index = 0;
  std::array<std::uint32_t, 3> earlier{};  ///< neighbours placed before it
  std::size_t earlier_count = 0;
};

/// Order in which the nodes of the graph can be removed with at most three well-conditioned
/// neighbours left.
class Peeling {
 public:
  Peeling(const CornerPlaneGraph& graph, const RealiseRules& rules);
  /// False when stuck; `left` then counts and names what remains.
  bool run();
  [[nodiscard]] const std::vector<PlacementStep>& steps() const { return steps_; }
  [[nodiscard]] std::size_t wishes_kept() const;
  [[nodiscard]] std::size_t left() const { return left_; }
  [[nodiscard]] std::vector<std::uint32_t> corners_left() const;

 private:
  struct Arc {
    std::uint32_t corner = 0;
    std::uint32_t plane = 0;
    bool wish = false;
    double distance = 0.0;  // of a wish
    bool dropped = false;
  };

  [[nodiscard]] PlacementStep neighbours(bool is_plane, std::uint32_t index) const;
  [[nodiscard]] double corner_condition(const PlacementStep& step) const;
  [[nodiscard]] double plane_condition(const PlacementStep& step) const;
  bool remove_corners(double threshold);
  bool remove_plane(double threshold);
  bool remove_layer(double threshold);
  bool remove_planes(double threshold) {
    return order_ == PeelOrder::kLayers ? remove_layer(threshold) : remove_plane(threshold);
  }
  bool drop_wish();
  void remove(const PlacementStep& step);
  void queue_all_corners();

  const CornerPlaneGraph& graph_;
  PeelOrder order_;
  std::vector<Arc> arcs_;
  std::vector<std::vector<std::uint32_t>> corner_arcs_, plane_arcs_;
  std::vector<std::size_t> corner_degree_, plane_degree_;
  std::vector<bool> corner_gone_, plane_gone_;
  std::vector<double> extent_;     // per plane: size of the polygon that its corners span
  std::vector<double> condition_;  // per plane, cached; negative: stale
  std::deque<std::uint32_t> queue_;
  std::vector<PlacementStep> steps_;
  std::size_t left_ = 0;
};

}  // namespace haptic::tools
