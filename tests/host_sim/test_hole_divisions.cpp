// SPDX-License-Identifier: Apache-2.0
// Holes cut into convex pieces in different ways feel the same. The figures are those of double
// precision.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "host_sim/lab/stability/division_comparison.hpp"
#include "rt_core/base/scalar.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// Whether a point lies in a piece, or within `room_m` of it.
bool inside(const tools::Body& body, const tools::ConvexPiece& piece, const Vector& p,
            double room_m) {
  return std::ranges::all_of(piece.faces, [&](const tools::PieceFace& face) {
    const tools::BodyPlane& plane = body.planes[face.plane];
    const Vector n(plane.normal[0], plane.normal[1], plane.normal[2]);
    return face.sign * (n.dot(p) - plane.offset_m) <= room_m;
  });
}

/// Pieces that hold the point in their interior.
int holders(const tools::Body& body, const Vector& p) {
  return static_cast<int>(std::ranges::count_if(
      body.pieces, [&](const auto& piece) { return inside(body, piece, p, 0); }));
}

/// The bodies are the same set of points, tiled once: no point lies in two pieces of either.
void check_same_part(const tools::Body& a, const tools::Body& b, const Vector& half) {
  constexpr std::uint64_t kSeed = 20260608;
  CAPTURE(kSeed);
  Seeded random(kSeed);
  CHECK(a.pieces.size() > 1);
  CHECK(b.volume_m3 == doctest::Approx(a.volume_m3).epsilon(1e-12));
  int in = 0;
  for (int k = 0; k < 20000; ++k) {
    Vector p;
    for (int i = 0; i < 3; ++i) p[i] = random.uniform(-half[i], half[i]);
    const int first = holders(a, p), second = holders(b, p);
    CHECK(first == second);
    CHECK(first <= 1);
    in += first;
  }
  CHECK(in > 1000);
}

/// Whether every piece of `a` has one with the same middle in `b`.
bool same_pieces(const tools::Body& a, const tools::Body& b) {
  const auto middle = [](const tools::ConvexPiece& piece) {
    Vector sum = Vector::Zero();
    for (const auto& v : piece.vertices) sum += Vector(v[0], v[1], v[2]);
    return Vector(sum / static_cast<double>(piece.vertices.size()));
  };
  return std::ranges::all_of(a.pieces, [&](const auto& x) {
    return std::ranges::any_of(
        b.pieces, [&](const auto& y) { return (middle(x) - middle(y)).norm() < 1e-9; });
  });
}

}  // namespace

TEST_SUITE("host_sim.hole_divisions") {
  TEST_CASE("divisions are of one part and differ") {
    for (const auto& bodies : {square_hole_divisions(0.0051), ell_pocket_divisions()}) {
      for (std::size_t k = 1; k < bodies.size(); ++k) {
        check_same_part(bodies[0], bodies[k], {0.026, 0.026, 0.051});
        CHECK_FALSE(same_pieces(bodies[0], bodies[k]));
      }
    }
    const auto inserts = ell_insert_divisions(2e-4);
    check_same_part(inserts[0], inserts[1], {0.019, 0.019, 0.006});
    CHECK_FALSE(same_pieces(inserts[0], inserts[1]));
  }

  TEST_CASE("faces in every tick, the rest by share, forces as strong as the paper's") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    for (const DivisionCase& contact : hole_division_cases()) {
      CAPTURE(contact.title);
      const DivisionComparison found = compare_divisions(contact);
      CHECK(found.pushed_ticks > found.ticks / 8);
      if (contact.other_strength.empty()) CHECK(found.contact_ticks > found.ticks / 8);
      for (const DivisionDifference& d : found.differences) {
        CAPTURE(d.division);
        CAPTURE(d.quantile_n(0.99));
        CHECK(d.worst_gap_m >= -2e-7);
        CAPTURE(d.quantile_n(1));
        CAPTURE(d.share_over(kFeltDifference_n));
        CAPTURE(found.tolerance_n);
        CHECK(agrees(d, contact.contact, found.tolerance_n));
        MESSAGE(contact.name, ", ", d.division, ": p99 ", d.quantile_n(0.99), " largest ",
                d.quantile_n(1), " N, k_t tol ", found.tolerance_n,
                ", over 0.01 N: ", 100 * d.share_over(kFeltDifference_n), " %");
      }
      CAPTURE(found.proxy_mean_n);
      CAPTURE(found.paper_mean_n);
      if (contact.other_strength.empty()) CHECK(found.same_strength());
    }
  }

  TEST_CASE("the comparison sees a floor that lies 1 um lower, and pieces counted twice") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    DivisionCase floor = hole_division_cases()[1];
    REQUIRE(floor.name == "floor");
    floor.divisions.resize(2);
    std::vector<Solid> lower = five_piece_hole(0.0051);
    for (Vector& v : lower.back().vertices) v.z() -= 1e-6;
    floor.divisions[1].fixed = united_body(lower);
    const DivisionComparison apart = compare_divisions(floor);
    CHECK_FALSE(agrees(apart.differences[0], floor.contact, apart.tolerance_n));
    CHECK(apart.differences[0].quantile_n(0.5) == doctest::Approx(1e-3).epsilon(0.01));

    const DivisionCase wall = hole_division_cases()[0];
    REQUIRE(wall.name == "wall");
    const DivisionComparison twice = compare_divisions(wall);
    CHECK_FALSE(agrees(twice.paper.back(), wall.contact, twice.tolerance_n));
    CHECK(twice.paper.back().share_over(kFeltDifference_n) > 0.1);
    CHECK(twice.paper.back().quantile_n(1) > 0.5);
  }
}
