// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Several bodies that springs draw to their goals, as a physics engine moves them. Plain types
/// only, so that an adapter of a foreign library sees nothing of ours. SI units, W axes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host_sim/lab/peers/peer_query.hpp"

namespace haptic::sim {

/// Along the axes of its body; of what stands, of W.
struct PeerBox {
  PeerVector middle{}, half{};
};

/// A body of boxes, about the point that its spring draws.
struct SprungBody {
  std::vector<PeerBox> boxes;
  double stiffness_n_per_m = 0, turn_stiffness_nm_per_rad = 0;
};

struct PeerAssembly {
  std::vector<SprungBody> bodies;
  std::vector<PeerBox> standing;
  double friction = 0;
  double tick_s = 1e-3;
};

/// Poses of all bodies.
struct PeerPlaces {
  std::vector<PeerVector> p;
  std::vector<std::array<double, 4>> q_wxyz;
};

class BodiesPeer {
 public:
  BodiesPeer() = default;
  BodiesPeer(const BodiesPeer&) = delete;
  BodiesPeer& operator=(const BodiesPeer&) = delete;
  virtual ~BodiesPeer() = default;

  /// All bodies are at rest at `places`, with their goals there.
  virtual void begin(const PeerPlaces& places) = 0;
  /// One tick, in which the goals come to `goals` at a constant speed. Timed.
  virtual void tick(const PeerPlaces& goals) = 0;
  [[nodiscard]] virtual const PeerPlaces& places() const = 0;
};

/// MuJoCo with its default solver. Each body has 0.1 kg, the moment of inertia with which it swings
/// about its goal as fast as along, and critical damping of its speed beyond the goal's. `stiff`:
/// contacts follow in two steps' time, as stiff as MuJoCo takes; else as by default. `steps`: of
/// its own in a tick. @throws std::runtime_error with its message where it refuses the assembly.
[[nodiscard]] std::unique_ptr<BodiesPeer> make_mujoco_bodies(const PeerAssembly& assembly,
                                                             bool stiff, unsigned steps);
/// "2.2.2".
[[nodiscard]] const char* mujoco_version();

}  // namespace haptic::sim
