// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/reproduction/graph_table.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/lab/reproduction/pose_sweep.hpp"
#include "host_sim/oracle/node_set.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr double kGraphEpsilon_m = 1e-4;
constexpr const char* kTypeNames[3] = {"A", "B", "C"};

std::vector<std::byte> paper_scene() {
  const Solid box = paper_box();
  return scene_of(paper_tetrahedron(), {&box, 1}, 1000.0, kGraphEpsilon_m);
}

/// Two ticks at one pose: the first searches all nodes, the second tracks from its near set.
StepResult settle(CoreSession& session, const SweepPose& pose) {
  StepInput input;
  input.report_goal_contact = true;
  input.pose_wa = pose_at(pose.x, pose.q);
  session.core().reset();
  static_cast<void>(session.core().step(input));
  return session.core().step(input);
}

std::string situation_name(const CoreSession& session, const HapticCore& core) {
  const auto near = near_nodes(core, 0);
  if (near.size() == 1) {
    const auto type = contact_type(*session.view().pair(0).record, near[0]);
    return std::string("one node of type ") + kTypeNames[static_cast<std::size_t>(type)];
  }
  switch (core.pair_report(0).situation) {
    case ContactSituation::kEdgeFace:
      return "edge-face contact";
    case ContactSituation::kFaceFace:
      return "face-face contact";
    case ContactSituation::kSeveralPlanes:
      return kSeveralPlanesRow;
    default:
      return "one contact, several near nodes";
  }
}

void count_local(const FlatPair& flat, std::span<const std::uint32_t> near, double d_near_m,
                 LocalSizes& sizes, std::vector<std::uint8_t>& seen) {
  const auto kind = near.size() == 1   ? LocalSizes::kOneNear
                    : near.size() <= 4 ? LocalSizes::kUpToFourNear
                                       : LocalSizes::kMoreNear;
  std::fill(seen.begin(), seen.end(), std::uint8_t{0});
  std::array<std::size_t, LocalSizes::kDeltas_m.size()> members{};
  const auto visit = [&](std::uint32_t node) {
    if (seen[node] != 0) return;
    seen[node] = 1;
    const FlatPair::Value value = flat.evaluate(node);
    if (value.violation_m > kApplicable_m) return;
    for (std::size_t d = 0; d < members.size(); ++d)
      members[d] += std::abs(d_near_m - value.depth_m) < LocalSizes::kDeltas_m[d] ? 1u : 0u;
  };
  for (const std::uint32_t node : near) {
    visit(node);
    const auto [type, i, j] = node_features(flat.view(), node);
    for_each_graph_neighbor(flat.view(), type, i, j, visit);
  }
  sizes.poses[kind] += 1;
  for (std::size_t d = 0; d < members.size(); ++d)
    sizes.count[kind][d][std::min(members[d], LocalSizes::kSizes - 1)] += 1;
}

}  // namespace

GraphFacts graph_facts() {
  const std::vector<std::byte> bytes = paper_scene();
  const CoreSession session(bytes, "tetrahedron and box");
  const PairView pair = session.view().pair(0);
  GraphFacts facts;
  facts.least_degree.fill(UINT32_MAX);
  std::uint32_t entries = 0;
  for (std::uint32_t node = 0; node < pair.record->node_count; ++node) {
    const auto [contact, i, j] = node_features(pair, node);
    std::uint32_t degree = 0;
    for_each_graph_neighbor(pair, contact, i, j, [&](std::uint32_t) { degree += 1; });
    const auto type = static_cast<std::size_t>(contact);
    facts.nodes[type] += 1;
    facts.least_degree[type] = std::min(facts.least_degree[type], degree);
    facts.largest_degree[type] = std::max(facts.largest_degree[type], degree);
    entries += degree;
  }
  facts.arcs = entries / 2;
  return facts;
}

NeighborhoodTable neighborhood_table(std::uint32_t poses) {
  const std::vector<std::byte> bytes = paper_scene();
  CoreSession session(bytes, "tetrahedron and box");
  PoseSweep sweep(session.view(), 20);
  Seeded random(21);
  NeighborhoodTable table;
  for (std::uint32_t k = 0; k < poses; ++k) {
    const double depth = random.uniform(0.0002, 0.002);
    const SweepPose pose = k % 3 == 0   ? sweep.generic(-depth)
                           : k % 3 == 1 ? sweep.edge_face(depth, 0)
                                        : sweep.face_face(depth, 0);
    if (settle(session, pose).d_near_m > 0) continue;  // the offset lay next to the other body
    const HapticCore& core = session.core();
    NeighborhoodRange& range = table[situation_name(session, core)];
    range.poses += 1;
    const std::vector<std::uint32_t> near = near_nodes(core, 0);
    const std::uint32_t size = neighborhood_size(session.view().pair(0), near);
    range.least = std::min(range.least, size);
    range.largest = std::max(range.largest, size);
    range.most_near = std::max(range.most_near, static_cast<std::uint32_t>(near.size()));
  }
  return table;
}

double LocalSizes::share_below(Class kind, std::size_t delta, std::size_t size) const {
  std::uint64_t below = 0;
  for (std::size_t s = 0; s < std::min(size, kSizes); ++s) below += count[kind][delta][s];
  return poses[kind] == 0 ? 1.0 : static_cast<double>(below) / static_cast<double>(poses[kind]);
}

std::size_t LocalSizes::largest(Class kind, std::size_t delta) const {
  for (std::size_t s = kSizes; s-- > 0;) {
    if (count[kind][delta][s] > 0) return s;
  }
  return 0;
}

LocalSizes local_sizes(std::uint32_t poses) {
  const std::vector<std::byte> bytes = paper_scene();
  CoreSession session(bytes, "tetrahedron and box");
  PoseSweep sweep(session.view(), 22);
  Seeded random(23);
  FlatPair flat(session.view(), 0);
  std::vector<std::uint8_t> seen(flat.node_count());
  LocalSizes sizes;
  for (std::uint32_t k = 0; k < poses; ++k) {
    // Eight poses of ten at any orientation, -6 to +50 mm; the others at or near an edge-face or
    // face-face contact, where a hand holds them within a few hundredths of a degree.
    const double depth = random.uniform(0.0002, 0.002), tilt = random.uniform(0.0, 0.002);
    const SweepPose pose = k % 10 == 8   ? sweep.edge_face(depth, tilt)
                           : k % 10 == 9 ? sweep.face_face(depth, tilt)
                                         : sweep.generic(random.uniform(-0.006, 0.050));
    const StepResult result = settle(session, pose);
    flat.place(place_moving(session.view(), pose_at(pose.x, pose.q)));
    count_local(flat, near_nodes(session.core(), 0), static_cast<double>(result.d_near_m), sizes,
                seen);
  }
  return sizes;
}

}  // namespace haptic::sim
