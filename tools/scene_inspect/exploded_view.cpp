// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/exploded_view.hpp"

namespace haptic::tools {
namespace {

Point3 to_point(const double* x) { return {x[0], x[1], x[2]}; }

std::vector<Point3> shifted(const std::vector<Point3>& points, const Point3& shift) {
  std::vector<Point3> result;
  for (const Point3& p : points) result.push_back(vec::add(p, shift));
  return result;
}

ExplodedPiece exploded_piece(const PieceView& view, const PieceExposure& exposure,
                             const Point3& shift) {
  ExplodedPiece piece;
  for (std::uint32_t f = 0; f < view.face_count; ++f) {
    ExplodedFace& face = piece.faces.emplace_back();
    for (const std::uint16_t v : view.face_vertices(f)) {
      const auto x = view.vertex(v);
      face.loop.push_back(vec::add(
          {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])},
          shift));
      piece.box.include(face.loop.back());
    }
    if (exposure.face_hidden[f]) {
      face.kind = FaceKind::kSeam;
    } else if (!exposure.face_fragments[f].empty()) {
      face.kind = FaceKind::kPartlyCovered;
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

}  // namespace haptic::tools
