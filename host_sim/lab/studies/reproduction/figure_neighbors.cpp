// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/figures.hpp"

#include <algorithm>
#include <array>

#include "host_sim/lab/studies/reproduction/drawing.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

/// The contact of the figure and its three named neighbors, by the numbers of our bodies: the
/// tetrahedron stands on the top of the box with its vertex V1, near the edge e1 to the face f2.
struct NamedContacts {
  std::uint32_t v1 = 3, e1_a = 0, face_a = 0;  // of A: V1, E1 (an edge at V1), F1 (a face at V1)
  std::uint32_t f1 = 0, f2 = 0, edge_b = 0, v3 = 0;  // of B: f1 (top), f2, e1 (between them), v3
};

NamedContacts named_contacts(const PairView& pair) {
  NamedContacts named;
  named.e1_a = pair.a.edges_at(named.v1)[2];
  for_each_face_at(pair.a, named.v1, [&](std::uint32_t f) { named.face_a = f; });
  named.edge_b = 8;  // an edge of the top
  const EdgeRecord& edge = pair.b.edges[named.edge_b];
  named.f2 = edge.face[0] == named.f1 ? edge.face[1] : edge.face[0];
  named.v3 = edge.vertex[0];
  return named;
}

Vector middle(const Solid& solid, std::span<const std::uint32_t> vertices) {
  Vector sum = Vector::Zero();
  for (const std::uint32_t v : vertices) sum += solid.vertices[v];
  return sum / static_cast<double>(vertices.size());
}

std::string picture(const PairView& pair, const NamedContacts& named,
                    const std::array<std::string, 4>& lines, const std::string& counts) {
  SvgPage page(980, 520, "A type-B basic contact and some of its G-neighbors, as Fig. 8");
  const Solid a = paper_tetrahedron(), b = paper_box();
  const Rotation q = turn_between(a.vertices[named.v1], Vector(0.02, -0.03, -1.0));
  const Vector x = Vector(0.03, -0.01, 0.04) - q * a.vertices[named.v1];
  const Camera camera({1.0, -0.55, 0.6}, Vector::UnitZ(), {0, 0, 0.03}, {260, 285}, 2100);
  std::vector<Facet> facets_b = facets_of(b, Vector::Zero(), Rotation::Identity());
  facets_b[named.f1].lit = true;
  draw_body(page, camera, facets_b, {165, 195, 225, 1.0, true, 1.2});
  draw_body(page, camera, facets_of(a, x, q), {240, 190, 150, 0.65, true, 1.2});
  const auto on_a = [&](std::uint32_t v) { return camera.project(x + q * a.vertices[v]); };
  const auto on_b = [&](std::uint32_t v) { return camera.project(b.vertices[v]); };
  const EdgeRecord &ea = pair.a.edges[named.e1_a], &eb = pair.b.edges[named.edge_b];
  page.line(on_a(ea.vertex[0]), on_a(ea.vertex[1]), kForceColour, 4);
  page.line(on_b(eb.vertex[0]), on_b(eb.vertex[1]), kTorqueColour, 4);
  page.dot(on_a(named.v1), 5, kForceColour);
  page.dot(on_b(named.v3), 5, kTorqueColour);
  const auto beside = [&](Pixel at, double dx, double dy, const char* name, const char* colour) {
    page.label({at.x + dx, at.y + dy}, name, colour, 15, "middle");
  };
  const auto between = [](Pixel l, Pixel r) { return Pixel{0.5 * (l.x + r.x), 0.5 * (l.y + r.y)}; };
  beside(on_a(named.v1), 0, 22, "V1", kForceColour);
  beside(between(on_a(ea.vertex[0]), on_a(ea.vertex[1])), -16, 0, "E1", kForceColour);
  beside(camera.project(x + q * middle(a, a.loops[named.face_a])), 8, 5, "F1", kForceColour);
  beside(between(on_b(eb.vertex[0]), on_b(eb.vertex[1])), 12, 20, "e1", kTorqueColour);
  beside(on_b(named.v3), 16, -8, "v3", kTorqueColour);
  beside(camera.project(middle(b, b.loops[named.f1]) + Vector(-0.02, -0.03, 0)), 0, 5, "f1",
         kTorqueColour);
  beside(camera.project(middle(b, b.loops[named.f2])), 0, 5, "f2", kTorqueColour);
  double y = 120;
  for (const std::string& line : lines) {
    page.text(560, y, line, "start", 14);
    y += 26;
  }
  page.text(560, y + 12, counts, "start", 14);
  return page.finish();
}

}  // namespace

PartReport neighbors_part() {
  const Solid box = paper_box();
  const std::vector<std::byte> bytes = scene_of(paper_tetrahedron(), {&box, 1}, 1000.0, 1e-4);
  const CoreSession session(bytes, "tetrahedron and box");
  const PairView pair = session.view().pair(0);
  const NamedContacts named = named_contacts(pair);
  const NodeNumbering numbers = numbering(pair.a, pair.b);
  const std::uint32_t node = numbers.type_b(named.v1, named.f1);
  const std::uint32_t neighbors[3] = {numbers.type_b(named.v1, named.f2),
                                      numbers.type_c(named.e1_a, named.edge_b),
                                      numbers.type_a(named.face_a, named.v3)};
  std::array<std::uint32_t, 3> by_type{};
  std::array<bool, 3> found{};
  for_each_graph_neighbor(pair, ContactType::kB, named.v1, named.f1, [&](std::uint32_t other) {
    by_type[static_cast<std::size_t>(contact_type(pair.record, other))] += 1;
    for (std::size_t i = 0; i < 3; ++i) found[i] = found[i] || other == neighbors[i];
  });
  const char* names[3] = {"(V1, f2)", "(E1, e1)", "(F1, v3)"};
  std::array<std::string, 4> lines;
  lines[0] = "basic contact (V1, f1): node " + node_text(pair, node);
  for (std::size_t i = 0; i < 3; ++i) {
    lines[i + 1] = std::string(names[i]) + ": node " + node_text(pair, neighbors[i]) +
                   (found[i] ? ", a G-neighbor" : ", NOT a G-neighbor");
  }
  const std::uint32_t all = by_type[0] + by_type[1] + by_type[2];
  const std::string counts = std::to_string(all) + " G-neighbors: " + std::to_string(by_type[0]) +
                             " of type A, " + std::to_string(by_type[1]) + " of type B, " +
                             std::to_string(by_type[2]) + " of type C";
  PartReport report;
  report.title = "Neighbors of a type-B basic contact (Fig. 8, Appendix)";
  report.passed = found[0] && found[1] && found[2];
  for (const std::string& line : lines) report.markdown += "- " + line + "\n";
  report.markdown += "- " + counts + "\n\n" + picture_line("fig8.svg", "Neighbors of a contact");
  report.findings.push_back(
      {"Fig. 8, neighbors of (V1, f1)", "(V1, f2), (E1, e1) and (F1, v3) among them",
       report.passed ? "all three; " + counts : "not all three", yes_or_no(report.passed), ""});
  report.files = {{"fig8.svg", picture(pair, named, lines, counts)}};
  return report;
}

}  // namespace haptic::sim
