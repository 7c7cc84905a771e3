// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {
namespace {

/// Stiffness that the scenes of pairs name; the law of several bodies has its own springs.
constexpr double kPairStiffness_n_per_m = 1000;

tools::Body compiled_geometry(const FuzzBody& body) {
  return body.is_surface() ? facets_of(body.surface) : united_body(body.pieces);
}

std::vector<std::byte> pair_blob(const std::string& name, const FuzzBody& a, tools::Body b,
                                 double friction) {
  tools::SceneDescription description;
  description.name = name;
  description.moving.body = compiled_geometry(a);
  tools::PlacedBody standing;
  standing.body = std::move(b);
  standing.friction = friction;
  description.statics.push_back(std::move(standing));
  description.parameters.law = LawId::kProxy;
  description.parameters.k_f_n_per_m = kPairStiffness_n_per_m;
  description.parameters.goal_contact = 0;  // surfaces have no depth
  return tools::write_scene(description);
}

}  // namespace

const char* to_text(BodyRole role) {
  switch (role) {
    case BodyRole::kHand:
      return "hand";
    case BodyRole::kDriver:
      return "driver";
    case BodyRole::kLoose:
      break;
  }
  return "loose";
}

double FuzzBody::radius_m() const {
  double radius = 0;
  for (const Solid& piece : pieces) {
    for (const Vector& v : piece.vertices) radius = std::max(radius, v.norm());
  }
  for (const Vector& v : surface.vertices) radius = std::max(radius, v.norm());
  return radius;
}

std::vector<Triangle> FuzzBody::triangles() const {
  if (is_surface()) return triangles_of(surface);
  FuzzMesh mesh;
  for (const Solid& piece : pieces) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), piece.vertices.begin(), piece.vertices.end());
    for (const auto& loop : piece.loops) {
      for (std::size_t k = 2; k < loop.size(); ++k)
        mesh.triangles.push_back({first + loop[0], first + loop[k - 1], first + loop[k]});
    }
  }
  return triangles_of(mesh);
}

double BodiesScene::extent_m() const {
  double extent = 0;
  for (const Solid& piece : standing) {
    for (const Vector& v : piece.vertices) extent = std::max(extent, v.norm());
  }
  std::vector<double> farthest;  // of each body's grip point
  for (const FuzzBody& body : bodies) {
    const BodyRange& range = body.range;
    double far = std::max(range.home.norm() + range.reach_m.norm(), body.start.norm());
    if (range.carrier != kNoCarrier) far += farthest[range.carrier];
    farthest.push_back(far);
    extent = std::max(extent, far + body.radius_m());
  }
  return extent;
}

double BodiesScene::felt_radius_m() const {
  double smallest = std::numeric_limits<double>::max();
  for (const FuzzBody& body : bodies) {
    if (body.role != BodyRole::kDriver) smallest = std::min(smallest, body.radius_m());
  }
  return smallest;
}

CompiledBodies compiled_bodies(BodiesScene scene, double friction) {
  CompiledBodies result;
  for (std::size_t a = 0; a < scene.bodies.size(); ++a) {
    const FuzzBody& body = scene.bodies[a];
    for (std::size_t b = a + 1; b < scene.bodies.size(); ++b) {
      const FuzzBody& other = scene.bodies[b];
      result.pairs.push_back(
          {a, b,
           pair_blob(body.name + " on " + other.name, body, compiled_geometry(other), friction)});
    }
    if (body.role == BodyRole::kDriver || scene.standing.empty()) continue;
    result.pairs.push_back(
        {a, kFuzzStanding,
         pair_blob(body.name + " on what stands", body, united_body(scene.standing), friction)});
  }
  result.scene = std::move(scene);
  return result;
}

}  // namespace haptic::sim
