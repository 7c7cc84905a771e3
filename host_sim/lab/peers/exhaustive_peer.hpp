// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The plain exhaustive search, as well as a scalar double loop does it: every face against every
/// vertex, every edge against every edge, signs before products before the root, flat arrays.

#include <vector>

#include "host_sim/lab/peers/peer_query.hpp"

namespace haptic::sim {

class ExhaustivePeer final : public PeerQuery {
 public:
  ExhaustivePeer(const PeerSolid& a, const PeerSolid& b);

  void prepare(const PeerPose& pose) override { pose_ = pose; }
  /// Moves A into B's frame and looks at every node. Cost: O(nodes), no branch on history.
  void query() override;
  [[nodiscard]] PeerAnswer answer() const override;

 private:
  /// Per edge, gathered so that the double loop reads forwards alone.
  struct EdgeEntry {
    PeerVector vertex, along, normal[2];
    double length_squared = 0;
  };
  struct EdgeIndex {
    std::uint32_t vertex[2], face[2];
  };
  struct Body {
    std::vector<PeerVector> vertices, normals;
    std::vector<double> offsets;  ///< of the faces: n.v
    std::vector<EdgeIndex> edges;
    std::vector<std::uint32_t> face_vertex;
  };
  static Body body_of(const PeerSolid& solid);
  void move_a();
  void search_faces();
  void search_edges();
  [[nodiscard]] double gap_along(const PeerVector& n) const;

  PeerPose pose_;
  Body a_, b_;
  std::vector<PeerVector> va_, na_;  ///< A in B's frame
  std::vector<EdgeEntry> ea_, eb_;
  double best_m_ = 0;
  PeerVector normal_{};
};

}  // namespace haptic::sim
