// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptic::sim {
namespace {

constexpr double kSocketDepth_m = 0.040, kBlockHalf_m = 0.025, kSocketBlockDepth_m = 0.050;
constexpr double kPegWidth_m = 0.020, kPegLength_m = 0.060;

std::uint32_t count_of(std::size_t n) { return static_cast<std::uint32_t>(n); }

/// Index of a plane in the body, shared by coplanar faces of its pieces (equal or opposite bits).
std::uint32_t plane_index(tools::Body& body, const tools::BodyPlane& plane, int& sign) {
  for (std::uint32_t p = 0; p < body.planes.size(); ++p) {
    for (const int s : {1, -1}) {
      const tools::BodyPlane& other = body.planes[p];
      const double factor = s;
      bool same = other.offset_m == factor * plane.offset_m;
      for (std::size_t i = 0; i < 3; ++i)
        same = same && other.normal[i] == factor * plane.normal[i];
      if (!same) continue;
      sign = s;
      return p;
    }
  }
  sign = 1;
  body.planes.push_back(plane);
  return count_of(body.planes.size() - 1);
}

void add_piece(tools::Body& body, const Solid& solid, Vector& moment) {
  tools::ConvexPiece piece;
  for (std::size_t v = 0; v < solid.vertices.size(); ++v) {
    const Vector& p = solid.vertices[v];
    piece.vertices.push_back({p[0], p[1], p[2]});
    piece.source_vertex.push_back(static_cast<std::int64_t>(v));
  }
  const Vector& origin = solid.vertices.front();
  for (std::size_t f = 0; f < solid.loops.size(); ++f) {
    const std::vector<std::uint32_t>& loop = solid.loops[f];
    const Vector& first = solid.vertices[loop[0]];
    Vector normal = Vector::Zero();
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      const Vector &second = solid.vertices[loop[k]], &third = solid.vertices[loop[k + 1]];
      normal += (second - first).cross(third - first);
      const double volume = (first - origin).dot((second - origin).cross(third - origin)) / 6.0;
      piece.volume_m3 += volume;
      moment += volume * (origin + 0.25 * (first + second + third - 3.0 * origin));
    }
    normal.normalize();
    tools::BodyPlane plane;
    for (int i = 0; i < 3; ++i)  // + 0.0: no negative zeros, which would make equal planes differ
      plane.normal[static_cast<std::size_t>(i)] = normal[i] + 0.0;
    plane.offset_m = normal.dot(first) + 0.0;
    tools::PieceFace face;
    face.plane = plane_index(body, plane, face.sign);
    face.loop = loop;
    face.source_face = static_cast<std::int64_t>(f);
    piece.faces.push_back(face);
  }
  body.volume_m3 += piece.volume_m3;
  body.pieces.push_back(std::move(piece));
}

}  // namespace

tools::Body united_body(std::span<const Solid> pieces) {
  tools::Body body;
  body.name = pieces.front().name;
  Vector moment = Vector::Zero();
  for (const Solid& piece : pieces) add_piece(body, piece, moment);
  const Vector centre = moment / body.volume_m3;
  body.centre_of_volume_m = {centre[0], centre[1], centre[2]};
  return body;
}

double Seeded::uniform(double low, double high) { return low + (high - low) * random_.uniform(); }

std::uint32_t Seeded::below(std::uint32_t count) {
  return std::min(count - 1, static_cast<std::uint32_t>(uniform(0.0, static_cast<double>(count))));
}

Vector Seeded::direction() {
  for (;;) {
    const double x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
    const Vector v(x, y, z);
    const double n = v.norm();
    if (n <= 1.0 && n > 0.1) return v / n;
  }
}

Rotation Seeded::rotation() {
  for (;;) {
    const double w = uniform(-1, 1), x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
    const Rotation q(w, x, y, z);
    const double n = q.norm();
    if (n <= 1.0 && n > 0.1) return q.normalized();
  }
}

Solid box_solid(const std::string& name, const Vector& low, const Vector& high) {
  Solid box{name, {}, {}};
  for (unsigned k = 0; k < 8; ++k) {
    box.vertices.emplace_back((k & 1u) != 0 ? high[0] : low[0], (k & 2u) != 0 ? high[1] : low[1],
                              (k & 4u) != 0 ? high[2] : low[2]);
  }
  box.loops = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return box;
}

Solid centred_box(const std::string& name, double half_x, double half_y, double half_z) {
  const Vector half(half_x, half_y, half_z);
  return box_solid(name, -half, half);
}

Solid paper_tetrahedron() {
  Solid solid{"tetrahedron",
              {{0.0, 0.0, 0.06}, {0.05, 0.0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}},
              {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  return solid;
}

Solid paper_box() {
  const Solid natural = centred_box("box", 0.06, 0.05, 0.04);
  constexpr std::uint32_t kLabel[8] = {0, 1, 2, 4, 5, 6, 7, 3};
  Solid box = natural;
  for (std::size_t k = 0; k < 8; ++k) box.vertices[kLabel[k]] = natural.vertices[k];
  for (auto& loop : box.loops) {
    for (std::uint32_t& v : loop) v = kLabel[v];
  }
  std::swap(box.loops[0], box.loops[1]);  // the top first
  return box;
}

Solid prism_solid(std::uint32_t sides, double radius, double height) {
  Solid prism{"prism", {}, {}};
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t level = 0; level < 2; ++level) {
    for (std::uint32_t k = 0; k < sides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / sides;
      prism.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                                  (level == 0 ? -0.5 : 0.5) * height);
    }
  }
  for (std::uint32_t k = 0; k < sides; ++k) {
    bottom.push_back(sides - 1 - k);
    top.push_back(sides + k);
    const std::uint32_t next = (k + 1) % sides;
    prism.loops.push_back({k, next, sides + next, sides + k});
  }
  prism.loops.push_back(bottom);
  prism.loops.push_back(top);
  return prism;
}

Solid wedge_solid() {
  return {"wedge",
          {{-0.05, 0.02, -0.05},
           {0.03, 0.02, -0.05},
           {-0.05, -0.03, 0.05},
           {0.03, -0.03, 0.05},
           {-0.05, 0.07, 0.05},
           {0.03, 0.07, 0.05}},
          {{0, 1, 3, 2}, {0, 4, 5, 1}, {2, 3, 5, 4}, {0, 2, 4}, {1, 5, 3}}};
}

Solid ellipsoid_hull(std::uint32_t count, const Vector& half_axes, std::uint64_t seed) {
  Seeded random(seed);
  Solid hull{"hull " + std::to_string(count), {}, {}};
  for (std::uint32_t k = 0; k < count; ++k)
    hull.vertices.push_back(half_axes.cwiseProduct(random.direction()));
  const std::vector<Vector>& p = hull.vertices;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::uint32_t j = i + 1; j < count; ++j) {
      for (std::uint32_t k = j + 1; k < count; ++k) {
        const Vector n = (p[j] - p[i]).cross(p[k] - p[i]);
        bool above = false, below = false;
        for (std::uint32_t m = 0; m < count && !(above && below); ++m) {
          if (m == i || m == j || m == k) continue;
          (n.dot(p[m] - p[i]) > 0 ? above : below) = true;
        }
        if (above && below) continue;
        if (above) {
          hull.loops.push_back({i, k, j});
        } else {
          hull.loops.push_back({i, j, k});
        }
      }
    }
  }
  return hull;
}

std::vector<Solid> five_piece_hole(double half_width_m) {
  const double w = half_width_m, b = kBlockHalf_m;
  return {box_solid("wall -x", {-b, -b, -kSocketDepth_m}, {-w, b, 0}),
          box_solid("wall +x", {w, -b, -kSocketDepth_m}, {b, b, 0}),
          box_solid("wall -y", {-w, -b, -kSocketDepth_m}, {w, -w, 0}),
          box_solid("wall +y", {-w, w, -kSocketDepth_m}, {w, b, 0}),
          box_solid("floor", {-b, -b, -kSocketBlockDepth_m}, {b, b, -kSocketDepth_m})};
}

Solid square_peg() {
  return centred_box("peg", kPegWidth_m / 2, kPegWidth_m / 2, kPegLength_m / 2);
}

PartAmongSolids cube_over_wall(double gap_m) {
  constexpr double kHalf = 0.010, kTop = 0.050;
  return {centred_box("cube", kHalf, kHalf, kHalf),
          {centred_box("wall", 0.1, 0.1, kTop)},
          std::sqrt(3.0) * kHalf,
          Vector(0, 0, kTop + kHalf + gap_m)};
}

PartAmongSolids peg_in_hole(double clearance_m, double depth_m) {
  return {square_peg(), five_piece_hole(kPegWidth_m / 2 + clearance_m),
          0.5 * std::hypot(kPegWidth_m, kPegWidth_m, kPegLength_m),
          Vector(0, 0, kPegLength_m / 2 - depth_m)};
}

std::vector<std::byte> scene_with(const Solid& a, std::span<const Solid> pieces,
                                  const SceneParameters& parameters, std::uint32_t max_pair_visits,
                                  const tools::GuideTables* guide) {
  tools::SceneDescription scene;
  if (guide != nullptr) scene.guide = *guide;
  scene.name = a.name + " on " + pieces.front().name;
  scene.moving.body = united_body({&a, 1});
  scene.statics.push_back({united_body(pieces), {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}});
  scene.parameters = parameters;
  scene.max_pair_visits = max_pair_visits;
  return tools::write_scene(scene);
}

std::vector<std::byte> scene_of(const Solid& a, std::span<const Solid> pieces, double k_f_n_per_m,
                                double epsilon_m, LawId law, double exact_band_m,
                                std::uint32_t max_pair_visits) {
  SceneParameters parameters = tools::default_parameters();
  parameters.law = law;
  parameters.k_f_n_per_m = k_f_n_per_m;
  parameters.epsilon_m = epsilon_m;
  parameters.exact_band_m = exact_band_m;
  return scene_with(a, pieces, parameters, max_pair_visits);
}

// Out of line: of what Eigen looks for an axis with, a compiler has for seconds.
Rotation turn_between(const Vector& from, const Vector& to) {
  return Rotation::FromTwoVectors(from, to);
}

Pose pose_at(const Vector& p, const Rotation& q) {
  Pose pose;
  pose.p_wa = p.cast<Real>();
  pose.q_wa = q.cast<Real>();
  return pose;
}

MotionSample sample_at(double t_s, const Vector& p, const Rotation& q) {
  MotionSample sample;
  sample.t_s = t_s;
  for (int i = 0; i < 3; ++i) sample.p[i] = p[i];
  sample.q_wxyz[0] = q.w();
  sample.q_wxyz[1] = q.x();
  sample.q_wxyz[2] = q.y();
  sample.q_wxyz[3] = q.z();
  return sample;
}

}  // namespace haptic::sim
