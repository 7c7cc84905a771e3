// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/cut_body.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace haptic::sim {
namespace {

constexpr double kOnPlane_m = 1e-12;
constexpr std::size_t kMostCuts = 4;

Vector vertex(const tools::ConvexPiece& piece, std::uint32_t v) {
  return {piece.vertices[v][0], piece.vertices[v][1], piece.vertices[v][2]};
}

/// Place of the plane along the edge between two vertices; the same bits whichever comes first.
std::array<double, 3> crossing(std::array<double, 3> a, std::array<double, 3> b,
                               const CutPlane& plane) {
  if (b < a) std::swap(a, b);
  const Vector from(a[0], a[1], a[2]), to(b[0], b[1], b[2]);
  const double s = plane.normal.dot(from) - plane.offset_m;
  const double e = plane.normal.dot(to) - plane.offset_m;
  const Vector at = from + (s / (s - e)) * (to - from);
  return {at[0], at[1], at[2]};
}

void measure(tools::ConvexPiece& piece, Vector& moment) {
  piece.volume_m3 = 0;
  const Vector origin = vertex(piece, 0);
  for (const tools::PieceFace& face : piece.faces) {
    const Vector first = vertex(piece, face.loop[0]) - origin;
    for (std::size_t k = 1; k + 1 < face.loop.size(); ++k) {
      const Vector second = vertex(piece, face.loop[k]) - origin;
      const Vector third = vertex(piece, face.loop[k + 1]) - origin;
      const double volume = first.dot(second.cross(third)) / 6;
      piece.volume_m3 += volume;
      moment += volume * (origin + (first + second + third) / 4);
    }
  }
}

/// One side of a piece as it is collected: vertices kept from the piece and made on its edges.
class Side {
 public:
  Side(const tools::ConvexPiece& from, const CutPlane& plane) : from_(from), plane_(plane) {}

  std::uint32_t keep(std::uint32_t v, bool on_plane) {
    const auto [at, fresh] = kept_.try_emplace(v, count());
    if (fresh) {
      piece.vertices.push_back(from_.vertices[v]);
      piece.source_vertex.push_back(from_.source_vertex[v]);
      if (on_plane) cap_.push_back(at->second);
    }
    return at->second;
  }
  std::uint32_t cross(std::uint32_t u, std::uint32_t v) {
    const auto [at, fresh] = made_.try_emplace(std::minmax(u, v), count());
    if (fresh) {
      piece.vertices.push_back(crossing(from_.vertices[u], from_.vertices[v], plane_));
      piece.source_vertex.push_back(-1);
      cap_.push_back(at->second);
    }
    return at->second;
  }
  /// The face in the plane of the cut, its corners by angle about their middle.
  void close(std::uint32_t plane_index, int sign) {
    Vector middle = Vector::Zero();
    for (const std::uint32_t v : cap_)
      middle += vertex(piece, v) / static_cast<double>(cap_.size());
    const Vector n = sign * plane_.normal;
    const Vector e1 = n.unitOrthogonal(), e2 = n.cross(e1);
    const auto angle = [&](std::uint32_t v) {
      const Vector arm = vertex(piece, v) - middle;
      return std::atan2(e2.dot(arm), e1.dot(arm));
    };
    std::ranges::sort(cap_, {}, angle);
    piece.faces.push_back({plane_index, sign, cap_, -1});
  }

  tools::ConvexPiece piece;

 private:
  [[nodiscard]] std::uint32_t count() const {
    return static_cast<std::uint32_t>(piece.vertices.size());
  }

  const tools::ConvexPiece& from_;
  const CutPlane& plane_;
  std::map<std::uint32_t, std::uint32_t> kept_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> made_;
  std::vector<std::uint32_t> cap_;
};

/// The side of `from` where sign * (n.x - offset) <= 0; empty when nothing solid lies there.
tools::ConvexPiece side_of(const tools::ConvexPiece& from, const CutPlane& plane,
                           std::uint32_t plane_index, int sign) {
  std::vector<int> where;
  for (std::uint32_t v = 0; v < from.vertices.size(); ++v) {
    const double s = sign * (plane.normal.dot(vertex(from, v)) - plane.offset_m);
    where.push_back(s < -kOnPlane_m ? -1 : (s > kOnPlane_m ? 1 : 0));
  }
  if (std::ranges::find(where, -1) == where.end()) return {};
  if (std::ranges::find(where, 1) == where.end()) return from;
  Side side(from, plane);
  for (const tools::PieceFace& face : from.faces) {
    tools::PieceFace part = face;
    part.loop.clear();
    for (std::size_t k = 0; k < face.loop.size(); ++k) {
      const std::uint32_t u = face.loop[k], v = face.loop[(k + 1) % face.loop.size()];
      if (where[u] <= 0) part.loop.push_back(side.keep(u, where[u] == 0));
      if (where[u] * where[v] < 0) part.loop.push_back(side.cross(u, v));
    }
    if (part.loop.size() >= 3) side.piece.faces.push_back(std::move(part));
  }
  side.close(plane_index, sign);
  return std::move(side.piece);
}

}  // namespace

tools::Body cut_body(const tools::Body& body, const CutPlane& plane) {
  tools::Body result = body;
  result.pieces.clear();
  result.planes.push_back(
      {{plane.normal[0] + 0.0, plane.normal[1] + 0.0, plane.normal[2] + 0.0}, plane.offset_m});
  const auto index = static_cast<std::uint32_t>(result.planes.size() - 1);
  for (const tools::ConvexPiece& piece : body.pieces) {
    for (const int sign : {1, -1}) {
      tools::ConvexPiece side = side_of(piece, plane, index, sign);
      if (!side.vertices.empty()) result.pieces.push_back(std::move(side));
    }
  }
  Vector moment = Vector::Zero();
  result.volume_m3 = 0;
  for (tools::ConvexPiece& piece : result.pieces) {
    measure(piece, moment);
    result.volume_m3 += piece.volume_m3;
  }
  const Vector centre = moment / result.volume_m3;
  result.centre_of_volume_m = {centre[0], centre[1], centre[2]};
  return result;
}

tools::Body cut_body(const tools::Body& body, std::span<const CutPlane> planes) {
  tools::Body result = body;
  for (const CutPlane& plane : planes) result = cut_body(result, plane);
  return result;
}

tools::Body random_cuts(const tools::Body& body, const Vector& half, std::uint32_t most_pieces,
                        Seeded& random) {
  tools::Body result = body;
  for (std::size_t k = 0; k < kMostCuts; ++k) {
    CutPlane plane;
    plane.normal = random.direction();
    Vector point;
    for (int i = 0; i < 3; ++i) point[i] = random.uniform(-half[i], half[i]) / 2;
    plane.offset_m = plane.normal.dot(point);
    tools::Body next = cut_body(result, plane);
    if (next.pieces.size() > most_pieces) break;
    result = std::move(next);
  }
  return result;
}

tools::Body reordered(const tools::Body& body, std::span<const std::uint32_t> order) {
  tools::Body result = body;
  result.pieces.clear();
  for (const std::uint32_t k : order) result.pieces.push_back(body.pieces[k]);
  return result;
}

}  // namespace haptic::sim
