// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/placed_bodies.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "rt_core/scene/scene_check.hpp"

namespace haptic {
namespace {

using Vector = Eigen::Vector3d;

/// The tables of a copy of a blob, to be written.
class Tables {
 public:
  Tables(std::span<const SectionEntry> sections, std::span<std::byte> blob) noexcept
      : sections_(sections), blob_(blob) {}

  /// Empty: the scene has no such section.
  template <typename T>
  [[nodiscard]] std::span<T> of(SectionId id) const noexcept {
    for (const SectionEntry& s : sections_) {
      if (s.id != id) continue;
      const std::size_t bytes = static_cast<std::size_t>(s.count) * s.element_bytes;
      return {reinterpret_cast<T*>(blob_.data() + s.offset), bytes / sizeof(T)};
    }
    return {};
  }

 private:
  std::span<const SectionEntry> sections_;
  std::span<std::byte> blob_;
};

/// Turns the tables of one body.
class Turned {
 public:
  explicit Turned(const Eigen::Matrix3d& turn) noexcept : turn_(turn) {}

  void direction(Real* v) const noexcept { write(turn_ * read(v), v); }
  void unit(Real* v) const noexcept { write((turn_ * read(v)).normalized(), v); }

  void pieces(std::span<PieceRecord> pieces, const Tables& tables) const noexcept {
    const auto vertices = tables.of<Real>(SectionId::kVertices);
    const auto lanes = tables.of<Real>(SectionId::kVertexLanes);
    const auto edges = tables.of<EdgeDirection>(SectionId::kEdgeDirections);
    const auto arcs = tables.of<EdgeArc>(SectionId::kEdgeArcs);
    const auto sides = tables.of<Real>(SectionId::kConeDirections);
    for (PieceRecord& piece : pieces) {
      Real* const points = vertices.data() + 3 * std::size_t{piece.vertex_begin};
      for (std::uint32_t v = 0; v < piece.vertex_count; ++v) direction(points + 3 * std::size_t{v});
      measure(piece, points);
      for (std::uint32_t e = 0; e < piece.edge_count; ++e) unit(edges[piece.edge_begin + e].unit);
      if (is_flat(piece)) {
        for (std::uint32_t e = 0; e < piece.edge_count; ++e)
          unit(sides.data() + 3 * (std::size_t{piece.flat_edges} + e));
        continue;
      }
      write_lanes(piece, points, lanes.data() + piece.lane_begin);
      for (EdgeArc& arc : arcs.subspan(piece.edge_begin - piece.flat_edges, piece.edge_count)) {
        unit(arc.mid);
        unit(arc.side);
      }
    }
  }
  /// After planes and pieces: a tilt is a product in each of its coordinates, which may be next to
  /// zero. Facets store none.
  static void tilts(const BodyRecord& body, std::span<const PieceRecord> pieces,
                    const Tables& tables) noexcept {
    const auto planes = tables.of<PlaneRecord>(SectionId::kPlanes).subspan(body.plane_begin);
    const auto faces = tables.of<FaceRecord>(SectionId::kFaces);
    const auto edges = tables.of<EdgeRecord>(SectionId::kEdges);
    const auto directions = tables.of<EdgeDirection>(SectionId::kEdgeDirections);
    const auto arcs = tables.of<EdgeArc>(SectionId::kEdgeArcs);
    const auto vertices = tables.of<Real>(SectionId::kVertices);
    for (const PieceRecord& piece : pieces) {
      if (is_flat(piece)) continue;
      const auto vertex = [&](std::uint32_t v) {
        return read(vertices.data() + 3 * (std::size_t{piece.vertex_begin} + v));
      };
      for (std::uint32_t e = piece.edge_begin; e < piece.edge_begin + piece.edge_count; ++e) {
        const Vector along = read(directions[e].unit).normalized();
        for (int k = 0; k < 2; ++k) {
          const FaceRecord& face = faces[piece.face_begin + edges[e].face[k]];
          const double width_m =
              along.cross(vertex(edges[e].apex[k]) - vertex(edges[e].vertex[0])).norm();
          const double of_face = width_m * static_cast<double>(face.sign);
          write(of_face * read(planes[face.plane].normal), arcs[e - piece.flat_edges].tilt[k]);
        }
      }
    }
  }
  void planes(std::span<PlaneRecord> planes) const noexcept {
    for (PlaneRecord& plane : planes) unit(plane.normal);
  }

 private:
  static Vector read(const Real* v) noexcept {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
  }
  static void write(const Vector& from, Real* to) noexcept {
    for (int k = 0; k < 3; ++k) to[k] = static_cast<Real>(from[k]);
  }
  static void write_lanes(const PieceRecord& piece, const Real* points, Real* lanes) noexcept {
    for (std::uint32_t k = 0; k < 3; ++k) {
      for (std::uint32_t v = 0; v < piece.lane_count; ++v) {
        const std::uint32_t of = v < piece.vertex_count ? v : 0;
        lanes[std::size_t{k} * piece.lane_count + v] = points[3 * std::size_t{of} + k];
      }
    }
  }
  /// The record is that of the vertices as they are now.
  void measure(PieceRecord& piece, const Real* points) const noexcept {
    const Vector centre = turn_ * Vector(piece.centre_m);
    double reach2 = 0, radius2 = 0;
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
      const Vector at = read(points + 3 * std::size_t{v});
      reach2 = std::max(reach2, at.squaredNorm());
      radius2 = std::max(radius2, (at - centre).squaredNorm());
    }
    for (int k = 0; k < 3; ++k) piece.centre_m[k] = centre[k];
    piece.reach_m = std::sqrt(reach2);
    piece.radius_m = std::sqrt(radius2);
  }

  Eigen::Matrix3d turn_;
};

/// Directions of cones are shared between the facets of one body: those of its pieces.
struct ConeRun {
  std::uint32_t begin = 0, end = 0;
};
ConeRun cones_of(std::span<const PieceRecord> pieces, std::span<const ConeRange> ranges) noexcept {
  ConeRun run{UINT32_MAX, 0};
  for (const PieceRecord& piece : pieces) {
    if (!is_flat(piece)) continue;
    for (std::uint32_t k = 0; k < piece.vertex_count + piece.edge_count; ++k) {
      const ConeRange& cone = ranges[piece.cone_begin + k];
      if (cone.count == 0) continue;
      run.begin = std::min(run.begin, cone.begin);
      run.end = std::max(run.end, cone.begin + cone.count);
    }
  }
  return run.end == 0 ? ConeRun{} : run;
}

}  // namespace

Pose pose_of(const PartPlace& place) noexcept {
  const double* const q = place.q_wa_xyzw;
  Pose pose;
  for (int k = 0; k < 3; ++k) pose.p_wa[k] = static_cast<Real>(place.p_wa_m[k]);
  pose.q_wa = Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                   static_cast<Real>(q[2]));
  return pose;
}

RtStatus PlacedBodies::begin(const SceneView& scene, const PartPlace& start,
                             std::span<std::byte> memory) noexcept {
  const std::span<const std::byte> blob = scene.blob();
  if (memory.size() < blob.size()) return RtStatus::kMemoryTooSmall;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kSceneAlignment != 0)
    return RtStatus::kMemoryMisaligned;
  scene_ = &scene;
  blob_ = memory.first(blob.size());
  std::memcpy(blob_.data(), blob.data(), blob.size());
  const Tables tables(scene.sections(), blob_);
  for (SceneParameters& parameters : tables.of<SceneParameters>(SectionId::kParameters)) {
    std::copy_n(start.p_wa_m, 3, parameters.start_p_wa_m);
    std::copy_n(start.q_wa_xyzw, 4, parameters.start_q_wa_xyzw);
  }
  return RtStatus::kOk;
}

RtStatus PlacedBodies::move(std::size_t number, const BodyMove& move) noexcept {
  const Tables tables(scene_->sections(), blob_);
  const auto bodies = tables.of<BodyRecord>(SectionId::kBodies);
  if (number == 0 || number >= bodies.size()) return RtStatus::kBlobBadCount;
  if (move.is_none()) return RtStatus::kOk;
  const double* const q = move.turn_xyzw;
  const Eigen::Quaterniond turn(q[3], q[0], q[1], q[2]);
  if (!(std::abs(turn.squaredNorm() - 1) <= 1e-6)) return RtStatus::kBlobBadNumber;
  const Eigen::Matrix3d matrix = turn.normalized().toRotationMatrix();
  BodyRecord& body = bodies[number];
  const Vector reference = matrix * Vector(body.reference_m) + Vector(move.shift_m);
  for (int k = 0; k < 3; ++k) {
    if (!check::is_coordinate(reference[k])) return RtStatus::kBlobBadNumber;
    body.reference_m[k] = reference[k];
  }
  const Turned turned(matrix);
  const auto pieces =
      tables.of<PieceRecord>(SectionId::kPieces).subspan(body.piece_begin, body.piece_count);
  turned.pieces(pieces, tables);
  turned.planes(
      tables.of<PlaneRecord>(SectionId::kPlanes).subspan(body.plane_begin, body.plane_count));
  Turned::tilts(body, pieces, tables);
  const auto directions = tables.of<Real>(SectionId::kConeDirections);
  const ConeRun run = cones_of(pieces, tables.of<ConeRange>(SectionId::kConeRanges));
  for (std::uint32_t k = run.begin; k < run.end; ++k)
    turned.unit(directions.data() + 3 * std::size_t{k});
  return RtStatus::kOk;
}

std::span<const std::byte> PlacedBodies::finish() noexcept {
  reinterpret_cast<SceneHeader*>(blob_.data())->content_hash = scene_content_hash(blob_);
  return blob_;
}

}  // namespace haptic
