// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/edge_collapse.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <queue>
#include <utility>

#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/simplify/face_triangles.hpp"
#include "tools/graph_compiler/simplify/reach_proof.hpp"
#include "tools/graph_compiler/surface/triangle_crossing.hpp"

namespace haptic::tools {
namespace {

constexpr std::uint32_t kNoIndex = 0xFFFFFFFFU;
constexpr int kMostRounds = 6;
/// Most spokes of a point that is removed: the middle of a fan is removed when most of its spokes
/// have gone, for then the new triangles cross few of the given ones.
constexpr std::size_t kMostSpokes = 24;
/// The last proof has fewer targets than those before it, and must find its way without the others.
constexpr std::size_t kLastEffort = 64;
/// Roundings of a distance and of the 60 cuts above it, four of each cut, as part of the largest
/// coordinate; counted twice.
constexpr double kCoordinateRounding = 160.0 * std::numeric_limits<double>::epsilon();
/// Cosine between the normals of a triangle before and after; below, it counts as turned over.
constexpr double kLeastTurn = 0.1;
/// Cosine between two triangles at an edge that are folded onto each other.
constexpr double kFolded = -0.98;
/// Height of a triangle over its longest side, unless it was lower before.
constexpr double kLeastHeight = 1.0e-4;
/// Weight of the length to the fourth: short edges first where the surface is flat.
constexpr double kLengthShare = 1.0e-10;

using IndexTriple = std::array<std::uint32_t, 3>;

Point3 twice_area_of(const FaceTriangle& t) { return exact_twice_area(t.data(), 3); }

double height_share(const FaceTriangle& t) {
  const double longest =
      std::max({vec::distance(t[0], t[1]), vec::distance(t[1], t[2]), vec::distance(t[2], t[0])});
  return vec::norm(twice_area_of(t)) / (longest * longest);
}

bool has(const IndexTriple& t, std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; }

std::size_t shared_corners(const IndexTriple& a, const IndexTriple& b) {
  return static_cast<std::size_t>(has(b, a[0])) + static_cast<std::size_t>(has(b, a[1])) +
         static_cast<std::size_t>(has(b, a[2]));
}

void erase_value(std::vector<std::uint32_t>& from, std::uint32_t value) {
  from.erase(std::remove(from.begin(), from.end(), value), from.end());
}

void keep_each_once(std::vector<std::uint32_t>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

BoxTree tree_of(const TriangleMesh& mesh) {
  std::vector<vec::Box> boxes;
  boxes.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) boxes.push_back(box_of(mesh.corners(i)));
  return BoxTree(std::move(boxes));
}

}  // namespace

TriangleMesh triangle_mesh(const SurfacePart& part) {
  TriangleMesh mesh;
  mesh.points = part.vertices_m;
  mesh.fixed.assign(mesh.points.size(), 0);
  std::vector<std::uint32_t> edges_at(mesh.points.size(), 0);
  std::vector<std::uint32_t> facets_at(part.edges.size(), 0);
  for (const std::uint32_t e : part.edge_of) ++facets_at[e];
  for (std::size_t e = 0; e < part.edges.size(); ++e) {
    const std::uint32_t directions = part.inward_begin[e + 1] - part.inward_begin[e];
    for (const std::uint32_t v : part.edges[e]) {
      ++edges_at[v];
      if (directions > facets_at[e]) mesh.fixed[v] = 1;
    }
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (part.ring_begin[v + 1] - part.ring_begin[v] > edges_at[v]) mesh.fixed[v] = 1;
  }
  for (const SurfacePart::Facet& facet : part.facets) {
    mesh.triangles.push_back({facet.loop[0], facet.loop[1], facet.loop[2]});
  }
  return mesh;
}

RawMesh raw_mesh(const TriangleMesh& mesh, const RawMesh& like) {
  RawMesh raw;
  raw.file = like.file;
  raw.indexed = true;
  raw.vertices = mesh.points;
  raw.vertex_places.assign(mesh.points.size(), 0);
  for (const IndexTriple& t : mesh.triangles) {
    RawFace face;
    face.vertices.assign(t.begin(), t.end());
    raw.faces.push_back(std::move(face));
  }
  return raw;
}

class EdgeCollapse::Work {
 public:
  explicit Work(TriangleMesh given);
  void run(double tolerance_m, std::size_t enough, const std::function<void(double)>& tell);
  [[nodiscard]] TriangleMesh result() const;
  CollapseAccount account();

  std::size_t alive_count = 0;

 private:
  /// How the triangles at a point hang together.
  enum class Fan : std::uint8_t { kClosed, kOpen, kOther };

  enum class Verdict : std::uint8_t { kDone, kDistance, kTopology, kCrossing };

  /// Sum of squared distances from planes: x^T A x + 2 b x + c.
  struct Quadric {
    std::array<double, 10> q{};

    void add_plane(const Point3& n, const Point3& on, double weight) {
      const double d = -vec::dot(n, on);
      const std::array<double, 4> p{n[0], n[1], n[2], d};
      std::size_t k = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = i; j < 4; ++j) q[k++] += weight * p[i] * p[j];
      }
    }
    void add(const Quadric& other) {
      for (std::size_t k = 0; k < q.size(); ++k) q[k] += other.q[k];
    }
    [[nodiscard]] double at(const Point3& x) const {
      const std::array<double, 4> p{x[0], x[1], x[2], 1.0};
      double sum = 0.0;
      std::size_t k = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = i; j < 4; ++j) sum += (i == j ? 1.0 : 2.0) * q[k++] * p[i] * p[j];
      }
      return std::max(sum, 0.0);
    }
  };

  struct Candidate {
    float cost = 0.0F;
    std::uint32_t u = 0, v = 0;
    std::uint32_t stamp = 0;  // of both ends together, when the cost was formed
    bool operator>(const Candidate& o) const {
      if (cost != o.cost) return cost > o.cost;
      return u != o.u ? u > o.u : v > o.v;
    }
  };

  [[nodiscard]] FaceTriangle corners_of(const IndexTriple& t) const {
    return {given_.points[t[0]], given_.points[t[1]], given_.points[t[2]]};
  }
  [[nodiscard]] Point3 local(std::uint32_t v) const { return vec::sub(given_.points[v], centre_); }
  void neighbours_of(std::uint32_t v, std::vector<std::uint32_t>& out) const;
  [[nodiscard]] Fan fan_of(std::uint32_t v) const;
  void push(std::uint32_t u, std::uint32_t v);
  Verdict attempt(std::uint32_t u, std::uint32_t v);
  [[nodiscard]] bool keeps_topology(std::uint32_t u, std::uint32_t v) const;
  [[nodiscard]] bool keeps_shape() const;
  bool meets_others();
  [[nodiscard]] bool may_meet(const IndexTriple& a, const IndexTriple& b) const;
  bool within_reach(std::uint32_t u);
  void commit(std::uint32_t u, std::uint32_t v);
  void add_parallels(std::uint32_t u, std::uint32_t v);
  void collapse(std::uint32_t u, std::uint32_t v);

  TriangleMesh given_;
  BoxTree tree_;
  Point3 centre_{0, 0, 0};
  double margin_m_ = 0.0, limit_m_ = 0.0, within_m_ = 0.0;
  std::vector<IndexTriple> faces_;                    // as they are now
  std::vector<std::uint8_t> alive_;                   // of each face
  std::vector<std::vector<std::uint32_t>> faces_at_;  // by point
  std::vector<std::vector<std::uint32_t>> answers_;   // given triangles, by face
  std::vector<std::vector<std::uint32_t>> standing_;  // faces, by given triangle
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> stamps_;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
  CollapseAccount account_;
  ReachProof proof_;

  std::vector<std::array<std::uint32_t, 2>> follow_;  // edges to be tried next

  // The attempt: faces at u, those that go over to v as they are and as they would be, the given
  // triangles that they answer for, and which pairs the proof needs.
  std::vector<std::uint32_t> star_, moved_;
  std::vector<IndexTriple> fresh_;
  std::vector<FaceTriangle> fresh_corners_;
  std::vector<std::uint32_t> involved_;
  std::vector<std::vector<std::uint32_t>> needed_;  // given triangles, by fresh face
};

EdgeCollapse::Work::Work(TriangleMesh given) : given_(std::move(given)), tree_(tree_of(given_)) {
  vec::Box box;
  double largest = 0.0;
  for (const Point3& p : given_.points) {
    box.include(p);
    for (const double x : p) largest = std::max(largest, std::abs(x));
  }
  margin_m_ = kCoordinateRounding * largest;
  centre_ = vec::scaled(vec::add(box.low, box.high), 0.5);
  faces_ = given_.triangles;
  alive_count = faces_.size();
  alive_.assign(faces_.size(), 1);
  faces_at_.resize(given_.points.size());
  answers_.resize(faces_.size());
  standing_.resize(faces_.size());
  quadrics_.resize(given_.points.size());
  stamps_.assign(given_.points.size(), 0);
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (const std::uint32_t v : faces_[f]) faces_at_[v].push_back(f);
    answers_[f] = {f};
    standing_[f] = {f};
    const Point3 area = twice_area_of(corners_of(faces_[f]));
    for (const std::uint32_t v : faces_[f]) {
      quadrics_[v].add_plane(vec::unit(area), local(faces_[f][0]), vec::norm(area));
    }
  }
  // Planes upright on borders keep them in place.
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    const Point3 normal = vec::unit(twice_area_of(corners_of(faces_[f])));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = faces_[f][k], b = faces_[f][(k + 1) % 3];
      const auto count = std::count_if(faces_at_[a].begin(), faces_at_[a].end(),
                                       [&](std::uint32_t g) { return has(faces_[g], b); });
      if (count == 2) continue;
      const Point3 along = vec::sub(given_.points[b], given_.points[a]);
      const Point3 across = vec::unit(vec::cross(along, normal));
      for (const std::uint32_t v : {a, b}) {
        quadrics_[v].add_plane(across, local(a), vec::dot(along, along));
      }
    }
  }
  account_.triangles_before = faces_.size();
}

void EdgeCollapse::Work::neighbours_of(std::uint32_t v, std::vector<std::uint32_t>& out) const {
  out.clear();
  for (const std::uint32_t f : faces_at_[v]) {
    for (const std::uint32_t w : faces_[f]) {
      if (w != v) out.push_back(w);
    }
  }
  keep_each_once(out);
}

EdgeCollapse::Work::Fan EdgeCollapse::Work::fan_of(std::uint32_t v) const {
  const std::vector<std::uint32_t>& star = faces_at_[v];
  std::vector<std::uint32_t> ends;
  for (const std::uint32_t f : star) {
    for (const std::uint32_t w : faces_[f]) {
      if (w != v) ends.push_back(w);
    }
  }
  std::sort(ends.begin(), ends.end());
  std::uint32_t first = kNoIndex;
  std::size_t borders = 0;
  for (std::size_t i = 0; i < ends.size();) {
    std::size_t end = i;
    while (end < ends.size() && ends[end] == ends[i]) ++end;
    if (end - i > 2) return Fan::kOther;
    if (end - i == 1) {
      ++borders;
      first = ends[i];
    }
    i = end;
  }
  if (borders != 0 && borders != 2) return Fan::kOther;
  // One walk around the point must come past all of its faces.
  std::uint32_t at = borders == 0 ? ends[0] : first, face = kNoIndex;
  std::size_t walked = 0;
  while (walked <= star.size()) {
    const auto next = std::find_if(
        star.begin(), star.end(), [&](std::uint32_t f) { return f != face && has(faces_[f], at); });
    if (next == star.end()) break;
    face = *next;
    ++walked;
    for (const std::uint32_t w : faces_[face]) {
      if (w != v && w != at) {
        at = w;
        break;
      }
    }
    if (borders == 0 && at == ends[0]) break;
  }
  if (walked != star.size()) return Fan::kOther;
  return borders == 0 ? Fan::kClosed : Fan::kOpen;
}

void EdgeCollapse::Work::push(std::uint32_t u, std::uint32_t v) {
  if (!given_.fixed.empty() && given_.fixed[u] != 0) return;
  Quadric sum = quadrics_[u];
  sum.add(quadrics_[v]);
  const Point3 along = vec::sub(given_.points[v], given_.points[u]);
  const double square = vec::dot(along, along);
  // To single precision: what differs by rounding alone goes by the numbers of the points, so rings
  // that lie over each other lose the same ones and their quads stay flat.
  const double cost = sum.at(local(v)) + kLengthShare * square * square;
  queue_.push({static_cast<float>(cost), u, v, stamps_[u] + stamps_[v]});
}

void EdgeCollapse::Work::run(double tolerance_m, std::size_t enough,
                             const std::function<void(double)>& tell) {
  limit_m_ = std::max(tolerance_m, limit_m_);
  within_m_ = limit_m_ - 2.0 * margin_m_;
  if (!(within_m_ > 0.0)) return;
  std::vector<std::uint32_t> around;
  for (int round = 0; round < kMostRounds && alive_count > enough; ++round) {
    queue_ = {};
    account_.kept_by_distance = account_.kept_by_topology = account_.kept_by_crossing = 0;
    for (std::uint32_t v = 0; v < faces_at_.size(); ++v) {
      neighbours_of(v, around);
      for (const std::uint32_t w : around) push(v, w);
    }
    const std::size_t before = alive_count;
    std::size_t looked_at = 0;
    while (!queue_.empty() && alive_count > enough) {
      const Candidate next = queue_.top();
      queue_.pop();
      if (++looked_at % 256 == 0 && tell) {
        tell(static_cast<double>(looked_at) / static_cast<double>(looked_at + queue_.size()));
      }
      if (faces_at_[next.u].empty() || faces_at_[next.v].empty()) continue;
      if (next.stamp != stamps_[next.u] + stamps_[next.v]) continue;
      follow_.assign(1, {next.u, next.v});
      while (!follow_.empty() && alive_count > enough) {
        const auto [u, v] = follow_.back();
        follow_.pop_back();
        collapse(u, v);
      }
    }
    if (100 * (before - alive_count) <= before) break;
  }
}

/// Link condition: u and v have the points opposite to their edge in common and no others, and no
/// face has the three points of a new one. A border collapses along itself.
bool EdgeCollapse::Work::keeps_topology(std::uint32_t u, std::uint32_t v) const {
  const Fan fan = fan_of(u);
  if (fan == Fan::kOther) return false;
  const std::size_t at_edge = star_.size() - moved_.size();
  if (at_edge != (fan == Fan::kClosed ? 2U : 1U)) return false;
  if (moved_.empty()) return false;  // the last triangle of a sheet
  std::vector<std::uint32_t> of_u, of_v, both;
  neighbours_of(u, of_u);
  neighbours_of(v, of_v);
  std::set_intersection(of_u.begin(), of_u.end(), of_v.begin(), of_v.end(),
                        std::back_inserter(both));
  if (both.size() != at_edge) return false;
  for (const IndexTriple& t : fresh_) {
    for (const std::uint32_t f : faces_at_[v]) {
      if (shared_corners(t, faces_[f]) == 3) return false;
    }
  }
  return true;
}

/// No triangle turns over or becomes a needle.
bool EdgeCollapse::Work::keeps_shape() const {
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    const FaceTriangle before = corners_of(faces_[moved_[i]]);
    const FaceTriangle& after = fresh_corners_[i];
    const double least = std::min(kLeastHeight, height_share(before));
    if (!(height_share(after) >= least)) return false;
    const Point3 old_normal = vec::unit(twice_area_of(before));
    if (vec::dot(old_normal, vec::unit(twice_area_of(after))) < kLeastTurn) return false;
  }
  return true;
}

bool EdgeCollapse::Work::may_meet(const IndexTriple& a, const IndexTriple& b) const {
  const FaceTriangle s = corners_of(a), t = corners_of(b);
  switch (shared_corners(a, b)) {
    case 0:
      return triangles_meet(s, t);
    case 1:
      return triangles_cross(s, t);
    case 2:
      break;
    default:
      return true;
  }
  // At one edge: folded onto each other where the third corners lie on one side of it.
  std::array<Point3, 2> edge{}, apex{};
  std::size_t n = 0;
  for (const std::uint32_t v : a) {
    if (has(b, v)) {
      edge[n++] = given_.points[v];
    } else {
      apex[0] = given_.points[v];
    }
  }
  for (const std::uint32_t v : b) {
    if (!has(a, v)) apex[1] = given_.points[v];
  }
  const Point3 along = vec::unit(vec::sub(edge[1], edge[0]));
  std::array<Point3, 2> into{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Point3 from = vec::sub(apex[k], edge[0]);
    into[k] = vec::unit(vec::sub(from, vec::scaled(along, vec::dot(from, along))));
  }
  return vec::dot(into[0], into[1]) > -kFolded;
}

/// A face that a new triangle meets is within the limit of a given triangle that it answers for,
/// which is therefore within the limit of the new triangle.
bool EdgeCollapse::Work::meets_others() {
  std::vector<std::uint32_t> near, others;
  for (std::size_t i = 0; i < fresh_.size(); ++i) {
    const vec::Box box = box_of(fresh_corners_[i]);
    tree_.find(box.grown(limit_m_), near);
    others.clear();
    for (const std::uint32_t g : near) {
      others.insert(others.end(), standing_[g].begin(), standing_[g].end());
    }
    keep_each_once(others);
    for (const std::uint32_t f : others) {
      if (std::find(star_.begin(), star_.end(), f) != star_.end()) continue;
      if (!box.meets(box_of(corners_of(faces_[f])))) continue;
      if (may_meet(fresh_[i], faces_[f])) return true;
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (may_meet(fresh_[i], fresh_[k])) return true;
    }
  }
  return false;
}

/// Both directions for all that the collapse changes. Fills needed_.
bool EdgeCollapse::Work::within_reach(std::uint32_t u) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const FaceTriangle& t : fresh_corners_) {
    nearest = std::min(nearest, reach_of(given_.points[u], t));
  }
  if (nearest > within_m_) return false;
  involved_.clear();
  for (const std::uint32_t f : star_) {
    involved_.insert(involved_.end(), answers_[f].begin(), answers_[f].end());
  }
  keep_each_once(involved_);
  needed_.assign(fresh_.size(), {});
  std::vector<FaceTriangle> targets;
  for (const std::uint32_t g : involved_) {
    targets = fresh_corners_;
    for (const std::uint32_t f : standing_[g]) {
      if (std::find(star_.begin(), star_.end(), f) == star_.end()) {
        targets.push_back(corners_of(faces_[f]));
      }
    }
    if (!proof_.holds(given_.corners(g), targets, within_m_)) return false;
    for (std::size_t i = 0; i < fresh_.size(); ++i) {
      if (proof_.used()[i] != 0) needed_[i].push_back(g);
    }
  }
  targets.clear();
  for (const std::uint32_t g : involved_) targets.push_back(given_.corners(g));
  for (std::size_t i = 0; i < fresh_.size(); ++i) {
    if (!proof_.holds(fresh_corners_[i], targets, within_m_)) return false;
    for (std::size_t k = 0; k < involved_.size(); ++k) {
      if (proof_.used()[k] != 0) needed_[i].push_back(involved_[k]);
    }
    keep_each_once(needed_[i]);
  }
  return true;
}

EdgeCollapse::Work::Verdict EdgeCollapse::Work::attempt(std::uint32_t u, std::uint32_t v) {
  star_ = faces_at_[u];
  if (star_.size() > kMostSpokes) return Verdict::kTopology;
  moved_.clear();
  fresh_.clear();
  fresh_corners_.clear();
  for (const std::uint32_t f : star_) {
    if (has(faces_[f], v)) continue;
    moved_.push_back(f);
    IndexTriple t = faces_[f];
    std::replace(t.begin(), t.end(), u, v);
    fresh_.push_back(t);
    fresh_corners_.push_back(corners_of(t));
  }
  if (!keeps_topology(u, v)) return Verdict::kTopology;
  if (!keeps_shape()) return Verdict::kCrossing;
  if (!within_reach(u)) return Verdict::kDistance;
  return meets_others() ? Verdict::kCrossing : Verdict::kDone;
}

/// Edges from neighbours of u to neighbours of v in about the same direction: the next rungs of the
/// ladder whose rung u-v goes. Where they go with it, the quads of rods and threads stay flat.
void EdgeCollapse::Work::add_parallels(std::uint32_t u, std::uint32_t v) {
  constexpr double kParallel = 0.9;
  std::vector<std::uint32_t> of_u, of_v, of_w;
  neighbours_of(u, of_u);
  neighbours_of(v, of_v);
  const Point3 along = vec::unit(vec::sub(given_.points[v], given_.points[u]));
  for (const std::uint32_t w : of_u) {
    if (w == v || (!given_.fixed.empty() && given_.fixed[w] != 0)) continue;
    neighbours_of(w, of_w);
    for (const std::uint32_t x : of_w) {
      if (x == u || !std::binary_search(of_v.begin(), of_v.end(), x)) continue;
      const Point3 other = vec::unit(vec::sub(given_.points[x], given_.points[w]));
      if (vec::dot(along, other) > kParallel) follow_.push_back({w, x});
    }
  }
}

void EdgeCollapse::Work::collapse(std::uint32_t u, std::uint32_t v) {
  const bool is_edge = std::any_of(faces_at_[u].begin(), faces_at_[u].end(),
                                   [&](std::uint32_t f) { return has(faces_[f], v); });
  if (!is_edge) return;  // gone with one of those before it
  switch (attempt(u, v)) {
    case Verdict::kDone:
      add_parallels(u, v);
      commit(u, v);
      break;
    case Verdict::kDistance:
      ++account_.kept_by_distance;
      break;
    case Verdict::kTopology:
      ++account_.kept_by_topology;
      break;
    case Verdict::kCrossing:
      ++account_.kept_by_crossing;
      break;
  }
}

/// After a successful attempt.
void EdgeCollapse::Work::commit(std::uint32_t u, std::uint32_t v) {
  for (const std::uint32_t f : star_) {
    for (const std::uint32_t g : answers_[f]) erase_value(standing_[g], f);
    answers_[f].clear();
    if (!has(faces_[f], v)) continue;
    alive_[f] = 0;
    --alive_count;
    for (const std::uint32_t w : faces_[f]) {
      if (w != u) erase_value(faces_at_[w], f);
    }
  }
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    const std::uint32_t f = moved_[i];
    faces_[f] = fresh_[i];
    faces_at_[v].push_back(f);
    answers_[f] = std::move(needed_[i]);
    for (const std::uint32_t g : answers_[f]) standing_[g].push_back(f);
  }
  faces_at_[u].clear();
  quadrics_[v].add(quadrics_[u]);
  ++stamps_[u];
  ++stamps_[v];
  std::vector<std::uint32_t> around;
  neighbours_of(v, around);
  for (const std::uint32_t w : around) {
    push(v, w);
    push(w, v);
  }
}

TriangleMesh EdgeCollapse::Work::result() const {
  TriangleMesh out;
  std::vector<std::uint32_t> number(given_.points.size(), kNoIndex);
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (alive_[f] == 0) continue;
    IndexTriple t{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = faces_[f][k];
      if (number[v] == kNoIndex) {
        number[v] = static_cast<std::uint32_t>(out.points.size());
        out.points.push_back(given_.points[v]);
        out.fixed.push_back(given_.fixed.empty() ? 0 : given_.fixed[v]);
      }
      t[k] = number[v];
    }
    out.triangles.push_back(t);
  }
  return out;
}

CollapseAccount EdgeCollapse::Work::account() {
  CollapseAccount out = account_;
  out.limit_m = limit_m_;
  out.triangles_after = alive_count;
  if (!out.changed()) return out;
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<FaceTriangle> targets;
  const auto bound = [&](const FaceTriangle& t) {
    return proof_.holds(t, targets, within_m_, kLastEffort) ? proof_.bound_m() + 2.0 * margin_m_
                                                            : infinite;
  };
  for (std::size_t g = 0; g < standing_.size(); ++g) {
    targets.clear();
    for (const std::uint32_t f : standing_[g]) targets.push_back(corners_of(faces_[f]));
    out.given_to_result_m = std::max(out.given_to_result_m, bound(given_.corners(g)));
  }
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (alive_[f] == 0) continue;
    targets.clear();
    for (const std::uint32_t g : answers_[f]) targets.push_back(given_.corners(g));
    out.result_to_given_m = std::max(out.result_to_given_m, bound(corners_of(faces_[f])));
  }
  return out;
}

EdgeCollapse::EdgeCollapse(TriangleMesh given) : work_(std::make_unique<Work>(std::move(given))) {}
EdgeCollapse::~EdgeCollapse() = default;

void EdgeCollapse::run(double tolerance_m, std::size_t enough,
                       const std::function<void(double)>& tell) {
  work_->run(tolerance_m, enough, tell);
}
std::size_t EdgeCollapse::triangles() const { return work_->alive_count; }
TriangleMesh EdgeCollapse::result() const { return work_->result(); }
CollapseAccount EdgeCollapse::account() { return work_->account(); }

namespace {

/// The lowest point of the part of a triangle that stands over another one, and its height.
struct Overhang {
  double height = 0.0;
  Point3 at{0, 0, 0};
};

/// Keeps what lies at least `inset` inside of the upright plane through a-b.
void cut_upright(std::vector<Point3>& polygon, const Point3& a, const Point3& b,
                 const Point3& normal, double inset, std::vector<Point3>& scratch) {
  const Point3 inward = vec::unit(vec::cross(normal, vec::sub(b, a)));
  const auto depth = [&](const Point3& p) { return vec::dot(inward, vec::sub(p, a)) - inset; };
  scratch.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    const double at_p = depth(p), at_q = depth(q);
    if (at_p >= 0.0) scratch.push_back(p);
    if ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0)) {
      scratch.push_back(vec::add(p, vec::scaled(vec::sub(q, p), at_p / (at_p - at_q))));
    }
  }
  polygon.swap(scratch);
}

/// Range of heights of triangle `other` over the interior of `t`, along t's unit normal `up`;
/// nullopt if they do not overlap.
std::optional<Overhang> overhang_of(const FaceTriangle& other, const FaceTriangle& t,
                                    const Point3& normal, const Point3& up, double inset) {
  std::vector<Point3> polygon(other.begin(), other.end()), scratch;
  for (std::size_t k = 0; k < 3 && polygon.size() >= 3; ++k) {
    cut_upright(polygon, t[k], t[(k + 1) % 3], normal, inset, scratch);
  }
  if (polygon.size() < 3) return std::nullopt;
  Overhang lowest{std::numeric_limits<double>::infinity(), {0, 0, 0}};
  for (const Point3& p : polygon) {
    const double height = vec::dot(up, vec::sub(p, t[0]));
    if (height < lowest.height) lowest = {height, p};
  }
  return lowest;
}

constexpr double kOpposite = 0.94;  // cosine of 20 degrees

/// An edge of one triangle alone.
struct OpenEdge {
  std::uint32_t from = 0, to = 0;
  Point3 along{0, 0, 0}, outward{0, 0, 0};  ///< unit; outward in the triangle's plane
};

std::vector<OpenEdge> open_edges(const TriangleMesh& mesh, const std::vector<Point3>& normals) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) sides.emplace_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::ranges::sort(sides);
  std::vector<OpenEdge> edges;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k], to = t[(k + 1) % 3];
      const std::pair<std::uint32_t, std::uint32_t> side = std::minmax(from, to);
      // clang++ 14 takes no range of std::ranges for one.
      const auto [first, last] = std::equal_range(sides.begin(), sides.end(), side);
      if (last - first != 1) continue;
      const Point3 along = vec::unit(vec::sub(mesh.points[to], mesh.points[from]));
      edges.push_back({from, to, along, vec::unit(vec::cross(along, normals[i]))});
    }
  }
  return edges;
}

/// The least distance from the line of `edge` to the part of `other` that lies beside it, outward
/// of it; absent where there is none.
std::optional<Overhang> beside(const TriangleMesh& mesh, const OpenEdge& edge,
                               const OpenEdge& other, double inset) {
  const Point3& origin = mesh.points[edge.from];
  const double length = vec::norm(vec::sub(mesh.points[edge.to], origin));
  Point3 p = mesh.points[other.from], q = mesh.points[other.to];
  const auto at = [&](const Point3& x) { return vec::dot(edge.along, vec::sub(x, origin)); };
  for (const auto& [bound, sign] : {std::pair{inset, 1.0}, std::pair{length - inset, -1.0}}) {
    const double in_p = sign * (at(p) - bound), in_q = sign * (at(q) - bound);
    if (in_p < 0 && in_q < 0) return std::nullopt;
    if (in_p * in_q >= 0) continue;
    const Point3 cut = vec::add(p, vec::scaled(vec::sub(q, p), in_p / (in_p - in_q)));
    (in_p < 0 ? p : q) = cut;
  }
  std::optional<Overhang> nearest;
  for (const Point3& x : {p, q}) {
    const Point3 off = vec::sub(vec::sub(x, origin), vec::scaled(edge.along, at(x)));
    if (!(vec::dot(edge.outward, off) > inset)) return std::nullopt;
    const double distance = vec::norm(off);
    if (!nearest || distance < nearest->height) {
      nearest = {distance, vec::sub(x, vec::scaled(off, 0.5))};
    }
  }
  return nearest;
}

/// The narrowest hole or gap between open edges, below `reach_m`.
std::optional<NarrowPassage> narrowest_opening(const TriangleMesh& mesh,
                                               const std::vector<Point3>& normals,
                                               double touching_m, double reach_m) {
  const std::vector<OpenEdge> edges = open_edges(mesh, normals);
  std::vector<vec::Box> boxes(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    boxes[e].include(mesh.points[edges[e].from]);
    boxes[e].include(mesh.points[edges[e].to]);
  }
  const BoxTree tree(boxes);
  std::optional<NarrowPassage> found;
  std::vector<std::uint32_t> near;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const OpenEdge& edge = edges[e];
    const double reach = found ? found->width_m : reach_m;
    vec::Box box;
    for (const std::uint32_t v : {edge.from, edge.to}) {
      for (std::size_t k = 0; k < 3; ++k) {
        Point3 p = mesh.points[v];
        p[k] += reach;
        box.include(p);
        p[k] -= 2 * reach;
        box.include(p);
      }
    }
    tree.find(box, near);
    for (const std::uint32_t k : near) {
      const OpenEdge& other = edges[k];
      if (other.from == edge.from || other.from == edge.to || other.to == edge.from ||
          other.to == edge.to || !(vec::dot(edge.outward, other.outward) < -kOpposite)) {
        continue;
      }
      const auto gap = beside(mesh, edge, other, touching_m);
      if (!gap || !(gap->height > touching_m) || !(gap->height < reach)) continue;
      if (!found || gap->height < found->width_m) found = {gap->height, gap->at, false};
    }
  }
  return found;
}

}  // namespace

std::optional<NarrowPassage> narrowest_passage(const TriangleMesh& mesh, bool closed,
                                               double touching_m, double reach_m) {
  const BoxTree tree = tree_of(mesh);
  std::vector<Point3> normals;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    normals.push_back(vec::unit(twice_area_of(mesh.corners(i))));
  }
  std::optional<NarrowPassage> found;
  if (!closed) found = narrowest_opening(mesh, normals, touching_m, reach_m);
  std::vector<std::uint32_t> near;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const FaceTriangle t = mesh.corners(i);
    for (const double sign : {1.0, -1.0}) {
      const double reach = found ? std::min(found->width_m, reach_m) : reach_m;
      const Point3 up = vec::scaled(normals[i], sign);
      vec::Box box = box_of(t);
      for (const Point3& p : t) box.include(vec::add(p, vec::scaled(up, reach)));
      tree.find(box, near);
      for (const std::uint32_t k : near) {
        if (shared_corners(mesh.triangles[i], mesh.triangles[k]) > 0) continue;
        const double turn = vec::dot(normals[i], normals[k]);
        if ((closed ? -turn : std::abs(turn)) < kOpposite) continue;
        const auto over = overhang_of(mesh.corners(k), t, normals[i], up, touching_m);
        if (!over || !(over->height > touching_m) || !(over->height < reach)) continue;
        if (found && over->height >= found->width_m) continue;
        found = {over->height, vec::sub(over->at, vec::scaled(up, 0.5 * over->height)),
                 closed && sign < 0.0};
      }
    }
  }
  return found;
}

}  // namespace haptic::tools
