// SPDX-License-Identifier: Apache-2.0
// Two combs that mesh: more pairs of pieces than a scene lists. Compiled with the contact at the
// goal it lists them all the same, each with its own marks: the forces are the same to the bit.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <string>
#include <vector>

#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/replay.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

constexpr int kTeeth = 66;
constexpr double kPitch_mm = 2, kTooth_mm = 0.9, kBase_mm = 4, kTip_mm = 9;

/// A rack of teeth, along x; 10 mm deep.
std::string comb_obj() {
  std::string vertices, faces;
  int count = 0;
  const auto point = [&](double x, double z) {
    for (const double y : {0.0, 10.0}) {
      vertices +=
          "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
    }
    count += 2;
    return count - 1;  // the number of the first; the other stands behind it
  };
  const auto face = [&](std::initializer_list<int> loop) {
    faces += "f";
    for (const int v : loop) faces += " " + std::to_string(v);
    faces += "\n";
  };
  const auto wall = [&](int from, int to) { face({from, to, to + 1, from + 1}); };
  const auto sides = [&](int p, int q, int r, int s) {  // counter-clockwise as seen from -y
    face({p, q, r, s});
    face({p + 1, s + 1, r + 1, q + 1});
  };
  int low = point(0, 0), shoulder = point(0, kBase_mm);
  wall(shoulder, low);
  for (int k = 0; k < 2 * kTeeth - 1; ++k) {
    const bool tooth = k % 2 == 0;
    const double begin = k / 2 * kPitch_mm;
    const double end = tooth ? begin + kTooth_mm : begin + kPitch_mm;
    const int next_low = point(end, 0), next_shoulder = point(end, kBase_mm);
    wall(low, next_low);
    sides(low, next_low, next_shoulder, shoulder);
    if (tooth) {
      const int tip = point(begin, kTip_mm), next_tip = point(end, kTip_mm);
      sides(shoulder, next_shoulder, next_tip, tip);
      wall(next_shoulder, next_tip);
      wall(next_tip, tip);
      wall(tip, shoulder);
    } else {
      wall(next_shoulder, shoulder);
    }
    low = next_low;
    shoulder = next_shoulder;
  }
  wall(low, shoulder);
  return vertices + faces;
}

/// The moving comb below, its teeth up between those of the static one, with 0.1 mm to each side.
std::vector<std::byte> compiled(const ScratchFolder& folder, bool goal_contact) {
  const std::string mesh = folder.file("comb.obj");
  std::ofstream(mesh) << comb_obj();
  tools::SceneFile scene;
  scene.name = "combs";
  scene.moving.mesh = "comb.obj";
  scene.moving.path = mesh;
  scene.moving.scale_to_m = {1e-3, 1e-3, 1e-3};
  scene.moving.position_m = {0, 0, -0.004};
  scene.moving.grip_m = {0, 0, 0};
  scene.statics.push_back(scene.moving);
  scene.statics[0].position_m = {0.001, 0.010, 0.016};
  scene.statics[0].quaternion_wxyz = {0, 1, 0, 0};
  scene.parameters = tools::default_parameters();
  scene.parameters.k_f_n_per_m = 800;
  scene.parameters.goal_contact = goal_contact ? 1u : 0u;
  scene.budget.near_pairs = 64;  // the state is to follow the pieces
  return tools::compile_scene(scene, {}).bytes;
}

/// In, to the side, round, up to the ground of the teeth, and out again.
std::vector<MotionSample> into_each_other() {
  struct Stop {
    double x_mm, z_mm, turn_rad;
  };
  constexpr Stop kStops[] = {{0, -4, 0},    {0, 0, 0},    {0.8, 0, 0},      {0.8, 1, 0.01},
                             {0, 5, -0.01}, {-0.7, 4, 0}, {0, -0.5, 0.005}, {0.2, -4, 0}};
  constexpr int kTicks = 80;
  std::vector<MotionSample> motion;
  for (std::size_t k = 0; k + 1 < std::size(kStops); ++k) {
    for (int i = 0; i < kTicks; ++i) {
      const double to = static_cast<double>(i) / kTicks, from = 1 - to;
      const Stop &a = kStops[k], &b = kStops[k + 1];
      const double half = (from * a.turn_rad + to * b.turn_rad) / 2;
      motion.push_back(
          {static_cast<double>(motion.size()) / 1000,
           {1e-3 * (from * a.x_mm + to * b.x_mm), 0, 1e-3 * (from * a.z_mm + to * b.z_mm)},
           {std::cos(half), 0, 0, std::sin(half)}});
    }
  }
  return motion;
}

}  // namespace

TEST_SUITE("host_sim.formed_pairs") {
  TEST_CASE("pairs that are formed give the forces of pairs that are listed, to the bit") {
    const ScratchFolder folder("combs");
    const std::vector<std::byte> with = compiled(folder, true), without = compiled(folder, false);
    CoreSession listed(with, "combs"), formed(without, "combs");
    CHECK(listed.view().lists_pairs());
    CHECK_FALSE(formed.view().lists_pairs());
    CHECK(formed.view().listed_pairs().empty());
    CHECK(listed.view().pair_count() > kMostListedPairs);
    REQUIRE(formed.view().pair_count() == listed.view().pair_count());
    for (const PairIndex k :
         {PairIndex{0}, PairIndex{67}, PairIndex{4000}, formed.view().pair_count() - 1}) {
      const PairView one = listed.view().pair(k), other = formed.view().pair(k);
      CHECK(one.record.piece_a == other.record.piece_a);
      CHECK(one.record.piece_b == other.record.piece_b);
      REQUIRE(one.record.node_count == other.record.node_count);
      CHECK(formed.view().find_pair(one.record.piece_a, one.record.piece_b) == k);
      std::uint32_t hidden = 0, differ = 0;
      for (std::uint32_t node = 0; node < one.record.node_count; ++node) {
        const bool live = one.marks.node(NodeScope::kLive, node);
        hidden += live ? 0u : 1u;
        differ += live != other.marks.node(NodeScope::kLive, node) ? 1u : 0u;
      }
      CHECK(hidden > 0);
      CHECK(differ == 0);
    }
    CHECK(without.size() < 1000000);
    CHECK(with.size() > 2 * without.size());
    CHECK(formed.view().header().capacity.state_bytes < 2100000);

    const std::vector<MotionSample> motion = into_each_other();
    const ReplayResult of_listed = replay(listed, motion, {});
    const ReplayResult of_formed = replay(formed, motion, {});
    std::uint32_t pressed = 0, differ = 0;
    for (std::size_t k = 0; k < motion.size(); ++k) {
      const TickRecord &one = of_listed.ticks[k], &other = of_formed.ticks[k];
      pressed += one.force_n[0] != 0 || one.force_n[2] != 0 ? 1u : 0u;
      differ += std::memcmp(one.force_n, other.force_n, sizeof one.force_n) != 0 ||
                        std::memcmp(one.torque_nm, other.torque_nm, sizeof one.torque_nm) != 0
                    ? 1u
                    : 0u;
    }
    CHECK(pressed > motion.size() / 4);
    CHECK(differ == 0);
    CHECK(within_bounds(formed.core().peaks(), formed.view().header().capacity));
  }

  TEST_CASE("marks of a piece that do not fit are refused") {
    const ScratchFolder folder("combs_damaged");
    const std::vector<std::byte> blob = compiled(folder, false);
    const tools::SceneBytes aligned{blob};
    SceneView view;
    REQUIRE(SceneView::open(aligned.span(), view) == RtStatus::kOk);
    const auto offset_of = [&](const void* at) {
      return static_cast<std::size_t>(static_cast<const std::byte*>(at) - view.blob().data());
    };
    const auto marked = std::ranges::find_if(
        view.pieces(), [](const PieceRecord& piece) { return piece.mark_begin == 0; });
    REQUIRE(marked != view.pieces().end());
    const std::size_t begin = offset_of(&marked->mark_begin),
                      words = offset_of(view.marks().data());
    const auto opened = [&](std::size_t at, auto value) {
      tools::SceneBytes damaged{blob};
      std::memcpy(damaged.span().data() + at, &value, sizeof value);
      SceneHeader header;
      std::memcpy(&header, damaged.span().data(), sizeof header);
      header.content_hash = scene_content_hash(damaged.span());
      std::memcpy(damaged.span().data(), &header, sizeof header);
      SceneView other;
      return SceneView::open(damaged.span(), other);
    };
    CHECK(opened(begin, std::uint32_t{0}) == RtStatus::kOk);
    CHECK(opened(begin, std::uint32_t{1}) == RtStatus::kBlobBadCount);
    CHECK(opened(begin, kNotMarked) == RtStatus::kBlobBadCount);
    CHECK(opened(words, ~std::uint64_t{0}) == RtStatus::kBlobBadGraph);  // beyond its features
    SceneParameters asked = view.parameters();
    asked.goal_contact = 1;
    CHECK(opened(offset_of(&view.parameters()), asked) == RtStatus::kBlobBadCount);
  }
}
