// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pair_class.hpp"

#include <utility>

namespace haptic::sim {
namespace {

std::uint64_t edge_count(const Solid& solid) {
  std::uint64_t corners = 0;
  for (const auto& loop : solid.loops) corners += loop.size();
  return corners / 2;
}

PairClass pair_of(std::string name, std::string content, Solid a, Solid b) {
  PairClass pair{std::move(name), std::move(content), std::move(a), std::move(b)};
  pair.nodes = basic_contact_count(pair.a, pair.b);
  return pair;
}

PairClass hull_pair(std::string name, std::uint32_t vertices, std::uint64_t seed) {
  const Vector axes_a(0.040, 0.030, 0.025), axes_b(0.050, 0.040, 0.030);
  const std::string count = std::to_string(vertices);
  return pair_of(std::move(name), "hulls of " + count + " and " + count + " vertices",
                 ellipsoid_hull(vertices, axes_a, seed),
                 ellipsoid_hull(vertices, axes_b, seed + 1));
}

}  // namespace

std::uint64_t basic_contact_count(const Solid& a, const Solid& b) {
  return std::uint64_t{a.loops.size()} * b.vertices.size() +
         std::uint64_t{a.vertices.size()} * b.loops.size() + edge_count(a) * edge_count(b);
}

std::vector<PairClass> pair_classes(std::uint64_t seed) {
  const Solid box = centred_box("box", 0.050, 0.040, 0.030);
  std::vector<PairClass> pairs;
  pairs.push_back(pair_of("W1", "tetrahedron and box", paper_tetrahedron(), box));
  pairs.push_back(pair_of("W2", "two boxes", centred_box("box a", 0.030, 0.025, 0.020), box));
  pairs.back().boxes = true;
  pairs.push_back(pair_of("W3", "12-prism and box", prism_solid(12, 0.025, 0.060), box));
  pairs.push_back(hull_pair("W4", 32, seed + 40));
  pairs.push_back(hull_pair("W5", 64, seed + 50));
  pairs.push_back(hull_pair("W6", 200, seed + 60));
  return pairs;
}

}  // namespace haptic::sim
