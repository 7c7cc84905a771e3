// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a collision method has to offer to be measured next to the others: one pair of convex
/// bodies, one pose at a time. Plain types only, so that an adapter of a foreign library sees
/// nothing of ours. Lengths in m; B's frame is W.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace haptic::sim {

using PeerVector = std::array<double, 3>;

/// A convex polyhedron; faces as vertex loops, counter-clockwise seen from outside.
struct PeerSolid {
  std::vector<PeerVector> vertices;
  std::vector<std::vector<std::uint32_t>> loops;
};

/// A in W: a point of A is at p_wa + r_wa a.
struct PeerPose {
  PeerVector p_wa{};
  std::array<double, 4> q_wxyz{1, 0, 0, 0};
  std::array<PeerVector, 3> r_wa{};  ///< rows of the rotation
};

/// What `depth_m` of an answer is where the bodies do not meet.
enum class SeparatedValue : std::uint8_t {
  kNone,        ///< a bare no
  kPlane,       ///< D_near: the largest plane value
  kLowerBound,  ///< a lower bound of the distance, by a plane
  kDistance     ///< Euclidean distance
};

struct PeerAnswer {
  bool penetrating = false;
  bool verdict_given = true;  ///< false: the method does not say whether the bodies meet
  /// As D_near: negative inside, and then minus the least translation that parts the bodies. NaN:
  /// no value.
  double depth_m = 0;
  PeerVector normal_w{};  ///< direction in which A has to leave B; zero: none
  std::uint32_t patch_points = 0;
  SeparatedValue separated = SeparatedValue::kNone;
};

class PeerQuery {
 public:
  PeerQuery() = default;
  PeerQuery(const PeerQuery&) = delete;
  PeerQuery& operator=(const PeerQuery&) = delete;
  virtual ~PeerQuery() = default;

  /// Takes the pose over into the method's own types. Not timed.
  virtual void prepare(const PeerPose& pose) = 0;
  /// The whole answer at the prepared pose, left in the method's own types. Timed.
  virtual void query() = 0;
  /// The geometric query alone, where the method does more than that. Timed; may be called in place
  /// of `query`.
  virtual void query_only() { query(); }
  [[nodiscard]] virtual bool has_query_only() const { return false; }
  /// What the last query found out. Not timed.
  [[nodiscard]] virtual PeerAnswer answer() const = 0;
  /// Forgets all that earlier queries left behind.
  virtual void reset() {}
  /// Whether an earlier query can change the time or the result of a later one.
  [[nodiscard]] virtual bool coherent() const { return false; }
};

}  // namespace haptic::sim
