// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Small bodies, scenes and seeded motions for the tests of the simulator.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host_sim/oracle/golden_file.hpp"
#include "host_sim/oracle/oracle_piece.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "tools/common/split_mix.hpp"

namespace haptic::sim::test {

/// Centred box with the given half extents [m].
[[nodiscard]] GoldenBody box(double x, double y, double z);
/// Irregular tetrahedron of about 0.1 m.
[[nodiscard]] GoldenBody tetrahedron();
/// Upright prism over a regular polygon of `sides` corners [m].
[[nodiscard]] GoldenBody prism(std::uint32_t sides, double radius, double half_height);

/// Compiled scene of A moving over B; k_F 1000 N/m, epsilon 0.1 mm, grip point at A's origin.
[[nodiscard]] std::vector<std::byte> scene_of(const GoldenBody& a, const GoldenBody& b);

/// A body as the oracle sees it.
[[nodiscard]] OraclePiece piece_of(const GoldenBody& body);

/// Uniform in [0, 1).
class Random {
 public:
  explicit Random(std::uint64_t seed) : words_(seed) {}
  [[nodiscard]] double next() { return words_.uniform(); }
  [[nodiscard]] Wide wide() { return widen(next()); }

 private:
  tools::SplitMix64 words_;
};

/// Coherent path at 1 kHz: each coordinate the sum of three slow sines about `centre_m`; the
/// orientation turns by up to `turn_rad` about each axis of a start orientation that is random, or
/// the identity when `aligned`.
struct PathShape {
  double centre_m[3] = {0, 0, 0};
  double amplitude_m = 0.03;
  double turn_rad = 1.0;
  bool aligned = false;
};
[[nodiscard]] std::vector<MotionSample> smooth_path(std::uint64_t seed, std::size_t ticks,
                                                    const PathShape& shape);

}  // namespace haptic::sim::test
