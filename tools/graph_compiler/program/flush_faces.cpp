// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/flush_faces.hpp"

#include <cmath>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/mesh/shell_interior.hpp"

namespace haptic::tools {
namespace {

/// Cosine of 0.6 degrees: parts that are placed by hand are turned by less where they lie flush.
constexpr double kAlmostParallel = 0.99995;

/// A face of a fixed body in W.
struct FlatFace {
  std::vector<Point3> corners;
  Point3 normal{0, 0, 0};
  bool both_sides = false;  ///< a facet
  vec::Box box;
};

std::vector<FlatFace> faces_of(const SceneView& scene, std::uint32_t body,
                               std::span<const PieceExposure> exposure) {
  const BodyRecord& record = scene.bodies()[body];
  std::vector<FlatFace> faces;
  for (std::uint32_t k = record.piece_begin; k < record.piece_begin + record.piece_count; ++k) {
    const PieceView piece = scene.piece(k);
    const bool facet = is_flat(*piece.record);
    for (std::uint32_t f = 0; f < (facet ? 1 : piece.face_count); ++f) {
      const bool hidden =
          k < exposure.size() && f < exposure[k].face_hidden.size() && exposure[k].face_hidden[f];
      if (hidden) continue;
      FlatFace face;
      face.both_sides = facet;
      const Vec3 n = piece.face_normal(f);
      for (std::size_t i = 0; i < 3; ++i)
        face.normal[i] = static_cast<double>(n[static_cast<int>(i)]);
      for (const std::uint16_t v : piece.face_vertices(f)) {
        Point3 corner{};
        for (std::size_t i = 0; i < 3; ++i)
          corner[i] =
              record.reference_m[i] + static_cast<double>(piece.vertices[3 * std::size_t{v} + i]);
        face.corners.push_back(corner);
        face.box.include(corner);
      }
      faces.push_back(std::move(face));
    }
  }
  return faces;
}

/// From a face, whose corners make a convex polygon.
double distance_m(const Point3& p, const FlatFace& face) {
  double least = HUGE_VAL;
  for (std::size_t k = 1; k + 1 < face.corners.size(); ++k) {
    least = std::min(least,
                     triangle_distance(p, {face.corners[0], face.corners[k], face.corners[k + 1]}));
  }
  return least;
}

/// The highest step between two faces at their corners.
void measure(const FlatFace& a, const FlatFace& b, double least_m, double most_m, FlushStep& step) {
  double cosine = vec::dot(a.normal, b.normal);
  if (a.both_sides || b.both_sides) cosine = std::abs(cosine);
  if (cosine < kAlmostParallel) return;
  for (const auto& [from, to] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    for (const Point3& p : from->corners) {
      const double height = std::abs(vec::dot(to->normal, vec::sub(p, to->corners[0])));
      if (!(height > least_m) || height > most_m || !(height > step.height_m)) continue;
      if (distance_m(p, *to) > 2 * most_m) continue;
      step.height_m = height;
      step.place_m = p;
    }
  }
}

}  // namespace

std::vector<FlushStep> flush_steps(const SceneView& scene, std::span<const PieceExposure> exposure,
                                   double least_m, double most_m) {
  std::vector<std::vector<FlatFace>> faces;
  std::vector<vec::Box> boxes;
  for (std::uint32_t body = 1; body < scene.bodies().size(); ++body) {
    faces.push_back(faces_of(scene, body, exposure));
    vec::Box& box = boxes.emplace_back();
    for (const FlatFace& face : faces.back()) {
      box.include(face.box.low);
      box.include(face.box.high);
    }
  }
  std::vector<FlushStep> steps;
  std::vector<std::uint32_t> near;
  for (std::uint32_t i = 0; i + 1 < faces.size(); ++i) {
    std::vector<vec::Box> own;
    for (const FlatFace& face : faces[i]) own.push_back(face.box.grown(2 * most_m));
    const BoxTree tree(std::move(own));
    for (std::uint32_t j = i + 1; j < faces.size(); ++j) {
      if (!boxes[i].grown(2 * most_m).meets(boxes[j])) continue;
      FlushStep step{i + 1, j + 1, 0.0, {0, 0, 0}};
      for (const FlatFace& face : faces[j]) {
        tree.find(face.box, near);
        for (const std::uint32_t k : near) measure(faces[i][k], face, least_m, most_m, step);
      }
      if (step.height_m > 0.0) steps.push_back(step);
    }
  }
  return steps;
}

std::string flush_step_text(const FlushStep& step, const std::string& mesh,
                            const std::string& other_mesh, double climb_m) {
  const Point3& p = step.place_m;
  std::string text = formatted(
      "faces of [[static]] %u (%s) and %u (%s) are flush but for a step of %.3g m near (%.6g, "
      "%.6g, %.6g) m: ",
      step.body, mesh.c_str(), step.other, other_mesh.c_str(), step.height_m, p[0] + 0.0,
      p[1] + 0.0, p[2] + 0.0);
  if (step.height_m <= climb_m) {
    return text + formatted("climbed, as all steps up to climb_m = %.3g m are", climb_m);
  }
  return text +
         formatted("a real step, which holds the part: higher than climb_m = %.3g m", climb_m);
}

}  // namespace haptic::tools
