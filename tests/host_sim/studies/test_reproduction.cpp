// SPDX-License-Identifier: Apache-2.0
// The reproduction of the paper's tables and figures, in its quick form.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "host_sim/lab/studies/reproduction/figures.hpp"
#include "host_sim/lab/studies/reproduction/graph_table.hpp"
#include "host_sim/lab/studies/reproduction/literal_table.hpp"
#include "host_sim/lab/studies/reproduction/reproduction.hpp"
#include "host_sim/lab/studies/reproduction/solid_union.hpp"
#include "host_sim/lab/studies/reproduction/timing_table.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/coherent_path.hpp"
#include "tests/support/program_run.hpp"
#include "tools/c_space/c_obstacle.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;
using haptic::tools::CFace;
using haptic::tools::CObstacle;
using haptic::tools::make_c_obstacle;

namespace {

constexpr double kExact_m = HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-12;

/// How the polygons of a polyhedron fit together, corners distinguished by their place.
struct SurfaceFacts {
  std::size_t corners = 0, edges = 0, faces = 0;
  bool closed = true;  ///< every edge in two faces, once in each direction
};

template <typename Faces>
SurfaceFacts surface_facts(const Faces& faces) {
  SurfaceFacts facts;
  std::vector<Vector> corners;
  std::map<std::pair<std::size_t, std::size_t>, int> directed;
  for (const auto& face : faces) {
    std::vector<std::size_t> loop;
    for (const Vector& p : face.polygon) {
      const auto known = std::find_if(corners.begin(), corners.end(), [&](const Vector& c) {
        return (c - p).norm() < (HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-9);
      });
      loop.push_back(static_cast<std::size_t>(known - corners.begin()));
      if (known == corners.end()) corners.push_back(p);
    }
    for (std::size_t k = 0; k < loop.size(); ++k)
      directed[{loop[k], loop[(k + 1) % loop.size()]}] += 1;
  }
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    facts.closed = facts.closed && count == 1 && back != directed.end() && back->second == 1;
  }
  facts.corners = corners.size();
  facts.edges = directed.size() / 2;
  facts.faces = faces.size();
  return facts;
}

double highest(const std::vector<Vector>& points, const Vector& n) {
  double best = -1e300;
  for (const Vector& p : points) best = std::max(best, n.dot(p));
  return best;
}

/// Checks P(R) at random orientations: closed, a sphere, support function h_B(n) - min n.(R a).
void check_obstacles(const Solid& a, const Solid& b, int orientations, std::uint64_t seed) {
  const std::vector<std::byte> bytes = scene_of(a, {&b, 1}, 1000.0, 1e-4);
  const CoreSession session(bytes, "pair");
  Seeded random(seed);
  int open = 0, not_sphere = 0;
  double worst_support = 0, worst_offset = 0;
  for (int k = 0; k < orientations; ++k) {
    const Rotation q = random.rotation();
    const CObstacle obstacle = make_c_obstacle(session.view(), 0, pose_at(Vector::Zero(), q));
    const SurfaceFacts facts = surface_facts(obstacle.faces);
    open += facts.closed ? 0 : 1;
    not_sphere += facts.corners + facts.faces == facts.edges + 2 ? 0 : 1;
    std::vector<Vector> corners, minus_a;
    for (const CFace& face : obstacle.faces) {
      corners.insert(corners.end(), face.polygon.begin(), face.polygon.end());
      for (const Vector& p : face.polygon)
        worst_offset = std::max(worst_offset, std::abs(face.normal.dot(p) - face.offset_m));
    }
    for (const Vector& v : a.vertices) minus_a.emplace_back(-(q * v));
    for (int d = 0; d < 20; ++d) {
      const Vector n = random.direction();
      const double expected = highest(b.vertices, n) + highest(minus_a, n);
      worst_support = std::max(worst_support, std::abs(highest(corners, n) - expected));
    }
  }
  CHECK(open == 0);
  CHECK(not_sphere == 0);
  CHECK(worst_support < kExact_m);
  CHECK(worst_offset < kExact_m);
}

/// True when `svg` is well-formed XML as far as our writer goes: tags nest, attributes are quoted,
/// no bare ampersand.
bool well_formed(const std::string& svg) {
  std::vector<std::string> open;
  std::size_t at = 0;
  if (!svg.starts_with("<?xml ")) return false;
  at = svg.find("?>") + 2;
  while (at < svg.size()) {
    if (svg[at] == '&') {
      const std::size_t end = svg.find(';', at);
      if (end == std::string::npos || end - at > 6) return false;
    }
    if (svg[at] == '>') return false;
    if (svg[at] != '<') {
      ++at;
      continue;
    }
    const std::size_t end = svg.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = svg.substr(at + 1, end - at - 1);
    if (std::count(tag.begin(), tag.end(), '"') % 2 != 0 || tag.find('<') != std::string::npos)
      return false;
    if (tag.starts_with("/")) {
      if (open.empty() || open.back() != tag.substr(1)) return false;
      open.pop_back();
    } else if (!tag.ends_with("/")) {
      open.push_back(tag.substr(0, tag.find(' ')));
    }
    at = end + 1;
  }
  return open.empty() && svg.ends_with("</svg>\n");
}

int count_of(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

const std::string& file_of(const PartReport& part, const std::string& name) {
  for (const OutputText& file : part.files) {
    if (file.name == name) return file.content;
  }
  FAIL("no file " << name);
  return part.markdown;
}

double area_of(const std::vector<Facet>& facets) {
  double area = 0;
  for (const Facet& facet : facets) {
    Vector sum = Vector::Zero();
    for (std::size_t k = 1; k + 1 < facet.polygon.size(); ++k)
      sum += (facet.polygon[k] - facet.polygon[0]).cross(facet.polygon[k + 1] - facet.polygon[0]);
    area += 0.5 * sum.norm();
  }
  return area;
}

}  // namespace

TEST_SUITE("host_sim.reproduction") {
  TEST_CASE("C-obstacle of applicable nodes: closed, Euler 2, support function of B (+) (-R A)") {
    check_obstacles(paper_tetrahedron(), paper_box(), 200, 1);
    check_obstacles(centred_box("box", 0.03, 0.02, 0.01), paper_box(), 200, 2);
    check_obstacles(prism_solid(12, 0.04, 0.08), paper_box(), 50, 3);
    const Vector axes(0.05, 0.04, 0.03);
    check_obstacles(ellipsoid_hull(20, axes, 5), ellipsoid_hull(20, axes, 6), 20, 4);
  }

  TEST_CASE("C-obstacle of aligned boxes: nodes of one plane become one face, the whole a box") {
    const Solid a = centred_box("box", 0.03, 0.02, 0.01), b = paper_box();
    const std::vector<std::byte> bytes = scene_of(a, {&b, 1}, 1000.0, 1e-4);
    const CoreSession session(bytes, "boxes");
    const CObstacle obstacle =
        make_c_obstacle(session.view(), 0, pose_at(Vector::Zero(), Rotation::Identity()));
    const SurfaceFacts facts = surface_facts(obstacle.faces);
    CHECK(facts.faces == 6);
    CHECK(facts.edges == 12);
    CHECK(facts.corners == 8);
    CHECK(facts.closed);
    // Four vertices of each face and the crossings of their edges, parallel ones apart.
    for (const CFace& face : obstacle.faces) {
      CHECK(face.nodes.size() == 4 + 4 + 8);
      CHECK(obstacle.face_of(face.nodes.back()) == &face);
    }
  }

  TEST_CASE("hull of points on an ellipsoid: convex, closed, every point a vertex") {
    for (const std::uint32_t count : {4u, 30u, 60u}) {
      const Solid hull = ellipsoid_hull(count, {0.05, 0.04, 0.03}, 9);
      const std::vector<Facet> facets = facets_of(hull, Vector::Zero(), Rotation::Identity());
      const SurfaceFacts facts = surface_facts(facets);
      CHECK(facts.closed);
      CHECK(facts.corners == count);
      CHECK(facts.faces == 2 * count - 4);
      double highest_over = -1;
      for (const Facet& facet : facets) {
        for (const Vector& p : hull.vertices)
          highest_over = std::max(highest_over, facet.normal.dot(p - facet.polygon[0]));
      }
      CHECK(highest_over < 1e-15);
    }
  }

  TEST_CASE("union of overlapping boxes: the area of its boundary") {
    std::vector<PaintedBody> bodies(2);
    bodies[0].facets =
        facets_of(box_solid("a", {0, 0, 0}, {2, 2, 2}), Vector::Zero(), Rotation::Identity());
    bodies[1].facets =
        facets_of(box_solid("b", {1, 1, 1}, {3, 3, 3}), Vector::Zero(), Rotation::Identity());
    cut_to_union(bodies);
    // Each cube loses three squares of side 1, which lie inside the other.
    CHECK(std::abs(area_of(bodies[0].facets) - 21) < 1e-12);
    CHECK(std::abs(area_of(bodies[1].facets) - 21) < 1e-12);
  }

  TEST_CASE("graph and subgraphs: 128 nodes, 17 to 72, local subgraphs below the paper's bounds") {
    const GraphFacts facts = graph_facts();
    CHECK(facts.nodes[0] == 32);
    CHECK(facts.nodes[1] == 24);
    CHECK(facts.nodes[2] == 72);
    CHECK(facts.arcs == 1332);
    const NeighborhoodTable table = neighborhood_table(3000);
    CHECK(table.at("one node of type A").largest == 25);
    CHECK(table.at("one node of type B").largest == 32);
    CHECK(table.at("one node of type C").least == 17);
    CHECK(table.at("face-face contact").largest == 72);
    CHECK(table.at("face-face contact").most_near == 19);
    CHECK(table.at("edge-face contact").least >= 26);
    CHECK(table.at("edge-face contact").largest <= 56);
    const LocalSizes sizes = local_sizes(20000);
    CHECK(sizes.poses[LocalSizes::kOneNear] > 15000);
    CHECK(sizes.poses[LocalSizes::kUpToFourNear] > 1000);
    for (std::size_t d = 0; d < LocalSizes::kDeltas_m.size(); ++d) {
      CHECK(sizes.share_below(LocalSizes::kOneNear, d, 5) >= 0.98);
      CHECK(sizes.share_below(LocalSizes::kUpToFourNear, d, 10) == 1.0);
      CHECK(sizes.share_below(LocalSizes::kOneNear, d, 1) == 0.0);  // the near node itself
    }
    const PartReport part = graph_part({true, false});
    CHECK(part.passed);
    CHECK(part.markdown.find("| all | 128 |") != std::string::npos);
    CHECK(part.findings[1].ours == "17 to 72");
    CHECK(well_formed(file_of(part, "local_subgraph.svg")));
    CHECK(count_of(file_of(part, "local_subgraph.svg"), "class=\"bar\"") > 20);
  }

  TEST_CASE("Fig. 2: the core reports the walk's nodes; four instants in both spaces") {
    const FaceWalk walk = make_face_walk();
    CHECK(std::equal(walk.sequence.begin(), walk.sequence.end(), kWalkNodes.begin(),
                     kWalkNodes.end()));
    CHECK(walk.relocalised == 0);
    const PartReport part = motion_part();
    CHECK(part.passed);
    const std::string& svg = file_of(part, "fig2.svg");
    CHECK(well_formed(svg));
    for (int k = 1; k <= 4; ++k) {
      CHECK(count_of(svg, "<g id=\"physical-" + std::to_string(k)) == 1);
      CHECK(count_of(svg, "<g id=\"c-space-" + std::to_string(k)) == 1);
    }
    CHECK(count_of(svg, "class=\"near\"") >= 4);  // the near C-face of every instant is in view
    CHECK(count_of(svg, "stroke-dasharray") > 20);
    for (const char* node : {"44 B", "124 C", "27 A", "113 C"})
      CHECK(svg.find(std::string("node ") + node) != std::string::npos);
  }

  TEST_CASE("Figs. 3 and 4: contacts, frame, force and torque") {
    const ContactScene edge = edge_face_scene();
    CHECK(edge.points.size() == 2);
    CHECK(edge.region.size() == 2);
    CHECK(edge.points[0].torque_frame[1] * edge.points[1].torque_frame[1] < 0);
    CHECK(edge.axis_x.dot(edge.torque_nm) > 0);
    const ContactScene outside = face_face_outside_scene(), inside = face_face_inside_scene();
    CHECK(outside.region.size() == 4);
    CHECK_FALSE(outside.pi_inside);
    CHECK(inside.pi_inside);
    // The x axis lies along the edge from App1 to App2.
    const Vector side = (outside.points[1].app_w - outside.points[0].app_w).normalized();
    CHECK(std::abs(std::abs(side.dot(outside.axis_x)) - 1) < 1e-6);
    const PartReport part = contacts_part();
    CHECK(part.passed);
    for (const char* name : {"fig3.svg", "fig4.svg"}) CHECK(well_formed(file_of(part, name)));
    CHECK(count_of(file_of(part, "fig3.svg"), ">App") >= 2);
    CHECK(count_of(file_of(part, "fig4.svg"), "class=\"region\"") == 2);
    CHECK(file_of(part, "fig4.svg") == file_of(contacts_part(), "fig4.svg"));
  }

  TEST_CASE("Fig. 5: stages in the paper's order, constant force, torque steps") {
    const ForceRun run = make_force_run();
    CHECK(run.sequence ==
          std::vector<ContactSituation>{ContactSituation::kNone, ContactSituation::kFaceVertex,
                                        ContactSituation::kEdgeFace, ContactSituation::kFaceFace});
    CHECK(run.contacts.front() == 0);
    CHECK(run.contacts.back() == 4);
    const PartReport part = forces_part();
    CHECK(part.passed);
    const std::string& svg = file_of(part, "fig5.svg");
    CHECK(well_formed(svg));
    CHECK(count_of(svg, "<polyline") == 8);
    CHECK(count_of(svg, "class=\"stage\"") == 8);
  }

  TEST_CASE("Figs. 6 and 8: five pieces in both spaces; the named neighbors") {
    const PartReport insertion = insertion_part();
    CHECK(insertion.passed);
    const std::string& svg = file_of(insertion, "fig6.svg");
    CHECK(well_formed(svg));
    CHECK(count_of(svg, "<g id=\"c-space-") == 4);
    CHECK(count_of(svg, "class=\"near\"") >= 2);  // a wall and the floor
    const PartReport neighbors = neighbors_part();
    CHECK(neighbors.passed);
    CHECK(well_formed(file_of(neighbors, "fig8.svg")));
  }

  TEST_CASE("coherent paths keep to their speed and stay near the obstacle") {
    const Solid box = paper_box();
    const std::vector<std::byte> bytes = scene_of(paper_tetrahedron(), {&box, 1}, 1000.0, 1e-4);
    const CoreSession session(bytes, "pair");
    const SceneOracle oracle(session.view());
    CoherentPath path(session.view(), {1.0, 10.0}, 3);
    std::vector<PairVerdict> verdicts;
    Pose last;
    double d = 0;
    int contact = 0;
    for (int tick = 0; tick < 4000; ++tick) {
      const Pose pose = path.next(d);
      oracle.evaluate(pose, verdicts);
      d = static_cast<double>(verdicts[0].truth.reference_m);
      contact += d <= 0 ? 1 : 0;
      if (tick > 0) {
        CHECK(static_cast<double>((pose.p_wa - last.p_wa).norm()) < 1.01e-3);
        CHECK(static_cast<double>(pose.q_wa.angularDistance(last.q_wa)) < 10.5e-3);
      }
      if (tick > 200) CHECK(d < 0.08);
      last = pose;
    }
    CHECK(contact > 200);
    CHECK(contact < 3500);
  }

  TEST_CASE("steps as printed fail where the core does not; same seed, same counts") {
    const LiteralRow row = literal_row(paper_tetrahedron(), paper_box(), {1.0, 10.0}, 2, 1500, 720);
    CHECK(row.ticks == 3000);
    CHECK(row.separated > 1000);
    CHECK(row.translation.totals.wrong_depth_ticks > 0);
    CHECK(row.translation.empty_sets > 0);
    CHECK(row.core.totals.wrong_verdict_ticks == 0);
    CHECK(row.core.totals.wrong_depth_ticks <= 3);
    const LiteralRow again =
        literal_row(paper_tetrahedron(), paper_box(), {1.0, 10.0}, 2, 1500, 720);
    CHECK(again.translation.totals.wrong_depth_ticks == row.translation.totals.wrong_depth_ticks);
    CHECK(again.separated == row.separated);
  }

  TEST_CASE("index: a part that fails is named, tables have a rule of equal width") {
    PartReport part;
    part.title = "A part";
    part.findings.push_back({"fact", "1", "2", yes_or_no(false), "because"});
    part.passed = false;
    const std::string page = index_page({&part, 1}, true);
    CHECK(page.find("| fact | 1 | 2 | no | because |") != std::string::npos);
    CHECK(page.find("does not: see the table above") != std::string::npos);
    CHECK(page.find("--quick") != std::string::npos);
    CHECK(table_head({"a", "b"}) == "| a | b |\n|---|---|\n");
    CHECK(fixed(-0.0001, 2) == "0.00");
    CHECK_FALSE(well_formed("<?xml version=\"1.0\"?><svg><g></svg>\n"));
  }

  TEST_CASE("program: quick run writes every file and ends with 0; usage 2; bad folder 4") {
    const ScratchFolder scratch("reproduction");
    const std::string out = scratch.file("new/folder");
    const ProgramResult run =
        run_program(HAPTIC_HOST_SIM, "reproduce-paper --quick --out '" + out + "'");
    CHECK(run.exit_code == 0);
    CHECK(run.err.find("9 / 9") != std::string::npos);
    const std::string index = text_of_file(out + "/README.md");
    for (const char* name :
         {"graph.md", "graph.csv", "neighborhoods.csv", "local_subgraph.csv", "local_subgraph.svg",
          "fig1.svg", "fig2.svg", "fig3.svg", "fig4.svg", "fig5.svg", "fig5.csv", "fig6.svg",
          "fig8.svg", "timing.md", "timing.csv", "literal.md", "literal.csv"}) {
      CHECK_MESSAGE(std::filesystem::file_size(out + "/" + name) > 40, name);
      CHECK_MESSAGE(index.find(std::string("](") + name + ")") != std::string::npos, name);
    }
    for (const char* words : {"| 128 |", "17 to 72", "44 -> 124 -> 27 -> 114", "0.1 to 0.6 ms",
                              "plate-plate 1.0 m/s", "Fig. 7"})
      CHECK_MESSAGE(index.find(words) != std::string::npos, words);
    CHECK(run_program(HAPTIC_HOST_SIM, "reproduce-paper").exit_code == 2);
    std::ofstream(scratch.file("file")) << "x";
    const ProgramResult bad = run_program(
        HAPTIC_HOST_SIM, "reproduce-paper --quick --out '" + scratch.file("file") + "'");
    CHECK(bad.exit_code == 4);
    CHECK(bad.err.find("is a file") != std::string::npos);
  }
}
