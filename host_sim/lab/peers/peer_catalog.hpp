// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The methods of this program, each with its settings: what the report of error against run time
/// goes through.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_sim/lab/peers/peer_query.hpp"
#include "host_sim/lab/peers/penalty_peer.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// One method with one setting.
struct PeerEntry {
  std::string method, setting, scalar;
  /// A fresh adapter for the pair. @throws tools::InputError when the method refuses it.
  std::function<std::unique_ptr<PeerQuery>(const Solid& a, const Solid& b)> make;
  bool boxes_only = false;
  bool drawn = false;  ///< the setting that stands for its method in pictures of one per method
  bool all_nodes =
      false;  ///< its time is that of the pair's nodes: fewer poses where they are many
};

/// A library behind some of the methods.
struct PeerLibrary {
  std::string name, version, licence;
  bool built = false;  ///< false: not found when this program was configured
};

/// Fixed order: empty, exhaustive, paper_literal, ours, then the libraries that were found.
[[nodiscard]] std::vector<PeerEntry> peer_catalog();
[[nodiscard]] std::vector<PeerLibrary> peer_libraries();

/// Penalty rendering with one library.
struct PenaltyEntry {
  std::string method;  ///< for files: letters, digits, underscores
  std::string title;
  std::unique_ptr<PenaltyPeer> (*make)(const PenaltyBodies& bodies, double stiffness_n_per_m);
};
/// Of the libraries that were found: Bullet, FCL, ODE, libccd twice. May be empty.
[[nodiscard]] std::vector<PenaltyEntry> penalty_catalog();

[[nodiscard]] PeerSolid peer_solid(const Solid& solid);
[[nodiscard]] PeerPose peer_pose(const Vector& p_wa, const Rotation& q_wa);

}  // namespace haptic::sim
