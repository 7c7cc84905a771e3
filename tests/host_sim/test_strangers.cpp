// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "host_sim/lab/strangers/families.hpp"
#include "host_sim/lab/strangers/part_studies.hpp"
#include "host_sim/lab/strangers/stranger_campaign.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

double volume_mm3(const DrawnMesh& mesh) {
  double six = 0;
  for (const auto& t : mesh.triangles) six += t[0].dot(t[1].cross(t[2]));
  return six / 6;
}

/// A motion of a pair in which nothing is felt.
std::vector<PlayedTick> silent(const HandMotion& hand) {
  std::vector<PlayedTick> ticks(hand.samples.size());
  return ticks;
}

bool has_fault(const std::vector<FoundFault>& faults, StrangerFault kind) {
  return std::ranges::any_of(faults, [&](const FoundFault& f) { return f.kind == kind; });
}

const HandSprings kSprings{800, 0.5, Vector(0, 0, 0)};

}  // namespace

TEST_SUITE("host_sim.strangers") {
  TEST_CASE("drawn meshes: a block with a bore has its volume and is closed") {
    const Outline bore = rectangle_outline(4, 6), outside = rectangle_outline(20, 10);
    const DrawnMesh block = bored_block(bore, outside, 5, 1, 2);
    CHECK(open_sides(block) == 0);
    // The rim is a frustum 1 mm high between 4 x 6 and 6 x 8.
    const double rim = (24 + 48 + 4 * 5 * 7) / 6.0;
    CHECK(volume_mm3(block) == doctest::Approx(20 * 10 * 7 - 24 * 4 - rim));
  }

  TEST_CASE("drawn meshes: a mesh without one triangle is open") {
    DrawnMesh block = block_mesh({0, 0, 0}, {1, 2, 3});
    CHECK(volume_mm3(block) == doctest::Approx(6));
    block.triangles.pop_back();
    CHECK(open_sides(block) == 3);
  }

  TEST_CASE("drawn meshes: an outline grows by as much on every side, holes and pegs alike") {
    const Outline square = rectangle_outline(2, 4), wide = grown_outline(square, 0.5);
    CHECK(volume_mm3(prism_of(0, 1, {wide})) == doctest::Approx(3 * 5));
    Outline reversed = square;
    std::ranges::reverse(reversed);
    CHECK(volume_mm3(prism_of(0, 1, {grown_outline(reversed, -0.5)})) == doctest::Approx(1 * 3));
  }

  TEST_CASE("families: every drawing is closed, starts free, and goes home without overlap") {
    for (const std::string_view family : stranger_families()) {
      for (const std::uint64_t seed : {1u, 2u, 3u}) {
        const StrangerPair pair = stranger_pair(family, seed);
        CAPTURE(family);
        CAPTURE(seed);
        REQUIRE(pair.places.size() == pair.fixed.size());
        CHECK(open_sides(pair.moving) == 0);
        CHECK(volume_mm3(pair.moving) > 0);
        for (const DrawnMesh& mesh : pair.fixed) {
          CHECK(open_sides(mesh) == 0);
          CHECK(volume_mm3(mesh) > 0);
        }
        const PairTriangles triangles(pair);
        CHECK(triangles.apart(pair.pose(pair.start(), 0), 1e-4));
        // A little before home nothing is nearer than a part of the clearance.
        WayPose almost;
        almost.to_go_mm = 0.2 * pair.clearance_mm;
        if (!pair.turns.empty() || family == "scan" || !pair.meant.empty()) continue;
        CHECK(triangles.apart(pair.pose(almost, 0), 2e-5 * pair.clearance_mm));
      }
    }
  }

  TEST_CASE(
      "families: equal seeds give equal files, others do not, and an unknown name is refused") {
    const auto file = [](std::uint64_t seed) {
      return stl_file(stranger_pair("keyed_shaft", seed).moving, false);
    };
    CHECK(file(4) == file(4));
    CHECK(file(4) != file(5));
    CHECK_THROWS_AS(static_cast<void>(stranger_pair("no_such", 1)), tools::UsageError);
  }

  TEST_CASE("hand: it stands still for 12 ticks after every 90") {
    const HandMotion hand = insertion_motion(stranger_pair("ring_on_post", 1));
    REQUIRE(hand.stops.size() > 20);
    CHECK(hand.stops[1] - hand.stops[0] == kTicksBetweenStops + kTicksOfStop);
    for (const std::size_t stop : hand.stops) {
      for (std::size_t k = stop; k < stop + kTicksOfStop; ++k)
        for (int i = 0; i < 3; ++i) CHECK(hand.samples[k].p[i] == hand.samples[stop - 1].p[i]);
    }
  }

  TEST_CASE("judge: a silent motion is right, and every falsified one has its fault") {
    const StrangerPair pair = stranger_pair("ring_on_post", 1);
    const HandMotion hand = insertion_motion(pair);
    const PairTriangles triangles(pair);
    const auto faults_of = [&](const std::vector<PlayedTick>& ticks) {
      std::vector<FoundFault> found;
      find_faults("hand", account_of(ticks, &hand, kSprings, triangles, kTouching_m), &hand, found);
      return found;
    };
    CHECK(faults_of(silent(hand)).empty());
    for (const StrangerFault fault :
         {StrangerFault::kStuck, StrangerFault::kLeft, StrangerFault::kRecovery,
          StrangerFault::kFree, StrangerFault::kLate}) {
      std::vector<PlayedTick> ticks = silent(hand);
      falsify(ticks, hand, fault);
      CAPTURE(to_text(fault));
      CHECK(has_fault(faults_of(ticks), fault));
    }
    for (const StrangerFault fault : {StrangerFault::kMore, StrangerFault::kWall}) {
      std::vector<PlayedTick> ticks = silent(hand);
      falsify(ticks, hand, fault);
      std::vector<FoundFault> found;
      find_excess("hand", excess_of(ticks, silent(hand)), hand, fault == StrangerFault::kWall,
                  found);
      CAPTURE(to_text(fault));
      CHECK(has_fault(found, fault));
    }
  }

  TEST_CASE("judge: the felt pose is where the springs make the wrench") {
    PlayedTick tick;
    tick.force_n = Vector(8, 0, 0);
    tick.torque_nm = Vector(0, 0, 0.05);
    HandSprings springs = kSprings;
    springs.grip_m = Vector(0.1, 0, 0);
    const MotionSample felt = springs.felt(sample_at(0, {1, 2, 3}, Rotation::Identity()), tick);
    // The grip point 10 mm on, the part turned by 0.1 rad about it.
    CHECK(felt.p[0] == doctest::Approx(1 + 0.1 + 0.01 - 0.1 * std::cos(0.1)));
    CHECK(felt.p[1] == doctest::Approx(2 - 0.1 * std::sin(0.1)));
    CHECK(felt.q_wxyz[0] == doctest::Approx(std::cos(0.05)));
  }

  TEST_CASE("scene text: keys of a section are replaced or added, sections made where absent") {
    const std::string scene =
        "format = 1\n[budget]\nwork_units = 5\nstate_bytes = 7\n[rendering]\nk_f_n_per_m = 800\n";
    CHECK(with_keys(scene, "[budget]\nwork_units = 9\nnear_pairs = 3\n[coupling]\npasses = 2\n") ==
          "format = 1\n[budget]\nnear_pairs = 3\nwork_units = 9\nstate_bytes = "
          "7\n[rendering]\nk_f_n_per_m = 800\n"
          "[coupling]\npasses = 2\n");
  }

  TEST_CASE(
      "a pair compiles in this process and plays: force where it touches, none at the start") {
    const StrangerPair pair = stranger_pair("ring_on_post", 2, 0.1);
    TriedScene scene(scene_of_pair(pair, 0), files_of_pair(pair));
    const HandMotion hand = insertion_motion(pair);
    const std::vector<PlayedTick> ticks = scene.play(hand.samples);
    REQUIRE(ticks.size() == hand.samples.size());
    CHECK(ticks.front().force_n.norm() == 0);
    CHECK(std::ranges::any_of(
        ticks, [](const PlayedTick& t) { return t.touches && t.force_n.norm() > 1; }));
  }
}

}  // namespace haptic::sim
