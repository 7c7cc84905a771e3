// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/contact_classes.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "tests/support/pruned_scenes.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// What the core adds of one near node.
struct Found {
  std::uint32_t patch = 0, body_b = 1;
  ContactIdentity identity;
  bool operator==(const Found& other) const {
    return body_b == other.body_b && identity == other.identity;
  }
};

/// ContactClasses with exactly the memory that they ask for, and what follows it.
struct Bench {
  explicit Bench(std::size_t room) {
    Arena counting;
    classes.place(counting, room);
    used = counting.used();
    memory.resize(used / sizeof(std::max_align_t) + 1 + kBehind);
    std::memset(memory.data(), kPattern, memory.size() * sizeof(std::max_align_t));
    Arena arena(reinterpret_cast<std::byte*>(memory.data()));
    classes.place(arena, room);
  }
  /// Forms the classes of nodes 0, 1, ... added in this order; heap calls.
  std::uint64_t form(const std::vector<Found>& found, const std::vector<std::uint32_t>& order) {
    const RtGuard guard;
    classes.clear();
    for (const std::uint32_t k : order) {
      classes.add(k, found[k].patch, found[k].body_b, found[k].identity);
    }
    classes.form();
    return guard.heap_calls();
  }
  std::uint64_t form(const std::vector<Found>& found) {
    std::vector<std::uint32_t> order(found.size());
    std::iota(order.begin(), order.end(), 0u);
    return form(found, order);
  }
  [[nodiscard]] std::vector<std::uint32_t> same_as(std::uint32_t k) const {
    std::vector<std::uint32_t> nodes;
    for (const ContactClasses::Member& member : classes.same_as(k)) nodes.push_back(member.node);
    return nodes;
  }
  [[nodiscard]] bool behind_is_untouched() const {
    const auto* bytes = reinterpret_cast<const unsigned char*>(memory.data());
    return std::all_of(bytes + used, bytes + memory.size() * sizeof(std::max_align_t),
                       [](unsigned char b) { return b == kPattern; });
  }

  static constexpr std::size_t kBehind = 64;
  static constexpr unsigned char kPattern = 0xA5;
  std::vector<std::max_align_t> memory;
  std::size_t used = 0;
  ContactClasses classes;
};

using Nodes = std::vector<std::uint32_t>;

/// Every node compared with every other.
Nodes same_by_comparison(const std::vector<Found>& found, std::uint32_t k) {
  Nodes nodes;
  for (std::uint32_t l = 0; l < found.size(); ++l) {
    if (found[l] == found[k]) nodes.push_back(l);
  }
  return nodes;
}

void check_against_comparison(const Bench& bench, const std::vector<Found>& found) {
  for (std::uint32_t k = 0; k < found.size(); ++k) {
    CAPTURE(k);
    CHECK(bench.same_as(k) == same_by_comparison(found, k));
    CHECK(bench.classes.patch_of(k) == found[k].patch);
    CHECK(bench.classes.class_of(k) < found.size());
    for (std::uint32_t l = 0; l < k; ++l) {
      const bool one = bench.classes.class_of(k) == bench.classes.class_of(l);
      if (one != (found[k] == found[l])) FAIL_CHECK("nodes " << k << " and " << l);
    }
  }
}

/// Identities that differ in one word, type or body, each several times.
std::vector<Found> drawn(std::uint64_t seed, std::uint32_t count, std::uint32_t kinds) {
  Random random(seed);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random.next() % n); };
  std::vector<Found> found(count);
  for (Found& f : found) {
    f.patch = below(7);
    f.body_b = 1 + below(kinds);
    f.identity.type = static_cast<ContactType>(below(3));
    f.identity.of_a = {below(kinds), below(2)};
    f.identity.of_b = {below(2), below(kinds)};
  }
  return found;
}

/// All basic contacts of the pairs of a scene, one patch per pair.
std::vector<Found> all_contacts(const SceneView& view, std::vector<NodeFeatures>& features) {
  std::vector<Found> found;
  for (std::uint32_t p = 0; p < view.pairs().size(); ++p) {
    const PairView pair = view.pair(p);
    for (std::uint32_t node = 0; node < pair.record->node_count; ++node) {
      const NodeFeatures of = node_features(pair, node);
      NearNode near;
      near.type = of.type;
      near.i = static_cast<std::uint16_t>(of.i);
      near.j = static_cast<std::uint16_t>(of.j);
      found.push_back({p, pair.b.record->body, contact_identity(pair, near)});
      features.push_back(of);
    }
  }
  return found;
}

/// Outward plane of a face: normal and offset.
std::array<Real, 4> plane_of(const PieceView& piece, std::uint32_t f) {
  const Vec3 n = piece.face_normal(f);
  return {n[0], n[1], n[2], n.dot(ConstVec3Map(piece.vertices + 3 * piece.face_vertices(f)[0]))};
}

/// One feature of a body by its geometry: of a corner of the mesh its place, of a vertex that a cut
/// has made itself.
bool same_feature(ContactType type, bool of_a, const PieceView& p, std::uint32_t i,
                  const PieceView& q, std::uint32_t j) {
  const bool face = type == (of_a ? ContactType::kA : ContactType::kB);
  if (face) return plane_of(p, i) == plane_of(q, j);
  if (type == ContactType::kC) {
    const auto plane = [](const PieceView& piece, std::uint32_t e, int k) {
      return plane_of(piece, piece.edges[e].face[k]);
    };
    return (plane(p, i, 0) == plane(q, j, 0) && plane(p, i, 1) == plane(q, j, 1)) ||
           (plane(p, i, 0) == plane(q, j, 1) && plane(p, i, 1) == plane(q, j, 0));
  }
  if (p.record == q.record && i == j) return true;
  const bool of_mesh = p.source_vertices[i] >= 0 && q.source_vertices[j] >= 0;
  return of_mesh && std::equal(p.vertices + 3 * i, p.vertices + 3 * i + 3, q.vertices + 3 * j);
}

/// A plate cut along a diagonal, so that two of its corners belong to both pieces.
tools::Body diagonal_plate() {
  const std::vector<Point> corners = {{-0.1, -0.1, -0.03}, {0.1, -0.1, -0.03}, {0.1, 0.1, -0.03},
                                      {-0.1, 0.1, -0.03},  {-0.1, -0.1, 0},    {0.1, -0.1, 0},
                                      {0.1, 0.1, 0},       {-0.1, 0.1, 0}};
  const auto half = [&](const std::vector<std::size_t>& of) {
    std::vector<Point> vertices;
    for (const std::size_t v : of) vertices.push_back(corners[v]);
    tools::Body body =
        convex_body(vertices, {{2, 1, 0}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}});
    body.pieces[0].source_vertex.assign(of.begin(), of.end());
    return body;
  };
  return join({half({0, 1, 2, 4, 5, 6}), half({0, 2, 3, 4, 6, 7})});
}

/// The plate in two whose vertices are numbered in opposite ways, so that edges run both ways.
tools::Body opposite_plate(const Point& lo, const Point& hi) {
  tools::Body plate = cut_box(lo, hi, {0.003}, {{}, {}});
  tools::ConvexPiece& piece = plate.pieces[1];
  const auto last = static_cast<std::uint32_t>(piece.vertices.size() - 1);
  std::ranges::reverse(piece.vertices);
  std::ranges::reverse(piece.source_vertex);
  for (tools::PieceFace& face : piece.faces) {
    for (std::uint32_t& v : face.loop) v = last - v;
  }
  return plate;
}

/// Nodes of each type whose class has others, and those whose class is not that of the geometry.
struct Shared {
  std::size_t nodes[3] = {};
  std::size_t wrong = 0;
};

/// All basic contacts of a box with a body in pieces.
Shared shared_on(const tools::Body& fixed) {
  const LoadedScene scene(scene_of(box({-0.03, -0.02, -0.02}, {0.03, 0.02, 0.02}), {fixed}));
  std::vector<NodeFeatures> features;
  const std::vector<Found> found = all_contacts(scene.view, features);
  Bench bench(found.size());
  static_cast<void>(bench.form(found));
  Shared shared;
  for (std::uint32_t k = 0; k < found.size(); ++k) {
    const PairView pair = scene.view.pair(found[k].patch);
    const NodeFeatures& m = features[k];
    Nodes wanted;
    for (std::uint32_t l = 0; l < found.size(); ++l) {
      const PairView other = scene.view.pair(found[l].patch);
      const NodeFeatures& n = features[l];
      if (m.type == n.type && same_feature(m.type, true, pair.a, m.i, other.a, n.i) &&
          same_feature(m.type, false, pair.b, m.j, other.b, n.j)) {
        wanted.push_back(l);
      }
    }
    shared.wrong += bench.same_as(k) != wanted;
    shared.nodes[static_cast<std::size_t>(m.type)] += wanted.size() > 1;
  }
  return shared;
}

}  // namespace

TEST_SUITE("rt_core.contact_classes") {
  TEST_CASE("one contact of two patches is one class, what differs in any part is another") {
    const ContactIdentity one = {ContactType::kA, {4, 0}, {0, 9}};
    std::vector<Found> found = {{0, 1, one}, {1, 1, one}};
    for (int part = 0; part < 6; ++part) {
      Found other = {2, 1, one};
      if (part == 0) other.body_b = 2;
      if (part == 1) other.identity.type = ContactType::kB;
      if (part == 2) other.identity.of_a[0] += 1;  // the other side of the plane
      if (part == 3) other.identity.of_a[1] += 1;
      if (part == 4) other.identity.of_b[0] = 1;  // a vertex that a cut has made
      if (part == 5) other.identity.of_b[1] += 1;
      found.push_back(other);
    }
    Bench bench(found.size());
    CHECK(bench.form(found) == 0);
    CHECK(bench.same_as(0) == Nodes{0, 1});
    CHECK(bench.same_as(1) == Nodes{0, 1});
    CHECK(bench.classes.class_of(0) == bench.classes.class_of(1));
    for (std::uint32_t k = 2; k < found.size(); ++k) CHECK(bench.same_as(k) == Nodes{k});
    check_against_comparison(bench, found);
  }

  TEST_CASE("different contacts with equal keys are distinguished") {
    // The key begins as body and type: the first word of A can undo what they differ in.
    const Found plane_of_one = {0, 0, {ContactType::kA, {0, 0}, {0, 3}}};
    const Found plane_of_other = {1, 1, {ContactType::kA, {0x100, 0}, {0, 3}}};
    const Found other_type = {2, 0, {ContactType::kB, {1, 0}, {0, 3}}};
    const std::vector<Found> found = {plane_of_one, plane_of_other, other_type,
                                      plane_of_one, plane_of_other, other_type};
    Bench bench(found.size());
    static_cast<void>(bench.form(found));
    for (std::uint32_t k = 1; k < 3; ++k) {  // or the case has become an ordinary one
      CHECK(bench.classes.same_as(k)[0].key == bench.classes.same_as(0)[0].key);
    }
    CHECK(bench.same_as(0) == Nodes{0, 3});
    CHECK(bench.same_as(4) == Nodes{1, 4});
    CHECK(bench.same_as(2) == Nodes{2, 5});
    check_against_comparison(bench, found);
  }

  TEST_CASE("many contacts: as by comparing all pairs, in any order they come") {
    for (const std::uint32_t kinds : {1u, 2u, 5u, 40u}) {
      const std::vector<Found> found = drawn(11 + kinds, 400, kinds);
      Bench bench(found.size());
      CHECK(bench.form(found) == 0);
      check_against_comparison(bench, found);
      Random random(kinds);
      Nodes order(found.size());
      std::iota(order.begin(), order.end(), 0u);
      for (int turn = 0; turn < 5; ++turn) {
        for (std::size_t k = order.size(); k-- > 1;) {
          std::swap(order[k], order[random.next() % (k + 1)]);
        }
        Bench shuffled(found.size());
        static_cast<void>(shuffled.form(found, order));
        for (std::uint32_t k = 0; k < found.size(); ++k) {
          if (shuffled.same_as(k) != bench.same_as(k)) FAIL_CHECK("node " << k);
        }
      }
    }
  }

  TEST_CASE("as many nodes as there is room for: one class of all, or each its own") {
    for (const std::uint32_t room : {0u, 1u, 2u, 3u, 1000u}) {
      CAPTURE(room);
      std::vector<Found> found(room);
      Bench bench(room);
      CHECK(bench.form(found) == 0);
      Nodes all(room);
      std::iota(all.begin(), all.end(), 0u);
      for (std::uint32_t k = 0; k < room; ++k) {
        if (bench.same_as(k) != all || bench.classes.class_of(k) != 0) FAIL_CHECK("node " << k);
      }
      for (std::uint32_t k = 0; k < room; ++k) found[k].identity.of_b[1] = k;
      CHECK(bench.form(found) == 0);
      std::vector<bool> taken(room);
      for (std::uint32_t k = 0; k < room; ++k) {
        if (bench.same_as(k) != Nodes{k}) FAIL_CHECK("node " << k);
        const std::uint32_t number = bench.classes.class_of(k);
        REQUIRE(number < room);
        CHECK_FALSE(taken[number]);
        taken[number] = true;
      }
      CHECK(bench.behind_is_untouched());
    }
  }

  TEST_CASE("clear forgets: classes of fewer nodes, and of the same ones otherwise") {
    const std::vector<Found> first = drawn(3, 60, 2);
    Bench bench(first.size());
    static_cast<void>(bench.form(first));
    std::vector<Found> second = drawn(4, 60, 2);
    const Nodes some = {57, 1, 30, 31, 2, 59, 40, 41};
    for (const std::uint32_t k : some) second[k].patch += 7;
    static_cast<void>(bench.form(second, some));
    std::size_t members = 0;
    for (const std::uint32_t k : some) {
      Nodes wanted;
      for (const std::uint32_t l : same_by_comparison(second, k)) {
        if (std::ranges::find(some, l) != some.end()) wanted.push_back(l);
      }
      CHECK(bench.same_as(k) == wanted);
      CHECK(bench.classes.patch_of(k) == second[k].patch);
      members = std::max(members, wanted.size());
    }
    bench.classes.clear();
    bench.classes.form();
    const std::vector<Found> one = {first[0]};
    static_cast<void>(bench.form(one));
    CHECK(bench.same_as(0) == Nodes{0});
  }

  TEST_CASE("every basic contact of a body in pieces: one where its features go on") {
    const Point lo = {-0.1, -0.1, -0.03}, hi = {0.1, 0.1, 0};
    for (const tools::Body& plate :
         {cut_box(lo, hi, {0.003}, {{-0.004}, {-0.004}}), cut_box(lo, hi, {0.003}, {{}, {-0.004}}),
          opposite_plate(lo, hi)}) {
      const Shared found = shared_on(plate);
      CHECK(found.wrong == 0);
      CHECK(found.nodes[0] == 0);  // vertices of cuts coincide and are two
      CHECK(found.nodes[1] > 0);   // top and bottom go on in every piece
      CHECK(found.nodes[2] > 0);   // edges go on across the cuts
    }
    const Shared found = shared_on(diagonal_plate());
    CHECK(found.wrong == 0);
    CHECK(found.nodes[0] > 0);  // four corners of the plate are of both pieces
    CHECK(found.nodes[1] > 0);
    CHECK(found.nodes[2] == 0);
  }

  TEST_CASE("two faces are one plane exactly, not nearly") {
    const tools::Body moving = box({-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01});
    const double top = 0.05;
    for (const double other :
         {top, static_cast<double>(std::nextafter(static_cast<Real>(top), 1.0_r))}) {
      const LoadedScene scene(scene_of(moving, {join({box({-0.1, -0.1, 0}, {0, 0.1, top}),
                                                      box({0, -0.1, 0}, {0.1, 0.1, other})})}));
      std::vector<Found> found;
      for (std::uint32_t p = 0; p < 2; ++p) {
        const PairView pair = scene.view.pair(p);
        for (std::uint32_t f = 0; f < pair.b.face_count; ++f) {
          if (pair.b.face_normal(f)[2] < 0.5_r) continue;
          NearNode near;
          near.type = ContactType::kB;
          near.j = static_cast<std::uint16_t>(f);
          found.push_back({p, 1, contact_identity(pair, near)});
        }
      }
      REQUIRE(found.size() == 2);
      Bench bench(2);
      static_cast<void>(bench.form(found));
      CHECK(bench.same_as(0) == (other == top ? Nodes{0, 1} : Nodes{0}));
    }
  }
}
