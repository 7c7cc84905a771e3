// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "tests/support/rt_guard.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kTight_m = HAPTIC_REAL_IS_FLOAT ? 1e-7 : 1e-14;
const double kHalf = std::sqrt(0.5);

/// Geometry with room of its own.
struct Geometry : ContactGeometry {
  explicit Geometry(std::size_t room = 1024) : points(room), numbers(room) {
    polygon_w = BoundedList<Vec3>(points);
    ids = BoundedList<ContactId>(numbers);
  }
  std::vector<Vec3> points;
  std::vector<ContactId> numbers;
};

MeshFeature vertex(std::int32_t v) { return {FeatureKind::kVertex, {v, v}}; }
MeshFeature face(std::int32_t f) { return {FeatureKind::kFace, {f, f}}; }
MeshFeature edge(std::int32_t v, std::int32_t w) { return {FeatureKind::kEdge, {v, w}}; }

bool has(const ContactGeometry& contact, const ContactId& id) {
  return std::count(contact.ids.begin(), contact.ids.end(), id) == 1;
}

double distance(const Vec3& p, const Point& q) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double d = static_cast<double>(p[k]) - q[static_cast<std::size_t>(k)];
    sum += d * d;
  }
  return std::sqrt(sum);
}

/// Corners, in W, are those expected, each once.
void check_corners(const ContactGeometry& contact, const Vec3& x0_w,
                   const std::vector<Point>& expected, double tolerance_m) {
  REQUIRE(contact.polygon_w.size() == expected.size());
  for (const Point& corner : expected) {
    const auto close = [&](const Vec3& p) { return distance(x0_w + p, corner) <= tolerance_m; };
    CHECK(std::count_if(contact.polygon_w.begin(), contact.polygon_w.end(), close) == 1);
  }
}

/// What holds of every contact: frame, plane, order of the corners.
void check_frame(const ContactGeometry& contact) {
  const Vec3 &n = contact.normal_w, &e1 = contact.e1_w, &e2 = contact.e2_w;
  const Real tight = 16 * kRealEpsilon;
  CHECK(std::abs(n.norm() - 1) <= tight);
  CHECK(std::abs(e1.norm() - 1) <= tight);
  CHECK(std::abs(e1.dot(n)) <= tight);
  CHECK((e1.cross(e2) - n).norm() <= tight);
  CHECK((n.dot(contact.pi_w) * n - contact.pi_w).norm() <= tight);
  const std::uint32_t count = contact.polygon_w.size();
  for (std::uint32_t k = 0; k < count; ++k) {
    const Vec3& p = contact.polygon_w[k];
    CHECK(std::abs(n.dot(p - contact.pi_w)) <= 1.0e-6_r * (1 + p.norm()));
    if (count < 3) continue;
    const Vec3& q = contact.polygon_w[(k + 1) % count];
    const Vec3& r = contact.polygon_w[(k + 2) % count];
    CHECK((q - p).cross(r - q).dot(n) > 0);
  }
}

/// A box of 4 x 2 x 2 cm that stands on a table of 20 x 20 cm, its top at z = 0.
tools::SceneDescription box_on_table() {
  return scene_of(box({-0.02, -0.01, -0.01}, {0.02, 0.01, 0.01}),
                  {box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0})});
}

}  // namespace

TEST_SUITE("rt_core.contact_polygon") {
  TEST_CASE("face on face: four corners, and the ids of the four type-B contacts") {
    LoadedScene scene(box_on_table());
    const StepResult r = scene.step({0.03, 0, 0.0095});
    REQUIRE(r.situation == ContactSituation::kFaceFace);
    Geometry contact;
    scene.core->contact_geometry(0, contact);
    check_frame(contact);
    CHECK(contact.situation == ContactSituation::kFaceFace);
    CHECK(distance(contact.normal_w, {0, 0, 1}) <= kTight_m);
    CHECK(static_cast<double>(contact.d_near_m) == doctest::Approx(-0.0005));
    const Vec3 x0_w(0.03_r, 0, 0.0095_r);
    CHECK(distance(contact.point_w, {0.03, 0, 0}) <= kTight_m);
    CHECK(distance(contact.pi_w, {0, 0, -0.0095}) <= kTight_m);
    check_corners(contact, x0_w,
                  {{0.01, -0.01, 0}, {0.05, -0.01, 0}, {0.05, 0.01, 0}, {0.01, 0.01, 0}}, kTight_m);
    // Vertices of A's bottom are those without bit 2; B's top is its face 1.
    CHECK(contact.ids.size() == 4);
    for (const std::int32_t v : {0, 1, 2, 3})
      CHECK(has(contact, {ContactType::kB, vertex(v), face(1)}));
    CHECK_FALSE(contact.cut);
    // pi is nearest to the long sides: x lies along one.
    CHECK(std::abs(contact.e1_w[0]) >= 1 - 4 * kRealEpsilon);
  }

  TEST_CASE("face partly off a face: corners of A, corners of B and crossing edges, by their ids") {
    LoadedScene scene(scene_of(box({-0.02, -0.02, -0.01}, {0.02, 0.02, 0.01}),
                               {box({0, 0, -0.05}, {0.1, 0.1, 0})}));
    static_cast<void>(scene.step({0, 0, 0.0095}));
    Geometry contact;
    scene.core->contact_geometry(0, contact);
    check_frame(contact);
    check_corners(contact, Vec3(0, 0, 0.0095_r),
                  {{0, 0, 0}, {0.02, 0, 0}, {0.02, 0.02, 0}, {0, 0.02, 0}}, kTight_m);
    CHECK(has(contact, {ContactType::kA, face(0), vertex(4)}));
    CHECK(has(contact, {ContactType::kB, vertex(3), face(1)}));
    // A's edges x = 0.02 and y = 0.02 of its bottom, B's edges y = 0 and x = 0 of its top.
    CHECK(has(contact, {ContactType::kC, edge(1, 3), edge(4, 5)}));
    CHECK(has(contact, {ContactType::kC, edge(2, 3), edge(4, 6)}));
    CHECK(contact.ids.size() == 4);
  }

  TEST_CASE("edge on face: a segment, and the frame's x along it") {
    LoadedScene scene(box_on_table());
    const double c = std::cos(std::atan(1.0) / 2), s = std::sin(std::atan(1.0) / 2);
    const double height = 0.01 * std::sqrt(2.0) - 0.0002;
    const StepResult r = scene.step({0, 0, height}, {c, s, 0, 0});  // 45 degrees about x
    REQUIRE(r.situation == ContactSituation::kEdgeFace);
    Geometry contact;
    scene.core->contact_geometry(0, contact);
    check_frame(contact);
    check_corners(contact, Vec3(0, 0, static_cast<Real>(height)), {{-0.02, 0, 0}, {0.02, 0, 0}},
                  HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-12);
    CHECK(std::abs(contact.e1_w[0]) >= 1 - 64 * kRealEpsilon);
    for (const MeshFeature end : {vertex(0), vertex(1)})
      CHECK(has(contact, {ContactType::kB, end, face(1)}));
  }

  TEST_CASE("vertex on face and face on vertex: one point, one id") {
    const tools::Body spike =
        tetrahedron({0, 0, 0}, {0.02, 0.001, 0.03}, {-0.01, 0.02, 0.03}, {-0.01, -0.015, 0.032});
    LoadedScene scene(scene_of(spike, {box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0})}));
    REQUIRE(scene.step({0.01, 0.02, -0.0003}).situation == ContactSituation::kVertexFace);
    Geometry contact;
    scene.core->contact_geometry(0, contact);
    check_frame(contact);
    check_corners(contact, Vec3(0.01_r, 0.02_r, -0.0003_r), {{0.01, 0.02, 0}}, kTight_m);
    REQUIRE(contact.ids.size() == 1);
    CHECK(contact.ids[0] == ContactId{ContactType::kB, vertex(0), face(1)});

    LoadedScene turned(scene_of(box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0}), {spike}));
    // A's top touches the tip from below.
    REQUIRE(turned.step({0.01, 0.02, 0.0003}).situation == ContactSituation::kFaceVertex);
    turned.core->contact_geometry(0, contact);
    check_frame(contact);
    REQUIRE(contact.ids.size() == 1);
    CHECK(contact.ids[0] == ContactId{ContactType::kA, face(1), vertex(0)});
    check_corners(contact, Vec3(0.01_r, 0.02_r, 0.0003_r), {{0, 0, 0}}, kTight_m);
  }

  TEST_CASE("edges that cross: one point, the ends of both edges") {
    const tools::SceneDescription d =
        scene_of(box({-0.02, -0.01, -0.01}, {0.02, 0.01, 0.01}), {prism(4, 0.02, 0.2)});
    LoadedScene scene(d);
    // B's edges along z stand at 0, 90, 180, 270 degrees; A's edge along x crosses the one at +y.
    const double height = 0.02 + 0.01 * std::sqrt(2.0) - 0.0002;
    const double c = std::cos(std::atan(1.0) / 2), s = std::sin(std::atan(1.0) / 2);
    REQUIRE(scene.step({0.001, height, 0.004}, {c, s, 0, 0}).situation ==
            ContactSituation::kEdgeEdge);
    Geometry contact;
    scene.core->contact_geometry(0, contact);
    check_frame(contact);
    REQUIRE(contact.ids.size() == 1);
    CHECK(contact.ids[0].type == ContactType::kC);
    CHECK(contact.ids[0].of_b == edge(1, 5));
    check_corners(contact, Vec3(0.001_r, static_cast<Real>(height), 0.004_r), {{0, 0.02, 0.004}},
                  HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-12);
  }

  TEST_CASE("several pieces: each pair has its own plane, a pair that does not touch has none") {
    const tools::Body posts = join({box({-0.05, -0.05, -0.05}, {-0.01, 0.05, 0}),
                                    box({0.01, -0.05, -0.05}, {0.05, 0.05, 0}),
                                    box({0.2, -0.05, -0.05}, {0.3, 0.05, 0})});
    LoadedScene scene(scene_of(box({-0.02, -0.01, -0.01}, {0.02, 0.01, 0.01}), {posts}));
    static_cast<void>(scene.step({0, 0, 0.0095}));
    Geometry contact;
    const Vec3 x0_w(0, 0, 0.0095_r);
    scene.core->contact_geometry(0, contact);
    check_corners(contact, x0_w,
                  {{-0.02, -0.01, 0}, {-0.01, -0.01, 0}, {-0.01, 0.01, 0}, {-0.02, 0.01, 0}},
                  kTight_m);
    scene.core->contact_geometry(1, contact);
    check_frame(contact);
    check_corners(contact, x0_w,
                  {{0.01, -0.01, 0}, {0.02, -0.01, 0}, {0.02, 0.01, 0}, {0.01, 0.01, 0}}, kTight_m);
    scene.core->contact_geometry(2, contact);
    CHECK(contact.situation == ContactSituation::kNone);
    CHECK(contact.ids.empty());
    CHECK(contact.polygon_w.empty());
    CHECK(contact.normal_w == Vec3::Zero());
  }

  TEST_CASE("no contact: empty before the first tick, above, after leaving, after reset") {
    tools::SceneDescription d = box_on_table();
    d.parameters.exact_band_m = 0.005;
    LoadedScene scene(d);
    Geometry contact;
    const auto empty = [&] {
      scene.core->contact_geometry(0, contact);
      return contact.ids.empty() && contact.polygon_w.empty() &&
             contact.situation == ContactSituation::kNone;
    };
    CHECK(empty());
    static_cast<void>(scene.step({0, 0, 0.011}));
    CHECK(empty());
    static_cast<void>(scene.step({0, 0, 0.0095}));
    CHECK_FALSE(empty());
    static_cast<void>(scene.step({0, 0, 0.2}));
    static_cast<void>(scene.step({0, 0, 0.2}));
    REQUIRE_FALSE(scene.core->pair_report(0).visited);  // held by the gate
    CHECK(empty());
    static_cast<void>(scene.step({0, 0, 0.0095}));
    CHECK_FALSE(empty());
    scene.core->reset();
    CHECK(empty());
  }

  TEST_CASE("asking changes no tick, takes no heap, and a list without room says so") {
    LoadedScene scene(box_on_table()), twin(box_on_table());
    Geometry contact;
    for (int t = 0; t < 200; ++t) {
      const double a = 1e-4 * t;
      const Point p{0.09 + 1e-4 * t, 0, 0.0098};
      const std::array<double, 4> q{std::cos(a), 0, 0, std::sin(a)};
      const std::uint64_t hash = twin.step(p, q).state_hash;
      CHECK(scene.step(p, q).state_hash == hash);
      std::uint64_t calls = 0;
      {
        RtGuard guard;
        scene.core->contact_geometry(0, contact);
        calls = guard.heap_calls();
      }
      CHECK(calls == 0);
      CHECK(contact.ids.size() == scene.core->pair_report(0).contact_nodes.size());
      check_frame(contact);
    }
    Geometry narrow(2);
    scene.core->contact_geometry(0, narrow);
    CHECK(narrow.cut);
    CHECK(narrow.ids.size() == 2);
    CHECK(narrow.polygon_w.size() == 2);
  }

  TEST_CASE("a budget that leaves a pair out: its last contact is one node") {
    const tools::Body posts = join(
        {box({-0.05, -0.05, -0.05}, {-0.01, 0.05, 0}), box({0.01, -0.05, -0.05}, {0.05, 0.05, 0})});
    tools::SceneDescription d = scene_of(box({-0.02, -0.01, -0.01}, {0.02, 0.01, 0.01}), {posts});
    d.max_pair_visits = 1;
    LoadedScene scene(d);
    // Tilted to and fro about y, so that each post is the nearest once.
    Geometry contact;
    for (const double a : {0.01, -0.01, 0.01}) {
      const StepResult r = scene.step({0, 0, 0.0095}, {std::cos(a), 0, std::sin(a), 0});
      REQUIRE((r.flags & kFlagBudgetUsedUp) != 0);
      for (const std::uint32_t pair : {0u, 1u}) {
        const PairReport report = scene.core->pair_report(pair);
        scene.core->contact_geometry(pair, contact);
        CHECK(contact.ids.empty() == (contact.situation == ContactSituation::kNone));
        if (report.visited) CHECK_FALSE(contact.ids.empty());
        if (!report.visited && !contact.ids.empty()) CHECK(contact.polygon_w.size() == 1);
      }
    }
    CHECK_FALSE(contact.ids.empty());
  }
}
