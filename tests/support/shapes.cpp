// SPDX-License-Identifier: Apache-2.0
#include "tests/support/shapes.hpp"

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "tests/support/point_algebra.hpp"

namespace haptic::test {
tools::Body convex_body(const std::vector<Point>& vertices,
                        const std::vector<std::vector<std::uint32_t>>& faces) {
  tools::Body body;
  body.name = "test body";
  tools::ConvexPiece piece;
  piece.vertices = vertices;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    piece.source_vertex.push_back(static_cast<std::int64_t>(v));
  const Point& origin = vertices[0];
  Point moment{0, 0, 0};
  for (std::size_t f = 0; f < faces.size(); ++f) {
    Point normal{0, 0, 0};
    const std::vector<std::uint32_t>& loop = faces[f];
    for (std::size_t k = 0; k + 2 < loop.size(); ++k) {
      const Point n = cross(minus(vertices[loop[k + 1]], vertices[loop[0]]),
                            minus(vertices[loop[k + 2]], vertices[loop[0]]));
      for (int i = 0; i < 3; ++i)
        normal[static_cast<std::size_t>(i)] += n[static_cast<std::size_t>(i)];
      const Point a = minus(vertices[loop[0]], origin), b = minus(vertices[loop[k + 1]], origin),
                  c = minus(vertices[loop[k + 2]], origin);
      const double v = dot(a, cross(b, c)) / 6.0;
      piece.volume_m3 += v;
      for (std::size_t i = 0; i < 3; ++i) moment[i] += v * (a[i] + b[i] + c[i]) / 4.0;
    }
    const double length = std::sqrt(dot(normal, normal));
    for (double& x : normal) x = x / length + 0.0;
    body.planes.push_back({normal, dot(normal, vertices[loop[0]])});
    piece.faces.push_back({static_cast<std::uint32_t>(f), 1, loop, static_cast<std::int64_t>(f)});
  }
  body.volume_m3 = piece.volume_m3;
  for (std::size_t i = 0; i < 3; ++i)
    body.centre_of_volume_m[i] = origin[i] + moment[i] / piece.volume_m3;
  body.pieces.push_back(piece);
  return body;
}

tools::Body box(const Point& lo, const Point& hi) {
  std::vector<Point> v;
  for (unsigned k = 0; k < 8; ++k) {
    v.push_back(
        {(k & 1) != 0 ? hi[0] : lo[0], (k & 2) != 0 ? hi[1] : lo[1], (k & 4) != 0 ? hi[2] : lo[2]});
  }
  return convex_body(
      v, {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}});
}

tools::Body tetrahedron(const Point& a, const Point& b, const Point& c, const Point& d) {
  const bool positive = dot(minus(d, a), cross(minus(b, a), minus(c, a))) > 0;
  return positive ? convex_body({a, b, c, d}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}})
                  : convex_body({a, b, c, d}, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}});
}

tools::Body prism(int n, double radius, double height) {
  std::vector<Point> v;
  const auto count = static_cast<std::uint32_t>(n);
  for (const double z : {-height / 2, height / 2}) {
    for (int k = 0; k < n; ++k) {
      const double angle = 2.0 * 3.14159265358979323846 * k / n;
      v.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
    }
  }
  std::vector<std::vector<std::uint32_t>> faces(2);
  for (std::uint32_t k = 0; k < count; ++k) {
    faces[0].push_back(count - 1 - k);
    faces[1].push_back(count + k);
    const std::uint32_t next = (k + 1) % count;
    faces.push_back({k, next, count + next, count + k});
  }
  return convex_body(v, faces);
}

tools::Body facet(const std::vector<Point>& corners) {
  const std::size_t n = corners.size();
  const auto unit = [](const Point& v) {
    const double length = std::sqrt(dot(v, v));
    return Point{v[0] / length, v[1] / length, v[2] / length};
  };
  tools::Body body;
  body.name = "test facet";
  tools::ConvexPiece piece;
  piece.vertices = corners;
  Point normal{0, 0, 0}, middle{0, 0, 0};
  std::vector<std::uint32_t> loop;
  for (std::size_t k = 0; k < n; ++k) {
    const Point twice =
        cross(minus(corners[k], corners[0]), minus(corners[(k + 1) % n], corners[0]));
    for (std::size_t i = 0; i < 3; ++i) {
      normal[i] += twice[i];
      middle[i] += corners[k][i] / static_cast<double>(n);
    }
    loop.push_back(static_cast<std::uint32_t>(k));
  }
  normal = unit(normal);
  for (std::size_t k = 0; k < n; ++k) {
    const Point ahead = unit(minus(corners[(k + 1) % n], corners[k]));
    piece.vertex_cones.push_back({static_cast<std::uint32_t>(body.directions.size()), 2});
    piece.side_cones.push_back({static_cast<std::uint32_t>(body.directions.size()) + 2, 1});
    body.directions.push_back(ahead);
    body.directions.push_back(unit(minus(corners[(k + n - 1) % n], corners[k])));
    body.directions.push_back(cross(normal, ahead));
  }
  body.planes.push_back({normal, dot(normal, middle)});
  piece.faces.push_back({0, 1, loop, -1});
  piece.faces.push_back({0, -1, {loop.rbegin(), loop.rend()}, -1});
  body.centre_of_volume_m = middle;
  body.pieces.push_back(std::move(piece));
  return body;
}

tools::Body random_hull(std::uint64_t seed, int count, const Point& axes) {
  Random random(seed);
  std::vector<Point> v;
  while (v.size() < static_cast<std::size_t>(count)) {
    const Point p{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const double length = std::sqrt(dot(p, p));
    if (length > 1.0 || length < 0.1) continue;
    v.push_back({axes[0] * p[0] / length, axes[1] * p[1] / length, axes[2] * p[2] / length});
  }
  std::vector<std::vector<std::uint32_t>> faces;
  const auto n = static_cast<std::uint32_t>(count);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t k = 0; k < n; ++k) {
        if (j <= i || k <= i || k == j) continue;  // each oriented triangle once
        const Point normal = cross(minus(v[j], v[i]), minus(v[k], v[i]));
        bool outer = true;
        for (std::uint32_t w = 0; w < n && outer; ++w) {
          outer = w == i || w == j || w == k || dot(normal, minus(v[w], v[i])) < 0;
        }
        if (outer) faces.push_back({i, j, k});
      }
    }
  }
  return convex_body(v, faces);
}

tools::Body join(const std::vector<tools::Body>& bodies) {
  tools::Body joined;
  joined.name = "joined";
  double moment[3] = {0, 0, 0};
  for (const tools::Body& body : bodies) {
    for (tools::ConvexPiece piece : body.pieces) {
      for (tools::PieceFace& face : piece.faces) {
        const tools::BodyPlane& plane = body.planes[face.plane];
        std::uint32_t found = static_cast<std::uint32_t>(joined.planes.size());
        for (std::uint32_t p = 0; p < joined.planes.size(); ++p) {
          const tools::BodyPlane& other = joined.planes[p];
          const auto same = [&](double s) {
            return other.offset_m == s * plane.offset_m && other.normal[0] == s * plane.normal[0] &&
                   other.normal[1] == s * plane.normal[1] && other.normal[2] == s * plane.normal[2];
          };
          if (!same(1) && !same(-1)) continue;
          found = p;
          if (same(-1)) face.sign = -face.sign;
          break;
        }
        if (found == joined.planes.size()) joined.planes.push_back(plane);
        face.plane = found;
      }
      joined.pieces.push_back(piece);
    }
    joined.volume_m3 += body.volume_m3;
    for (std::size_t i = 0; i < 3; ++i) moment[i] += body.volume_m3 * body.centre_of_volume_m[i];
  }
  for (std::size_t i = 0; i < 3; ++i) joined.centre_of_volume_m[i] = moment[i] / joined.volume_m3;
  return joined;
}

tools::SceneDescription scene_of(const tools::Body& moving,
                                 const std::vector<tools::Body>& statics) {
  tools::SceneDescription d;
  d.name = "test scene";
  d.moving.body = moving;
  for (const tools::Body& body : statics) d.statics.push_back({body, {0, 0, 0}, {1, 0, 0, 0}});
  d.parameters.law = LawId::kPaper;
  d.parameters.k_f_n_per_m = 1000.0;
  d.parameters.epsilon_m = 1.0e-4;
  d.parameters.exact_band_m = kMaxSceneLength_m;
  d.parameters.rate_hz = 1000.0;
  return d;
}

LoadedScene::LoadedScene(const tools::SceneDescription& description)
    : LoadedScene(tools::write_scene(description)) {}

LoadedScene::LoadedScene(const std::vector<std::byte>& blob)
    : blob_((blob.size() + 63) / 64), blob_bytes_(blob.size()) {
  std::memcpy(blob_.data(), blob.data(), blob.size());
  open();
}

void LoadedScene::open() {
  RtStatus status =
      SceneView::open({reinterpret_cast<const std::byte*>(blob_.data()), blob_bytes_}, view);
  if (status != RtStatus::kOk) throw std::runtime_error(to_text(status));
  memory_.resize((view.header().capacity.state_bytes + 63) / 64);
  status = HapticCore::create({reinterpret_cast<std::byte*>(memory_.data()), memory_.size() * 64},
                              view, core);
  if (status != RtStatus::kOk) throw std::runtime_error(to_text(status));
}

StepResult LoadedScene::step(const Point& p, const std::array<double, 4>& q) {
  StepInput input;
  input.pose_wa.p_wa =
      Vec3(static_cast<Real>(p[0]), static_cast<Real>(p[1]), static_cast<Real>(p[2]));
  input.pose_wa.q_wa = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                            static_cast<Real>(q[2]), static_cast<Real>(q[3]));
  input.report_goal_contact = true;
  return core->step(input);
}

}  // namespace haptic::test
