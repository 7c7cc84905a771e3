// SPDX-License-Identifier: Apache-2.0
/// Real parts at 30 degrees about their assembled pose: counts of needed contacts
/// (tools/graph_compiler/METHOD.md section 11).
#include <doctest/doctest.h>

#include <numbers>

#include "tests/tools/pruning/contact_sampling.hpp"

namespace haptic::tools::test {
namespace {

constexpr double kThirtyDegrees_rad = std::numbers::pi / 6;
constexpr std::uint64_t kSeed = 20261121;

struct Row {
  const char* name;
  std::size_t moving, fixed;
  NodeCounts nodes;
  std::size_t reachable, exposed, live, largest_before, largest_after;
  HiddenCount faces, edges, vertices;
  std::size_t partly_covered;
};

const std::array<Row, 8> kRows{{
    {"square_peg", 1, 4, {192, 192, 576}, 528, 544, 300, 240, 106, {4, 30}, {20, 60}, {24, 40}, 3},
    {"cube_in_cup", 1, 5, {240, 240, 720}, 660, 512, 280, 240, 92, {8, 36}, {36, 72}, {32, 48}, 4},
    {"octagon_peg",
     1,
     8,
     {560, 704, 2016},
     1400,
     1648,
     694,
     464,
     156,
     {9, 54},
     {42, 108},
     {48, 72},
     7},
    {"rect_peg_16mm",
     1,
     4,
     {320, 384, 1152},
     768,
     1072,
     448,
     464,
     156,
     {4, 34},
     {20, 72},
     {24, 48},
     3},
    {"corner_bracket",
     2,
     2,
     {192, 192, 576},
     528,
     581,
     316,
     240,
     106,
     {2, 24},
     {10, 48},
     {12, 32},
     2},
    {"ell_fixture",
     2,
     7,
     {672, 672, 2016},
     1848,
     2076,
     1140,
     240,
     132,
     {6, 54},
     {27, 108},
     {28, 72},
     14},
    {"plug_socket",
     2,
     8,
     {8528, 5088, 24384},
     7760,
     17696,
     3152,
     2832,
     290,
     {16, 158},
     {132, 350},
     {132, 212},
     0},
    {"prism_stack", 1, 1, {96, 120, 360}, 244, 576, 244, 576, 244, {0, 18}, {0, 42}, {0, 28}, 0},
}};

/// So small that marks are of contacts that apply, and of none that are only near.
constexpr double kNothingNear_m = 1.0e-10;

PrunedScene pruned_part(const std::string& name, double max_angle_rad) {
  SceneDescription description = shared_scene(name);
  description.parameters.epsilon_m = kNothingNear_m;
  description.orientation = about_start(description, max_angle_rad);
  return pruned(std::move(description));
}

/// False, with a message, where the parts are absent.
bool have_parts() {
  if (!shared_names().empty()) return true;
  MESSAGE("skipped: no folder with real parts");
  return false;
}

}  // namespace

TEST_SUITE("tools.pruning_parts") {
  TEST_CASE("real parts: exactly as many nodes as measured before") {
    if (!have_parts()) return;
    for (const Row& row : kRows) {
      CAPTURE(row.name);
      const PruningAccount account = pruned_part(row.name, kThirtyDegrees_rad).account;
      CHECK(account.moving_pieces == row.moving);
      CHECK(account.static_pieces == row.fixed);
      CHECK(account.counts.nodes == row.nodes);
      CHECK(account.counts.reachable.all() == row.reachable);
      CHECK(account.counts.open.all() == row.exposed);
      CHECK(account.counts.live.all() == row.live);
      CHECK(account.largest_pair_before == row.largest_before);
      CHECK(account.largest_pair_after == row.largest_after);
      CHECK(account.faces == row.faces);
      CHECK(account.edges == row.edges);
      CHECK(account.vertices == row.vertices);
      CHECK(account.partly_covered_faces == row.partly_covered);
    }
  }

  TEST_CASE("plug and socket: nodes grow with the envelope as measured before") {
    if (!have_parts()) return;
    SceneDescription description = shared_scene("plug_socket");
    const auto reachable = [&](double degrees, double more_rad) {
      description.orientation =
          about_start(description, degrees * std::numbers::pi / 180 + more_rad);
      return prune_scene(description).counts.reachable.all();
    };
    const std::array<std::pair<double, std::size_t>, 3> steps{
        {{5.0, 4704}, {20.0, 6444}, {30.0, 7760}}};
    for (const auto& [angle, nodes] : steps) {
      const double degrees = angle;
      CAPTURE(degrees);
      CHECK(reachable(degrees, 0.0) == nodes);
    }
    // The plug has many faces at 60 and 90 degrees from one another, to within the print of its
    // coordinates: hundreds of nodes come in within 1e-5 rad, and the count measured before is one
    // of those on the way.
    const std::array<std::pair<double, std::size_t>, 2> crowded{{{60.0, 21136}, {90.0, 31349}}};
    for (const auto& [angle, nodes] : crowded) {
      const double degrees = angle;
      CAPTURE(degrees);
      const std::size_t before = reachable(degrees, -1e-5), after = reachable(degrees, 1e-5);
      CHECK(before < nodes);
      CHECK(nodes < after);
      CHECK(after - before < nodes / 4);
    }
  }

  TEST_CASE("real parts: no node that applies in the envelope is lost, nearly all kept ones do") {
    if (!have_parts()) return;
    for (const std::string& name : shared_names()) {
      CAPTURE(name);
      CAPTURE(kSeed);
      const PrunedScene scene = pruned_part(name, kThirtyDegrees_rad);
      const OrientationEnvelope envelope = *scene.description.orientation;
      const OccurrenceCount count = count_occurrences(scene, envelope, 600, kSeed);
      MESSAGE(name << ": " << count.occurrences << " applicable, lost " << count.lost
                   << ", occurred of the kept " << count.kept_share);
      CHECK(count.occurrences > 10000);
      CHECK(count.lost == 0);
      CHECK(count.kept_share >= 0.9);
    }
  }

  TEST_CASE("real parts: a first touch is never on a dropped node alone") {
    if (!have_parts()) return;
    for (const std::string& name : shared_names()) {
      CAPTURE(name);
      CAPTURE(kSeed);
      const PrunedScene scene = pruned_part(name, kThirtyDegrees_rad);
      const TouchCount count =
          count_touches(scene, *scene.description.orientation, 120, 100, kSeed);
      MESSAGE(name << ": " << count.touches << " touches, dropped " << count.dropped);
      CHECK(count.touches > 3000);
      CHECK(count.dropped == 0);
    }
  }

  TEST_CASE("real parts: the two samplings see a wrong envelope and a missing piece") {
    if (!have_parts()) return;
    const PrunedScene narrow = pruned_part("plug_socket", kThirtyDegrees_rad / 1.5);
    const OrientationEnvelope wide = about_start(narrow.description, kThirtyDegrees_rad);
    CHECK(count_occurrences(narrow, wide, 600, kSeed).lost > 0);
    CHECK(count_touches(narrow, wide, 120, 100, kSeed).dropped > 0);
    const PrunedScene cup = pruned_part("cube_in_cup", kThirtyDegrees_rad);
    for (std::size_t piece = 0; piece < cup.fixed.size(); ++piece) {
      CAPTURE(piece);
      CHECK(count_touches(cup, *cup.description.orientation, 120, 100, kSeed, piece).dropped > 0);
    }
  }
}

}  // namespace haptic::tools::test
