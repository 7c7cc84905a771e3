// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/exploded_view.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace haptic::tools {
namespace {

/// Beyond this many pieces they are painted by depth alone.
constexpr std::size_t kMostOrdered = 400;

Point3 to_point(const double* x) { return {x[0], x[1], x[2]}; }

std::vector<Point3> shifted(const std::vector<Point3>& points, const Point3& shift) {
  std::vector<Point3> result;
  for (const Point3& p : points) result.push_back(vec::add(p, shift));
  return result;
}

ExplodedPiece exploded_piece(const PieceView& view, const PieceExposure& exposure,
                             const Point3& shift) {
  ExplodedPiece piece;
  piece.vertices = view.vertex_count;
  piece.edges = view.edge_count;
  piece.volume_m3 = view.record->volume_m3;
  piece.centre = vec::add(to_point(view.record->centre_m), shift);
  for (std::uint32_t f = 0; f < view.face_count; ++f) {
    ExplodedFace& face = piece.faces.emplace_back();
    const Vec3 n = view.face_normal(f);
    face.normal = {static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])};
    for (const std::uint16_t v : view.face_vertices(f)) {
      const auto x = view.vertex(v);
      face.loop.push_back(vec::add(
          {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])},
          shift));
      piece.box.include(face.loop.back());
    }
    if (exposure.face_hidden[f]) {
      face.kind = FaceKind::kSeam;
      piece.seams += 1;
    } else if (!exposure.face_fragments[f].empty()) {
      face.kind = FaceKind::kPartlyCovered;
      piece.partly_covered += 1;
      for (const FragmentPolygon& open : exposure.face_fragments[f]) {
        face.open.push_back(shifted(open, shift));
      }
    }
  }
  return piece;
}

/// Centre of volume of the pieces, each taken at its middle; of facets, which have no volume, the
/// mean of their middles.
Point3 centre_of(const SceneView& view, const BodyRecord& body) {
  Point3 sum{0, 0, 0};
  double total = 0.0;
  for (std::uint32_t i = 0; i < body.piece_count; ++i) {
    const PieceRecord& piece = view.pieces()[body.piece_begin + i];
    const double weight = body.volume_m3 > 0 ? piece.volume_m3 : 1.0;
    sum = vec::add(sum, vec::scaled(to_point(piece.centre_m), weight));
    total += weight;
  }
  return vec::scaled(sum, 1.0 / total);
}

/// +1: `other` lies before `piece` as a face plane of `piece` shows, -1: behind it, 0: the plane is
/// seen edge on, so neither covers the other; 2: no face plane separates them.
int side_of(const ExplodedPiece& piece, const ExplodedPiece& other, const Point3& towards_viewer) {
  const double tolerance = 1e-9 * (piece.box.diagonal() + other.box.diagonal());
  for (const ExplodedFace& face : piece.faces) {
    const bool beyond = std::ranges::all_of(other.faces, [&](const ExplodedFace& of_other) {
      return std::ranges::all_of(of_other.loop, [&](const Point3& p) {
        return vec::dot(face.normal, vec::sub(p, face.loop[0])) >= -tolerance;
      });
    });
    if (!beyond) continue;
    const double turned = vec::dot(face.normal, towards_viewer);
    if (std::abs(turned) < 1e-9) return 0;
    return turned > 0 ? 1 : -1;
  }
  return 2;
}

/// True when `a` must be painted before `b`.
bool goes_before(const ExplodedPiece& a, const ExplodedPiece& b, const Point3& towards_viewer) {
  const int b_from_a = side_of(a, b, towards_viewer);
  if (b_from_a != 2) return b_from_a > 0;
  const int a_from_b = side_of(b, a, towards_viewer);
  if (a_from_b != 2) return a_from_b < 0;
  return vec::dot(a.centre, towards_viewer) < vec::dot(b.centre, towards_viewer);
}

}  // namespace

std::vector<ExplodedBody> exploded_bodies(const SceneView& view,
                                          const std::vector<PieceExposure>& exposure,
                                          double factor) {
  std::vector<ExplodedBody> bodies;
  for (std::uint32_t b = 0; b < view.bodies().size(); ++b) {
    const BodyRecord& record = view.bodies()[b];
    ExplodedBody& body = bodies.emplace_back();
    body.name = view.text(record.name_offset, record.name_bytes);
    body.moving = b == 0;
    body.reference_m = to_point(record.reference_m);
    const Point3 centre = centre_of(view, record);
    for (std::uint32_t i = 0; i < record.piece_count; ++i) {
      const std::uint32_t index = record.piece_begin + i;
      const Point3 middle = to_point(view.pieces()[index].centre_m);
      const Point3 shift = vec::scaled(vec::sub(middle, centre), factor);
      body.pieces.push_back(exploded_piece(view.piece(index), exposure[index], shift));
      body.pieces.back().number = i;
      body.box.include(body.pieces.back().box.low);
      body.box.include(body.pieces.back().box.high);
    }
  }
  return bodies;
}

std::vector<std::size_t> painting_order(const std::vector<ExplodedPiece>& pieces,
                                        const Point3& towards_viewer) {
  std::vector<std::size_t> left(pieces.size());
  std::iota(left.begin(), left.end(), std::size_t{0});
  std::ranges::stable_sort(left, [&](std::size_t a, std::size_t b) {
    return vec::dot(pieces[a].centre, towards_viewer) < vec::dot(pieces[b].centre, towards_viewer);
  });
  if (pieces.size() > kMostOrdered) return left;
  std::vector<std::vector<std::size_t>> after(pieces.size());
  std::vector<std::size_t> waits_for(pieces.size(), 0);
  for (std::size_t a = 0; a < pieces.size(); ++a) {
    for (std::size_t b = 0; b < pieces.size(); ++b) {
      if (a == b || !goes_before(pieces[a], pieces[b], towards_viewer)) continue;
      after[a].push_back(b);
      waits_for[b] += 1;
    }
  }
  std::vector<std::size_t> order;
  while (!left.empty()) {
    // The farthest that waits for nothing; in a circle of pieces the farthest of all.
    auto next = std::ranges::find_if(left, [&](std::size_t i) { return waits_for[i] == 0; });
    if (next == left.end()) next = left.begin();
    order.push_back(*next);
    left.erase(next);
    for (const std::size_t i : after[order.back()]) {
      if (waits_for[i] > 0) waits_for[i] -= 1;
    }
  }
  return order;
}

}  // namespace haptic::tools
