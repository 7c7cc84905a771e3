// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/steady_work.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/common/split_mix.hpp"

namespace haptic::tools {
namespace {

using Vector = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;

constexpr std::uint64_t kSeed = 20260;
constexpr std::uint32_t kMostSamples = 200, kFewestSamples = 4;
/// Products that the samples of a whole scene may take together, about a second's work.
constexpr double kProducts = 1.0e9;
/// Directions tried on an arc, then steps of narrowing about the best of them.
constexpr int kArcDirections = 17, kNarrowings = 12;

class Generator {
 public:
  explicit Generator(std::uint64_t seed) : words_(seed) {}
  double uniform() { return words_.uniform(); }
  std::uint32_t index(std::uint32_t count) {
    return static_cast<std::uint32_t>(words_.next() % count);
  }
  Vector direction() {
    for (;;) {
      const Vector v(2 * uniform() - 1, 2 * uniform() - 1, 2 * uniform() - 1);
      if (v.squaredNorm() > 0.01 && v.squaredNorm() < 1) return v.normalized();
    }
  }
  Matrix rotation() {
    const Vector x = direction();
    const Vector y = x.cross(direction()).normalized();
    Matrix r;
    r << x, y, x.cross(y);
    return r;
  }

 private:
  SplitMix64 words_;
};

Vector vector_of(const Real* r) {
  return {static_cast<double>(r[0]), static_cast<double>(r[1]), static_cast<double>(r[2])};
}

/// One piece in doubles, in the axes of its geometry frame or turned.
struct TurnedPiece {
  TurnedPiece(const PieceView& piece, const Matrix& r) : view(piece) {
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
      vertices.push_back(r * vector_of(piece.vertices + 3 * std::size_t{v}));
    }
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      normals.push_back(r * vector_of(piece.face_normal(f).data()));
    }
    for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
      const EdgeArc& arc = piece.arcs[e];
      arcs.push_back({r * vector_of(arc.mid), r * vector_of(arc.side),
                      std::atan2(static_cast<double>(arc.sine), static_cast<double>(arc.cosine))});
    }
  }
  /// Vertex farthest along n.
  [[nodiscard]] const Vector& support(const Vector& n) const {
    return *std::max_element(vertices.begin(), vertices.end(),
                             [&](const auto& a, const auto& b) { return a.dot(n) < b.dot(n); });
  }

  struct Arc {
    Vector mid, side;
    double half_rad;
  };
  PieceView view;
  std::vector<Vector> vertices, normals;
  std::vector<Arc> arcs;
};

/// Largest, over the directions n of an arc, of the smallest n.(v - point): how far the other piece
/// with vertices v lies before a plane through a point of the edge [m].
double best_on_arc(const TurnedPiece::Arc& arc, const Vector& point,
                   const std::vector<Vector>& others) {
  std::vector<std::array<double, 2>> along;
  for (const Vector& v : others) along.push_back({arc.mid.dot(v - point), arc.side.dot(v - point)});
  const auto gap = [&](double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [m, t] : along) least = std::min(least, c * m + s * t);
    return least;
  };
  double at = 0.0, best = -std::numeric_limits<double>::infinity();
  double step = 2 * arc.half_rad / (kArcDirections - 1);
  for (int i = 0; i < kArcDirections; ++i) {
    const double angle = -arc.half_rad + i * step;
    const double value = gap(angle);
    if (value > best) {
      best = value;
      at = angle;
    }
  }
  for (int i = 0; i < kNarrowings; ++i) {
    step /= 2;
    for (const double angle : {at - step, at + step}) {
      if (std::abs(angle) > arc.half_rad) continue;
      const double value = gap(angle);
      if (value > best) {
        best = value;
        at = angle;
      }
    }
  }
  return best;
}

/// Appends what each face and edge of `piece` can carry against the vertices of `other`, both in
/// one frame: the height of the other piece over its best plane [m].
void append_keys(const TurnedPiece& piece, const std::vector<Vector>& others,
                 std::vector<double>& faces, std::vector<double>& edges) {
  for (std::uint32_t f = 0; f < piece.normals.size(); ++f) {
    const Vector& corner = piece.vertices[piece.view.face_vertices(f)[0]];
    double least = std::numeric_limits<double>::infinity();
    for (const Vector& v : others) least = std::min(least, piece.normals[f].dot(v - corner));
    faces.push_back(least);
  }
  for (std::uint32_t e = 0; e < piece.arcs.size(); ++e) {
    const Vector& end = piece.vertices[piece.view.edges[e].vertex[0]];
    edges.push_back(best_on_arc(piece.arcs[e], end, others));
  }
}

/// Places A against B: the shift of A's vertices that brings them into contact.
Vector contact_shift(const TurnedPiece& a, const TurnedPiece& b, bool corner, Generator& random) {
  if (corner) {
    const Vector n = random.direction();
    return b.support(n) - a.support(-n);
  }
  const bool face_of_b = random.index(2) == 0;
  const TurnedPiece& owner = face_of_b ? b : a;
  const std::uint32_t f = random.index(owner.view.face_count);
  Vector point = Vector::Zero();
  double total = 0.0;
  for (const std::uint16_t v : owner.view.face_vertices(f)) {
    const double weight = random.uniform() + 1e-6;
    point += weight * owner.vertices[v];
    total += weight;
  }
  point /= total;
  const Vector& n = owner.normals[f];
  return face_of_b ? Vector(point - a.support(-n)) : Vector(b.support(-n) - point);
}

/// Distances [m] of what faces and edges can carry below the best of all, in one pose; the
/// relaxation of each kind taken off, never negative.
std::vector<double> slacks_of(const PieceView& a_view, const TurnedPiece& b, bool corner,
                              double face_relax_m, double edge_relax_m, Generator& random) {
  TurnedPiece a(a_view, random.rotation());
  const Vector shift = contact_shift(a, b, corner, random);
  for (Vector& v : a.vertices) v += shift;
  std::vector<double> faces, edges;
  append_keys(a, b.vertices, faces, edges);
  append_keys(b, a.vertices, faces, edges);
  const double best = std::max(*std::max_element(faces.begin(), faces.end()),
                               *std::max_element(edges.begin(), edges.end()));
  std::vector<double> slacks;
  for (const double key : faces) slacks.push_back(std::max(0.0, best - key - face_relax_m));
  for (const double key : edges) slacks.push_back(std::max(0.0, best - key - edge_relax_m));
  return slacks;
}

double products_of(const PairView& pair) {
  const auto side = [](const PieceView& own, const PieceView& other) {
    return (own.face_count + 2.0 * kArcDirections * own.edge_count) * other.vertex_count;
  };
  return side(pair.a, pair.b) + side(pair.b, pair.a);
}

PairSteadyWork pair_work(const SceneView& scene, std::uint32_t index, std::uint32_t samples) {
  const PairView pair = scene.pair(index);
  const SceneParameters& p = scene.parameters();
  PairSteadyWork work;
  work.features = pair.a.face_count + pair.a.edge_count + pair.b.face_count + pair.b.edge_count;
  work.age_ticks = (work.features + kRenewedPerTick - 1) / kRenewedPerTick;
  // The chord of a turn is at most its angle.
  work.motion_m =
      (p.max_linear_speed_m_per_s + p.max_angular_speed_rad_per_s * pair.a.record->reach_m) /
      p.rate_hz;
  const PieceRecord &a = *pair.a.record, &b = *pair.b.record;
  const double face_relax_m = std::max(a.vertex_relax_m, b.vertex_relax_m);
  const double edge_relax_m = std::max(a.edge_relax_ratio, b.edge_relax_ratio) * p.epsilon_m;
  Generator random(kSeed + index);
  const TurnedPiece fixed(pair.b, Matrix::Identity());
  // A bound and the best value may each change by the motion.
  const double drift_m = 2.0 * work.motion_m;
  std::vector<std::uint32_t> counts;
  std::vector<double> renewals;
  for (std::uint32_t k = 0; k < samples; ++k) {
    std::uint32_t busy = 0;
    double renewed = 0.0;
    for (const double slack_m :
         slacks_of(pair.a, fixed, k % 2 == 0, face_relax_m, edge_relax_m, random)) {
      if (slack_m <= work.age_ticks * drift_m) ++busy;
      renewed += slack_m <= drift_m ? 1.0 : drift_m / slack_m;
    }
    counts.push_back(busy);
    renewals.push_back(renewed);
  }
  std::sort(counts.begin(), counts.end());
  std::sort(renewals.begin(), renewals.end());
  work.median = counts[counts.size() / 2];
  work.largest = counts.back();
  work.renewed_median = renewals[renewals.size() / 2];
  work.renewed_largest = renewals.back();
  return work;
}

}  // namespace

std::optional<SteadyWork> steady_work(const SceneView& scene) {
  if (scene.parameters().motion_limits_given == 0 || scene.is_locked() || !scene.lists_pairs()) {
    return std::nullopt;
  }
  double products = 0.0;
  const auto pairs = static_cast<std::uint32_t>(scene.pair_count());
  for (std::uint32_t i = 0; i < pairs; ++i) products += products_of(scene.pair(i));
  const double affordable = std::clamp<double>(kProducts / products, kFewestSamples, kMostSamples);
  SteadyWork work;
  work.seed = kSeed;
  work.samples = static_cast<std::uint32_t>(affordable);
  for (std::uint32_t i = 0; i < pairs; ++i) {
    work.pairs.push_back(pair_work(scene, i, work.samples));
  }
  return work;
}

}  // namespace haptic::tools
