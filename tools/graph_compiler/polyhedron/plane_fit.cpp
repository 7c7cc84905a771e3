// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numeric>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/polyhedron/symmetric_axes.hpp"

namespace haptic::tools {
namespace {

// Planes through many points: the least-squares fit, and the digits of it beyond double.

/// n . x = d, n unit.
struct FlatPlane {
  Point3 n{0, 0, 0};
  double d = 0.0;
  [[nodiscard]] double distance(const Point3& x) const { return std::abs(vec::dot(n, x) - d); }
};

/// Least-squares plane of points, oriented like `like`; false when the points do not span a plane.
bool least_squares(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                   const Point3& like, FlatPlane& out) {
  Point3 mean{0, 0, 0};
  for (const std::uint32_t v : which) {
    for (std::size_t i = 0; i < 3; ++i) mean[i] += all[v][i];
  }
  mean = vec::scaled(mean, 1.0 / static_cast<double>(which.size()));
  std::array<std::array<double, 3>, 3> moments{};
  for (const std::uint32_t v : which) {
    const Point3 r = vec::sub(all[v], mean);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) moments[i][j] += r[i] * r[j];
    }
  }
  std::array<std::array<double, 3>, 3> vectors{};
  diagonalise(moments, vectors);
  std::array<std::size_t, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t i, std::size_t j) { return moments[i][i] < moments[j][j]; });
  const double largest = moments[order[2]][order[2]];
  if (!(moments[order[1]][order[1]] > 1e-18 * largest)) return false;
  out.n = {vectors[0][order[0]], vectors[1][order[0]], vectors[2][order[0]]};
  const double length = std::sqrt(vec::dot(out.n, out.n));
  out.n = vec::scaled(out.n, (vec::dot(out.n, like) < 0.0 ? -1.0 : 1.0) / length);
  out.d = vec::dot(out.n, mean);
  return true;
}

double largest_distance(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                        const FlatPlane& plane) {
  double largest = 0.0;
  for (const std::uint32_t v : which) largest = std::max(largest, plane.distance(all[v]));
  return largest;
}

/// n.x - d with n, d given as head and tail, to about 2^-100: two-fold products and sums.
double fine_distance(const Point3& n, const Point3& tail, const Point3& x, double d,
                     double d_tail) {
  double sum = -d;
  double low = -d_tail;
  for (std::size_t i = 0; i < 3; ++i) {
    const double product = n[i] * x[i];
    low += std::fma(n[i], x[i], -product) + tail[i] * x[i];
    const double next = sum + product;
    const double back = next - sum;
    low += (sum - (next - back)) + (product - back);
    sum = next;
  }
  return sum + low;
}

/// One Newton step of the least-squares fit with exact residuals: fills the tails.
void refine(const std::vector<Point3>& all, FittedPlane& plane) {
  const Point3& n = plane.normal;
  const std::size_t least = std::abs(n[0]) <= std::abs(n[1]) && std::abs(n[0]) <= std::abs(n[2])
                                ? 0U
                            : std::abs(n[1]) <= std::abs(n[2]) ? 1U
                                                               : 2U;
  Point3 axis{0, 0, 0};
  axis[least] = 1.0;
  Point3 u = vec::cross(n, axis);
  u = vec::scaled(u, 1.0 / std::sqrt(vec::dot(u, u)));
  const Point3 w = vec::cross(n, u);
  const double count = static_cast<double>(plane.vertices.size());
  Point3 mean{0, 0, 0};
  for (const std::uint32_t v : plane.vertices) {
    for (std::size_t i = 0; i < 3; ++i) mean[i] += all[v][i] / count;
  }
  double uu = 0, uw = 0, ww = 0, ur = 0, wr = 0, mean_r = 0, mean_u = 0, mean_w = 0;
  for (const std::uint32_t v : plane.vertices) {
    const Point3 r = vec::sub(all[v], mean);
    const double residual = fine_distance(n, {0, 0, 0}, all[v], plane.offset_m, 0.0);
    const double ru = vec::dot(r, u), rw = vec::dot(r, w);
    uu += ru * ru, uw += ru * rw, ww += rw * rw, ur += ru * residual, wr += rw * residual;
    mean_r += residual / count, mean_u += ru / count, mean_w += rw / count;
  }
  uu -= count * mean_u * mean_u, uw -= count * mean_u * mean_w, ww -= count * mean_w * mean_w;
  ur -= count * mean_u * mean_r, wr -= count * mean_w * mean_r;
  const double det = uu * ww - uw * uw;
  if (!(det > 1e-18 * (uu + ww) * (uu + ww))) return;
  const double a = -(ww * ur - uw * wr) / det;
  const double b = -(uu * wr - uw * ur) / det;
  for (std::size_t i = 0; i < 3; ++i) plane.normal_tail[i] = a * u[i] + b * w[i];
  // The mean residual goes into the offset; the tilt turns about the mean of the vertices.
  plane.offset_tail_m = mean_r + vec::dot(plane.normal_tail, mean) + a * mean_u + b * mean_w;
}

constexpr double kGrowCosine = 0.90630778703664996;  // cos 25 degrees
constexpr double kNarrowCosine = -0.5;               // cos 120 degrees
constexpr double kNarrowTolerances = 20.0;  // narrower faces: rounding may turn the normal anywhere
constexpr int kMaxRounds = 8;  // of growing and refitting; two or three suffice on real parts
constexpr std::uint32_t kUnassigned = std::numeric_limits<std::uint32_t>::max();

/// Faces that lie in one plane, all with the orientation of `plane.n` (slivers excepted).
struct Cluster {
  FlatPlane plane;
  std::vector<std::uint32_t> faces;
  std::vector<std::uint32_t> vertices;
  std::vector<int> signs;  // per face, against plane.n
  double area = 0.0;
  bool narrow = true;  // all its faces are
  bool exact = false;  // the file has its plane exactly
};

/// True if the points lie on two parallel lines, or on one. Such points have a plane however they
/// were rounded along the lines: the four corners of a facet of a prism.
bool on_two_lines(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                  double within_m) {
  const auto fits = [&](std::uint32_t from, std::uint32_t to) {
    const Point3 along = vec::unit(vec::sub(all[to], all[from]));
    if (!(vec::norm(along) > 0.0)) return false;
    const Point3* second = nullptr;
    for (const std::uint32_t v : which) {
      if (vec::norm(vec::cross(along, vec::sub(all[v], all[from]))) <= within_m) continue;
      if (second == nullptr) second = &all[v];
      if (vec::norm(vec::cross(along, vec::sub(all[v], *second))) > within_m) return false;
    }
    return true;
  };
  // The first point has another on its line, or all others are on the second line.
  for (std::size_t k = 1; k < which.size(); ++k) {
    if (fits(which[0], which[k])) return true;
  }
  return which.size() < 3 || fits(which[1], which[2]);
}

/// Corners of a face that are looked at for whether they lie on two lines; a face with more does
/// not.
constexpr std::size_t kMostLineCorners = 64;

/// Growing and uniting of clusters over one body.
class PlaneGrower {
 public:
  PlaneGrower(const Surface& surface, const FaceNeighbors& neighbors)
      : surface_(surface),
        neighbors_(neighbors),
        tol_(surface.plane_tolerance_m),
        exact_tol_(surface.printed ? surface.printed->join_m : tol_) {
    measure_faces();
  }

  void grow_all() {
    std::vector<std::uint32_t> order(surface_.faces.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return area_[a] > area_[b]; });
    owner_.assign(surface_.faces.size(), kUnassigned);
    vertex_stamp_.assign(surface_.vertices.size(), kUnassigned);
    looked_at_.assign(surface_.faces.size(), kUnassigned);
    for (const std::uint32_t seed : order) {
      if (owner_[seed] == kUnassigned) grow_from(seed);
    }
  }

  [[nodiscard]] std::size_t regions() const { return clusters_.size(); }

  void unite_all() {
    for (int pass = 0; pass < kMaxRounds; ++pass) {
      if (!unite_pass()) break;
    }
  }

  PlaneFit finish();

 private:
  void measure_faces();
  void grow_from(std::uint32_t seed);
  bool is_exact(std::uint32_t seed);
  bool accepts(const Cluster& cluster, std::uint32_t face) const;
  void take(Cluster& cluster, std::uint32_t face, std::uint32_t id);
  bool unite_pass();
  void settle_sliver_signs(PlaneFit& fit, const std::vector<bool>& sliver) const;
  FittedPlane finish_plane(Cluster& cluster) const;

  const Surface& surface_;
  const FaceNeighbors& neighbors_;
  double tol_;
  double exact_tol_;             // of planes that the file has exactly
  std::vector<FlatPlane> flat_;  // per face
  std::vector<double> area_;
  std::vector<bool> narrow_;
  std::vector<std::uint32_t> owner_;         // per face: cluster
  std::vector<std::uint32_t> vertex_stamp_;  // per vertex: last cluster that took it
  std::vector<std::uint32_t> looked_at_;     // per face: last seed that asked for it
  std::vector<Cluster> clusters_;
};

void PlaneGrower::measure_faces() {
  for (const SurfaceFace& face : surface_.faces) {
    const std::size_t size = face.vertices.size();
    const Point3& origin = surface_.vertices[face.vertices[0]];
    Point3 doubled{0, 0, 0};
    Point3 mean{0, 0, 0};
    double longest = 0.0;
    for (std::size_t k = 0; k < size; ++k) {
      const Point3 a = vec::sub(surface_.vertices[face.vertices[k]], origin);
      const Point3 b = vec::sub(surface_.vertices[face.vertices[(k + 1) % size]], origin);
      const Point3 c = vec::cross(a, b);
      const Point3 e = size == 3 ? vec::sub(b, a) : a;
      longest = std::max(longest, std::sqrt(vec::dot(e, e)));
      for (std::size_t i = 0; i < 3; ++i) {
        doubled[i] += c[i];
        mean[i] += a[i] / static_cast<double>(size);
      }
    }
    const double twice = std::sqrt(vec::dot(doubled, doubled));
    FlatPlane flat;
    flat.n = twice > 0.0 ? vec::scaled(doubled, 1.0 / twice) : Point3{0, 0, 1};
    flat.d = vec::dot(flat.n, origin) + vec::dot(flat.n, mean);
    const double width = longest > 0.0 ? (size == 3 ? twice : 0.5 * twice) / longest : 0.0;
    flat_.push_back(flat);
    area_.push_back(0.5 * twice);
    narrow_.push_back(width < kNarrowTolerances * tol_);
  }
}

/// True if the file has the plane of a face exactly, and rounding would not have left it so: the
/// face and those that continue it have four corners or more that lie in one plane to a hundredth
/// of the last printed place, and either all print the same number or are not on two lines. A face
/// of a rounded prism has four corners in a plane by construction, and is no evidence.
bool PlaneGrower::is_exact(std::uint32_t seed) {
  if (!surface_.printed) return false;
  const double within_m = surface_.printed->exact_m;
  const FlatPlane& plane = flat_[seed];
  std::vector<std::uint32_t> faces{seed}, corners;
  looked_at_[seed] = seed;
  for (std::size_t k = 0; k < faces.size(); ++k) {
    const std::vector<std::uint32_t>& loop = surface_.faces[faces[k]].vertices;
    corners.insert(corners.end(), loop.begin(), loop.end());
    for (std::size_t e = 0; e < loop.size(); ++e) {
      const std::uint32_t next = neighbors_.across(faces[k], e);
      if (looked_at_[next] == seed || owner_[next] != kUnassigned) continue;
      looked_at_[next] = seed;
      if (vec::dot(flat_[next].n, plane.n) < kGrowCosine) continue;
      const auto& own = surface_.faces[next].vertices;
      if (std::ranges::all_of(own, [&](std::uint32_t v) {
            return plane.distance(surface_.vertices[v]) <= within_m;
          })) {
        faces.push_back(next);
      }
    }
  }
  std::ranges::sort(corners);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  if (corners.size() < 4 || largest_distance(surface_.vertices, corners, plane) > within_m) {
    return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [low, high] =
        std::ranges::minmax(corners, {}, [&](std::uint32_t v) { return surface_.vertices[v][i]; });
    if (surface_.vertices[high][i] - surface_.vertices[low][i] <= within_m) return true;
  }
  return corners.size() > kMostLineCorners || !on_two_lines(surface_.vertices, corners, within_m);
}

bool PlaneGrower::accepts(const Cluster& cluster, std::uint32_t face) const {
  const double tol = cluster.exact ? exact_tol_ : tol_;
  const double cosine = vec::dot(flat_[face].n, cluster.plane.n);
  if (cosine < (narrow_[face] ? kNarrowCosine : kGrowCosine)) return false;
  for (const std::uint32_t v : surface_.faces[face].vertices) {
    if (cluster.plane.distance(surface_.vertices[v]) > tol) return false;
  }
  return true;
}

void PlaneGrower::take(Cluster& cluster, std::uint32_t face, std::uint32_t id) {
  owner_[face] = id;
  cluster.faces.push_back(face);
  cluster.signs.push_back(1);
  cluster.area += area_[face];
  cluster.narrow = cluster.narrow && narrow_[face];
  for (const std::uint32_t v : surface_.faces[face].vertices) {
    if (vertex_stamp_[v] == id) continue;
    vertex_stamp_[v] = id;
    cluster.vertices.push_back(v);
  }
}

void PlaneGrower::grow_from(std::uint32_t seed) {
  const auto id = static_cast<std::uint32_t>(clusters_.size());
  Cluster cluster;
  cluster.plane = flat_[seed];
  cluster.exact = is_exact(seed);
  take(cluster, seed, id);
  double worst = largest_distance(surface_.vertices, cluster.vertices, cluster.plane);
  if (worst > tol_) {
    FlatPlane better;
    if (least_squares(surface_.vertices, cluster.vertices, cluster.plane.n, better)) {
      cluster.plane = better;
      worst = largest_distance(surface_.vertices, cluster.vertices, better);
    }
  }
  if (worst > kMoveTolerances * tol_) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "face %u is not flat: corner would move by %.3g m (limit %.3g m)",
                  surface_.faces[seed].source_face + 1, worst, kMoveTolerances * tol_);
    throw InputError(surface_.file + ": at " +
                     place_text(surface_, surface_.vertices[surface_.faces[seed].vertices[0]]) +
                     ": " + text + "; split the face into triangles");
  }
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::size_t before = cluster.faces.size();
    for (std::size_t k = 0; k < cluster.faces.size(); ++k) {
      const std::uint32_t face = cluster.faces[k];
      for (std::size_t e = 0; e < surface_.faces[face].vertices.size(); ++e) {
        const std::uint32_t next = neighbors_.across(face, e);
        if (owner_[next] == kUnassigned && accepts(cluster, next)) take(cluster, next, id);
      }
    }
    if (cluster.faces.size() == before) break;
    FlatPlane better;
    if (!least_squares(surface_.vertices, cluster.vertices, cluster.plane.n, better)) break;
    if (largest_distance(surface_.vertices, cluster.vertices, better) > tol_) break;
    cluster.plane = better;
  }
  clusters_.push_back(std::move(cluster));
}

bool PlaneGrower::unite_pass() {
  std::stable_sort(clusters_.begin(), clusters_.end(),
                   [](const Cluster& a, const Cluster& b) { return a.area > b.area; });
  std::vector<bool> enlarged(clusters_.size(), false);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& small = clusters_[i];
    const Point3& probe = surface_.vertices[small.vertices[0]];
    std::size_t host = kept;
    for (std::size_t j = 0; j < kept && host == kept; ++j) {
      const Cluster& large = clusters_[j];
      // Planes that the file distinguishes stay apart; a narrow face between the two is their step.
      const double tol = large.exact && (small.exact || small.narrow) ? exact_tol_ : tol_;
      if (large.plane.distance(probe) > tol) continue;
      if (!small.narrow && std::abs(vec::dot(large.plane.n, small.plane.n)) < kGrowCosine) continue;
      if (largest_distance(surface_.vertices, small.vertices, large.plane) <= tol) host = j;
    }
    if (host == kept) {
      if (kept != i) clusters_[kept] = std::move(small);
      ++kept;
      continue;
    }
    Cluster& large = clusters_[host];
    const int sign = vec::dot(large.plane.n, small.plane.n) < 0.0 ? -1 : 1;
    large.faces.insert(large.faces.end(), small.faces.begin(), small.faces.end());
    for (const int s : small.signs) large.signs.push_back(s * sign);
    large.vertices.insert(large.vertices.end(), small.vertices.begin(), small.vertices.end());
    large.area += small.area;
    large.narrow = large.narrow && small.narrow;
    enlarged[host] = true;
  }
  const bool changed = kept != clusters_.size();
  clusters_.resize(kept);
  for (std::size_t j = 0; j < kept; ++j) {
    Cluster& cluster = clusters_[j];
    if (!enlarged[j]) continue;
    std::sort(cluster.vertices.begin(), cluster.vertices.end());
    cluster.vertices.erase(std::unique(cluster.vertices.begin(), cluster.vertices.end()),
                           cluster.vertices.end());
    FlatPlane better;
    if (least_squares(surface_.vertices, cluster.vertices, cluster.plane.n, better) &&
        largest_distance(surface_.vertices, cluster.vertices, better) <= tol_) {
      cluster.plane = better;
    }
  }
  return changed;
}

FittedPlane PlaneGrower::finish_plane(Cluster& cluster) const {
  FittedPlane plane;
  std::sort(cluster.vertices.begin(), cluster.vertices.end());
  plane.vertices = cluster.vertices;
  plane.normal = cluster.plane.n;
  plane.offset_m = cluster.plane.d;
  plane.residual_m = largest_distance(surface_.vertices, plane.vertices, cluster.plane);
  plane.widest_face = *std::max_element(
      cluster.faces.begin(), cluster.faces.end(), [&](std::uint32_t a, std::uint32_t b) {
        return area_[a] < area_[b] || (area_[a] == area_[b] && a > b);
      });
  std::size_t main = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(plane.normal[i]) > std::abs(plane.normal[main])) main = i;
  }
  std::vector<double> values;
  for (const std::uint32_t v : plane.vertices) values.push_back(surface_.vertices[v][main]);
  std::sort(values.begin(), values.end());
  const double spread = values.back() - values.front();
  // Allowed: what the general fit leaves too, or the last digits of the file's coordinates. A clean
  // mesh that is turned by less than the tolerance therefore stays turned.
  const double last_digits = 4.0 * std::numeric_limits<double>::epsilon() *
                             std::max(std::abs(surface_.centre_m[main]),
                                      std::max(std::abs(values.back()), std::abs(values.front())));
  if (spread <= std::max(4.0 * plane.residual_m, last_digits) && spread <= 2.0 * tol_) {
    double offset = 0.5 * (values.back() + values.front());
    const double median = values[values.size() / 2];
    const auto range = std::equal_range(values.begin(), values.end(), median);
    if (2 * static_cast<std::size_t>(range.second - range.first) >= values.size()) offset = median;
    const double worst = std::max(values.back() - offset, offset - values.front());
    if (worst <= tol_) {
      if (plane.normal[main] < 0.0) {
        for (int& s : cluster.signs) s = -s;
      }
      plane.axis = static_cast<int>(main);
      plane.normal = {0, 0, 0};
      plane.normal[main] = 1.0;
      plane.offset_m = offset;
      plane.residual_m = worst;
      return plane;
    }
  }
  // The refit had to keep every vertex within tol; where the seed's own plane was kept, it stays.
  FlatPlane fitted;
  if (least_squares(surface_.vertices, plane.vertices, plane.normal, fitted) &&
      largest_distance(surface_.vertices, plane.vertices, fitted) <=
          std::max(tol_, plane.residual_m)) {
    plane.normal = fitted.n;
    plane.offset_m = fitted.d;
    refine(surface_.vertices, plane);
    plane.residual_m = 0.0;
    for (const std::uint32_t v : plane.vertices) {
      plane.residual_m =
          std::max(plane.residual_m,
                   std::abs(fine_distance(plane.normal, plane.normal_tail, surface_.vertices[v],
                                          plane.offset_m, plane.offset_tail_m)));
    }
  }
  return plane;
}

void PlaneGrower::settle_sliver_signs(PlaneFit& fit, const std::vector<bool>& sliver) const {
  // The normal of a sliver says nothing about its side: it goes with a wide neighbour.
  for (std::uint32_t f = 0; f < surface_.faces.size(); ++f) {
    if (!sliver[f]) continue;
    for (std::size_t e = 0; e < surface_.faces[f].vertices.size(); ++e) {
      const std::uint32_t next = neighbors_.across(f, e);
      if (sliver[next] || fit.face_plane[next] != fit.face_plane[f]) continue;
      fit.face_sign[f] = fit.face_sign[next];
      break;
    }
  }
}

PlaneFit PlaneGrower::finish() {
  PlaneFit fit;
  fit.face_plane.assign(surface_.faces.size(), 0);
  fit.face_sign.assign(surface_.faces.size(), 1);
  std::vector<bool> sliver(surface_.faces.size(), false);
  for (Cluster& cluster : clusters_) {
    fit.planes.push_back(finish_plane(cluster));
    fit.largest_residual_m = std::max(fit.largest_residual_m, fit.planes.back().residual_m);
    for (std::size_t k = 0; k < cluster.faces.size(); ++k) {
      const std::uint32_t f = cluster.faces[k];
      fit.face_plane[f] = static_cast<std::uint32_t>(fit.planes.size() - 1);
      fit.face_sign[f] = cluster.signs[k];
      const double agreement = cluster.signs[k] * vec::dot(flat_[f].n, fit.planes.back().normal);
      sliver[f] = narrow_[f] && agreement < kGrowCosine;
    }
  }
  settle_sliver_signs(fit, sliver);
  return fit;
}

}  // namespace

PlaneFit fit_planes(const Surface& surface, const FaceNeighbors& neighbors) {
  PlaneGrower grower(surface, neighbors);
  grower.grow_all();
  if (grower.regions() > kMostFlatRegions) {
    throw LimitError(surface.file + ": " + std::to_string(grower.regions()) +
                     " flat regions, limit " + std::to_string(kMostFlatRegions) +
                     ": too fine for an exact decomposition; use a coarser mesh, or a surface");
  }
  grower.unite_all();
  return grower.finish();
}

}  // namespace haptic::tools
