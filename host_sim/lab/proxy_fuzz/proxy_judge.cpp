// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/proxy_judge.hpp"

#include <algorithm>

#include "tools/graph_compiler/graph/coupling_defaults.hpp"

namespace haptic::sim {

namespace {

constexpr int kLongestClimb = 24;
/// Cross products of edges closer to parallel than this say nothing that faces do not.
constexpr Wide kLeastSine = 1e-12L;

WideVec turned_back(const WideRotation& r, const WideVec& v) {
  return v.x * r.row[0] + v.y * r.row[1] + v.z * r.row[2];
}

/// Farther pairs cannot be the nearest that is looked for.
constexpr Wide kFar_m = 1e-3L;
constexpr Wide kJudgedRadius_m = 0.05L, kTolerance_m = 1e-7L;
constexpr Wide kStep_m = 2e-3L, kMargin_m = 1e-4L, kTurn_rad = 0.02L;  // of a pass
constexpr Wide kMaxPasses = 3;

void multiply(const Wide (&a)[4], const Wide (&b)[4], Wide (&c)[4]) {
  c[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
  c[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
  c[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
  c[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

WideVec widened(const Vec3& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

WideVec at(const WidePose& pose, const WideVec& point) { return pose.p + pose.r * point; }

}  // namespace

FreeWitness::Incidence::Incidence(const OraclePiece& piece)
    : faces(piece.vertices.size()), edges(piece.vertices.size()) {
  for (std::uint32_t f = 0; f < piece.loops.size(); ++f) {
    for (const std::uint32_t v : piece.loops[f]) faces[v].push_back(f);
  }
  for (std::uint32_t e = 0; e < piece.edges.size(); ++e) {
    for (const std::uint32_t v : piece.edges[e].vertex) edges[v].push_back(e);
  }
  for (const WideVec& v : piece.vertices) centre = centre + v;
  centre = (1.0L / static_cast<Wide>(piece.vertices.size())) * centre;
  for (const WideVec& v : piece.vertices) {
    radius_m = std::max(radius_m, norm(v - centre));
    lever_m = std::max(lever_m, norm(v));
  }
}

FreeWitness::FreeWitness(const OraclePiece& a, const OraclePiece& b)
    : a_(a),
      b_(b),
      at_a_(a),
      at_b_(b),
      size_m_(std::max(diameter(a.vertices), diameter(b.vertices))) {}

bool FreeWitness::normal_of(const OraclePose& pose, const Direction& d, WideVec& normal) const {
  switch (d.kind) {
    case Kind::kFaceA:
      normal = -1.0L * (pose.r * a_.normals[d.i]);
      return true;
    case Kind::kFaceB:
      normal = b_.normals[d.j];
      return true;
    case Kind::kEdges:
      break;
  }
  const WideVec u = pose.r * along(a_, d.i), v = along(b_, d.j);
  const WideVec n = cross(u, v);
  const Wide length = norm(n);
  if (!(length > kLeastSine * norm(u) * norm(v))) return false;
  normal = (d.sign / length) * n;
  return true;
}

FreeGap FreeWitness::gap_along(const OraclePose& pose, const WideVec& normal) const {
  FreeGap gap;
  gap.normal_w = normal;
  const WideVec in_a = turned_back(pose.r, normal);
  Wide lowest = std::numeric_limits<Wide>::infinity(), highest = -lowest;
  for (std::uint32_t v = 0; v < a_.vertices.size(); ++v) {
    const Wide height = dot(in_a, a_.vertices[v]);
    if (height < lowest) {
      lowest = height;
      gap.vertex_a = v;
    }
  }
  for (std::uint32_t v = 0; v < b_.vertices.size(); ++v) {
    const Wide height = dot(normal, b_.vertices[v]);
    if (height > highest) {
      highest = height;
      gap.vertex_b = v;
    }
  }
  gap.gap_m = dot(normal, pose.x) + lowest - highest;
  return gap;
}

void FreeWitness::consider(const OraclePose& pose, const Direction& d, Direction& best,
                           FreeGap& gap) const {
  WideVec normal;
  if (!normal_of(pose, d, normal)) return;
  const FreeGap found = gap_along(pose, normal);
  if (!(found.gap_m > gap.gap_m)) return;
  gap = found;
  best = d;
}

/// Goes to the best of the directions whose planes touch both support vertices, while it gains.
void FreeWitness::climb(const OraclePose& pose, Wide wanted_m, Direction& best,
                        FreeGap& gap) const {
  for (int step = 0; step < kLongestClimb && gap.gap_m < wanted_m; ++step) {
    const FreeGap from = gap;
    for (const std::uint32_t f : at_a_.faces[from.vertex_a]) {
      consider(pose, {Kind::kFaceA, f, 0, 1}, best, gap);
    }
    for (const std::uint32_t f : at_b_.faces[from.vertex_b]) {
      consider(pose, {Kind::kFaceB, 0, f, 1}, best, gap);
    }
    for (const std::uint32_t e : at_a_.edges[from.vertex_a]) {
      for (const std::uint32_t g : at_b_.edges[from.vertex_b]) {
        consider(pose, {Kind::kEdges, e, g, 1}, best, gap);
        consider(pose, {Kind::kEdges, e, g, -1}, best, gap);
      }
    }
    if (!(gap.gap_m > from.gap_m)) return;
  }
}

FreeGap FreeWitness::find(const OraclePose& pose, Wide wanted_m) {
  FreeGap gap;
  Direction best = last_;
  consider(pose, last_, best, gap);
  if (gap.gap_m < wanted_m && gap.gap_m > -size_m_) climb(pose, wanted_m, best, gap);
  if (gap.gap_m < wanted_m) {
    for (std::uint32_t f = 0; f < a_.loops.size(); ++f) {
      consider(pose, {Kind::kFaceA, f, 0, 1}, best, gap);
    }
    for (std::uint32_t f = 0; f < b_.loops.size(); ++f) {
      consider(pose, {Kind::kFaceB, 0, f, 1}, best, gap);
    }
    climb(pose, wanted_m, best, gap);
  }
  last_ = best;
  return gap;
}

Wide FreeWitness::exhaustive_m(const OraclePose& pose) const {
  return search_pair(a_, b_, pose, size_m_, precision_of_real()).reference_m;
}

bool FreeWitness::far(const OraclePose& pose, Wide distance_m) const {
  const WideVec between = pose.x + pose.r * at_a_.centre - at_b_.centre;
  return norm(between) - at_a_.radius_m - at_b_.radius_m > distance_m;
}

WidePose wide_pose(const Pose& pose) {
  WidePose wide;
  wide.p = widened(pose.p_wa);
  const Quat& q = pose.q_wa;
  const Wide given[4] = {widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z())};
  Wide length = 0;
  for (const Wide c : given) length += c * c;
  length = std::sqrt(length);
  for (int i = 0; i < 4; ++i) wide.q_wxyz[i] = given[i] / length;
  wide.r = rotation_of(given[0], given[1], given[2], given[3]);
  return wide;
}

WidePose moved_pose(const WidePose& pose, const WideVec& dx, const WideVec& dtheta) {
  WidePose result = pose;
  result.p = pose.p + dx;
  const Wide angle = norm(dtheta);
  if (angle > 0) {
    const Wide s = std::sin(angle / 2) / angle;
    const Wide turn[4] = {std::cos(angle / 2), s * dtheta.x, s * dtheta.y, s * dtheta.z};
    multiply(turn, pose.q_wxyz, result.q_wxyz);
  }
  const Wide* q = result.q_wxyz;
  result.r = rotation_of(q[0], q[1], q[2], q[3]);
  return result;
}

WideError wide_error(const WidePose& goal, const WidePose& proxy) {
  WideError error;
  error.translation_m = goal.p - proxy.p;
  const Wide* q = proxy.q_wxyz;
  const Wide back[4] = {q[0], -q[1], -q[2], -q[3]};
  Wide turn[4];
  multiply(goal.q_wxyz, back, turn);
  const WideVec v = (turn[0] < 0 ? -1.0L : 1.0L) * WideVec{turn[1], turn[2], turn[3]};
  const Wide sine = norm(v);
  if (sine > 0) error.rotation_rad = (2 * std::atan2(sine, std::abs(turn[0])) / sine) * v;
  return error;
}

ProxyJudge::ProxyJudge(const FuzzScene& scene, const SceneView& view) : plate_(scene.plate) {
  pieces_.reserve(view.pieces().size());
  for (std::uint32_t i = 0; i < view.pieces().size(); ++i) {
    pieces_.push_back(oracle_piece_of(view.piece(i)));
  }
  const double* grip = view.bodies()[0].reference_m;
  if (grip[0] != 0 || grip[1] != 0 || grip[2] != 0) throw tools::InputError("grip off the origin");
  const double* start = view.parameters().start_p_wa_m;
  Wide extent = norm(WideVec{widen(start[0]), widen(start[1]), widen(start[2])});
  for (std::uint32_t k = 0; k < view.pair_count(); ++k) {
    const PairRecord pair = view.pair_record(k);
    const OraclePiece& a = pieces_[pair.piece_a];
    const OraclePiece& b = pieces_[pair.piece_b];
    witnesses_.emplace_back(a, b);
    const double* reference = view.bodies()[view.pieces()[pair.piece_b].body].reference_m;
    references_.push_back({widen(reference[0]), widen(reference[1]), widen(reference[2])});
    for (const WideVec& v : a.vertices) radius_m_ = std::max(radius_m_, norm(v));
    for (const WideVec& v : b.vertices)
      extent = std::max(extent, norm(references_.back()) + norm(v));
  }
  const Wide roundoff = widen(std::numeric_limits<Real>::epsilon());
  tolerance_m_ =
      std::max(kTolerance_m * radius_m_ / kJudgedRadius_m, 64.5L * roundoff * (radius_m_ + extent));
  rounding_m_ = 8 * roundoff * (radius_m_ + extent);
  limit_rad_ = widen(tools::kDefaultRotationError_rad);
  if (scene.device) {  // the compiler's choice
    k_t_ = widen(view.parameters().coupling.k_t_n_per_m);
    k_r_ = widen(view.parameters().coupling.k_r_nm_per_rad);
    length_m_ = std::sqrt(k_r_ / k_t_);
    return;
  }
  k_t_ = widen(kFuzzStiffness_n_per_m);
  length_m_ = widen(tools::kDefaultLengthShare) * radius_m_;
  k_r_ = k_t_ * length_m_ * length_m_;
}

OraclePose ProxyJudge::in_frame(const WidePose& pose, std::size_t pair) const {
  return {pose.r, pose.p - references_[pair]};
}

Wide ProxyJudge::free_gap_m(const WidePose& pose, Wide wanted_m) {
  Wide smallest = std::numeric_limits<Wide>::infinity();
  for (std::size_t k = 0; k < witnesses_.size(); ++k) {
    const OraclePose relative = in_frame(pose, k);
    if (witnesses_[k].far(relative, kFar_m)) continue;
    smallest = std::min(smallest, witnesses_[k].find(relative, wanted_m).gap_m);
  }
  return smallest;
}

Wide ProxyJudge::exact_gap_m(const WidePose& pose, Wide wanted_m) {
  Wide smallest = std::numeric_limits<Wide>::infinity();
  for (std::size_t k = 0; k < witnesses_.size(); ++k) {
    const OraclePose relative = in_frame(pose, k);
    if (witnesses_[k].far(relative, kFar_m)) continue;
    Wide gap = witnesses_[k].find(relative, wanted_m).gap_m;
    if (gap < wanted_m) gap = std::max(gap, witnesses_[k].exhaustive_m(relative));
    smallest = std::min(smallest, gap);
  }
  return smallest;
}

Wide ProxyJudge::potential_j(const WideError& error) const {
  const Wide turn = norm(error.rotation_rad);
  const Wide turned_j =
      turn > limit_rad_ ? k_r_ * limit_rad_ * (turn - limit_rad_ / 2) : k_r_ * turn * turn / 2;
  return k_t_ * dot(error.translation_m, error.translation_m) / 2 + turned_j;
}

Wide ProxyJudge::wrench_error(const Wrench& wrench, bool held, const WidePose& goal,
                              const WidePose& proxy) const {
  const WideError error = wide_error(goal, proxy);
  const Wide roundoff = widen(std::numeric_limits<Real>::epsilon());
  // Of -pull, what is felt, or its part along it that is not longer.
  const auto missed = [held](const WideVec& felt, const WideVec& pull) {
    if (!held || !(dot(pull, pull) > 0)) return felt + pull;
    const Wide shorter = std::clamp(-dot(felt, pull) / dot(pull, pull), Wide{0}, Wide{1});
    return felt + shorter * pull;
  };
  const WideVec force = missed(widened(wrench.force_w), k_t_ * error.translation_m);
  const Wide turn = norm(error.rotation_rad);
  const Wide share = turn > limit_rad_ ? limit_rad_ / turn : 1;
  const WideVec torque = missed(widened(wrench.torque_w), (k_r_ * share) * error.rotation_rad);
  // Positions and quaternions are differences of rounded numbers; k_r is a number of the scene.
  const Wide of_force = 4 * roundoff * k_t_ * (norm(goal.p) + norm(proxy.p));
  const Wide of_torque = 32 * roundoff * k_r_ * (1 + norm(error.rotation_rad));
  return std::max(norm(force) / of_force, norm(torque) / of_torque);
}

bool ProxyJudge::crossed(const WidePose& before, const WidePose& after) const {
  if (!plate_) return false;
  const Wide share = radius_m_ / kJudgedRadius_m;
  const Wide rim = kMaxPasses * ((kStep_m + kMargin_m) * share + kTurn_rad * radius_m_);
  const auto goes_through = [&](const WideVec& point) {
    const WideVec from = at(before, point), to = at(after, point);
    if (from.z * to.z > 0 || from.z == to.z) return false;
    const Wide t = from.z / (from.z - to.z);
    const Wide x = from.x + t * (to.x - from.x), y = from.y + t * (to.y - from.y);
    return std::abs(x) < widen(plate_->half_x_m) - rim &&
           std::abs(y) < widen(plate_->half_y_m) - rim;
  };
  const std::vector<WideVec>& vertices = pieces_.front().vertices;
  return goes_through({0, 0, 0}) || std::ranges::any_of(vertices, goes_through);
}

Wide ProxyJudge::unhindered_j(const WidePose& goal, const WidePose& proxy) {
  constexpr Wide kMove_m = 1e-4L;
  const Wide far = kMove_m * radius_m_ / kJudgedRadius_m;
  if (!(free_gap_m(proxy, 2 * far) >= 2 * far)) return std::numeric_limits<Wide>::infinity();
  const WideError error = wide_error(goal, proxy);
  const Wide length = norm(error.translation_m) + radius_m_ * norm(error.rotation_rad);
  if (!(length > far)) return std::numeric_limits<Wide>::infinity();
  const Wide s = far / length;
  return potential_j(
      wide_error(goal, moved_pose(proxy, s * error.translation_m, s * error.rotation_rad)));
}

bool ProxyJudge::moves(const WidePose& before, const WidePose& after) const {
  constexpr Wide kLeast_m = 1e-5L;
  const WideError way = wide_error(after, before);
  return norm(way.translation_m) + radius_m_ * norm(way.rotation_rad) >
         kLeast_m * radius_m_ / kJudgedRadius_m;
}

/// What touches at the proxy: along each near pair's direction of largest known gap, the vertices
/// in contact, of both pieces.
void ProxyJudge::touching_rows(const WidePose& proxy, std::vector<Row>& rows) {
  const Wide height = 50 * tolerance_m_;
  for (std::size_t k = 0; k < witnesses_.size(); ++k) {
    const OraclePose relative = in_frame(proxy, k);
    if (witnesses_[k].far(relative, kFar_m)) continue;
    const FreeGap gap = witnesses_[k].find(relative, 2 * height);
    if (gap.gap_m > height) continue;
    const WideVec& n = gap.normal_w;
    const OraclePiece& a = witnesses_[k].piece_a();
    const OraclePiece& b = witnesses_[k].piece_b();
    const WideVec low = proxy.r * a.vertices[gap.vertex_a];
    const WideVec high = b.vertices[gap.vertex_b];
    for (const WideVec& v : a.vertices) {
      const WideVec arm = proxy.r * v;
      if (dot(n, arm - low) < height) rows.push_back({n, cross(arm, n), arm});
    }
    for (const WideVec& v : b.vertices) {
      if (dot(n, high - v) > height) continue;
      const WideVec arm = v - relative.x;
      rows.push_back({n, cross(arm, n), arm});
    }
  }
}

/// Changes a move until no row falls, by projections in turn.
void ProxyJudge::push_out(const std::vector<Row>& rows, WideVec& dx, WideVec& dtheta) const {
  constexpr int kSweeps = 200;
  const Wide per_turn = 1 / (length_m_ * length_m_);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    bool inside = true;
    for (const Row& row : rows) {
      const Wide fall = -(dot(row.n, dx) + dot(row.moment, dtheta));
      if (fall <= 0) continue;
      inside = inside && fall < 1e-3L * (norm(dx) + length_m_ * norm(dtheta));
      const Wide s = fall / (dot(row.n, row.n) + per_turn * dot(row.moment, row.moment));
      dx = dx + s * row.n;
      dtheta = dtheta + (s * per_turn) * row.moment;
    }
    if (inside) return;
  }
}

bool ProxyJudge::lowers(const WidePose& goal, const WidePose& proxy, const WideVec& dx,
                        const WideVec& dtheta, Wide start_j, Wide least_j) {
  const WidePose next = moved_pose(proxy, dx, dtheta);
  if (potential_j(wide_error(goal, next)) > start_j - least_j) return false;
  // Where it is not sunk in deeper than before: a gain must not come from the tolerance.
  const Wide wanted = -tolerance_m_ / 2;
  return free_gap_m(next, wanted) >= wanted;
}

bool ProxyJudge::could_follow(const WidePose& goal, const WidePose& proxy) {
  constexpr int kRandomMoves = 24;
  const WideError error = wide_error(goal, proxy);
  const Wide start_j = potential_j(error);
  const Wide turn = std::min(norm(error.rotation_rad), limit_rad_);
  const Wide pull = k_t_ * (norm(error.translation_m) + length_m_ * turn);
  const Wide least_j = 10 * tolerance_m_ * pull;
  std::vector<Row> rows;
  touching_rows(proxy, rows);
  Seeded random(17);
  for (int k = 0; k < 3 + kRandomMoves; ++k) {
    WideVec dx = error.translation_m, dtheta = error.rotation_rad;
    if (k == 1) dtheta = {};
    if (k == 2) dx = {};
    if (k >= 3) {
      const Vector d = random.direction(), t = random.direction();
      const Wide size = pull / k_t_;
      dx = dx + size * WideVec{widen(d[0]), widen(d[1]), widen(d[2])};
      dtheta = dtheta + (size / length_m_) * WideVec{widen(t[0]), widen(t[1]), widen(t[2])};
    }
    push_out(rows, dx, dtheta);
    const Wide length = norm(dx) + length_m_ * norm(dtheta);
    if (!(length > 0)) continue;
    for (const Wide steps : {1000.0L, 200.0L, 50.0L}) {  // 0.1 mm, 20 um, 5 um
      const Wide s = std::min(steps * tolerance_m_ / length, 1.0L);
      if (lowers(goal, proxy, s * dx, s * dtheta, start_j, least_j)) return true;
    }
  }
  return false;
}

}  // namespace haptic::sim
