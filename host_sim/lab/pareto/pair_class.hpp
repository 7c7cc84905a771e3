// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The six pairs of convex bodies that methods are compared on, from the paper's to half a million
/// basic contacts. Parts of 3 to 10 cm, made here from seeds.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

struct PairClass {
  std::string name;     ///< W1 to W6
  std::string content;  ///< in words
  Solid a, b;
  std::uint64_t nodes = 0;  ///< basic contacts: F_A V_B + V_A F_B + E_A E_B
  bool boxes = false;
};

/// All six, in order of their nodes: 128, 240, 688, 11940, 50468, 511236. The hulls follow from
/// `seed`; their counts do not.
[[nodiscard]] std::vector<PairClass> pair_classes(std::uint64_t seed);

/// F_A V_B + V_A F_B + E_A E_B of closed bodies.
[[nodiscard]] std::uint64_t basic_contact_count(const Solid& a, const Solid& b);

}  // namespace haptic::sim
