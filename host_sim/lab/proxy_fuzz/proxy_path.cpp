// SPDX-License-Identifier: Apache-2.0
// The gap on the way between two configurations, and what contact forces leave of a pull.
#include <Eigen/QR>
#include <algorithm>

#include "host_sim/lab/proxy_fuzz/proxy_judge.hpp"

namespace haptic::sim {
namespace {

constexpr int kMostHalvings = 22;
/// A way that is found too deep is cut no finer than this: it fails already.
constexpr int kHalvingsOfDeep = 9;

using WideColumn = Eigen::Matrix<Wide, 6, 1>;
using WideColumns = Eigen::Matrix<Wide, 6, Eigen::Dynamic>;

/// Smallest |pull + columns x| over x >= 0 (Lawson and Hanson, Solving Least Squares Problems,
/// 1974, chapter 23).
Wide smallest_remainder(const WideColumns& columns, const WideColumn& pull) {
  const Eigen::Index count = columns.cols();
  std::vector<Eigen::Index> in;
  Eigen::Matrix<Wide, Eigen::Dynamic, 1> x =
      Eigen::Matrix<Wide, Eigen::Dynamic, 1>::Zero(std::max<Eigen::Index>(count, 1));
  WideColumn rest = pull;
  std::vector<bool> refused(static_cast<std::size_t>(count), false);
  const auto solve = [&] {
    WideColumns chosen(6, static_cast<Eigen::Index>(in.size()));
    for (std::size_t k = 0; k < in.size(); ++k) {
      chosen.col(static_cast<Eigen::Index>(k)) = columns.col(in[k]);
    }
    return Eigen::Matrix<Wide, Eigen::Dynamic, 1>(chosen.colPivHouseholderQr().solve(-pull));
  };
  for (Eigen::Index turn = 0; turn < 20 * count + 100; ++turn) {
    Eigen::Index best = -1;
    Wide most = 1e-13L * pull.norm();
    for (Eigen::Index k = 0; k < count; ++k) {
      if (refused[static_cast<std::size_t>(k)] || std::ranges::find(in, k) != in.end()) continue;
      const Wide gain = -columns.col(k).dot(rest) / columns.col(k).norm();
      if (gain > most) {
        most = gain;
        best = k;
      }
    }
    if (best < 0) break;
    in.push_back(best);
    Eigen::Matrix<Wide, Eigen::Dynamic, 1> z = solve();
    if (!(z[static_cast<Eigen::Index>(in.size()) - 1] > 0)) {
      in.pop_back();
      refused[static_cast<std::size_t>(best)] = true;
      continue;
    }
    while (z.size() > 0 && z.minCoeff() <= 0) {
      Wide step = 1;
      for (std::size_t k = 0; k < in.size(); ++k) {
        const Wide to = z[static_cast<Eigen::Index>(k)];
        if (to <= 0) step = std::min(step, x[in[k]] / (x[in[k]] - to));
      }
      std::vector<Eigen::Index> kept;
      for (std::size_t k = 0; k < in.size(); ++k) {
        Wide& value = x[in[k]];
        const Wide to = z[static_cast<Eigen::Index>(k)];
        value += step * (to - value);
        if (to <= 0 && value <= 1e-15L * (1 + std::abs(to))) {
          value = 0;
        } else {
          kept.push_back(in[k]);
        }
      }
      if (kept.size() == in.size()) kept.pop_back();
      in = std::move(kept);
      z = solve();
    }
    x.setZero();
    for (std::size_t k = 0; k < in.size(); ++k) x[in[k]] = z[static_cast<Eigen::Index>(k)];
    const WideColumn before = rest;
    rest = pull + columns * x.head(count);
    if (rest.norm() < before.norm()) std::fill(refused.begin(), refused.end(), false);
  }
  return rest.norm();
}

/// Whether the foot of `point` lies in the polygon, by `slack`.
bool over_face(const WideVec& point, const std::vector<WideVec>& vertices,
               const std::vector<std::uint32_t>& loop, const WideVec& normal, Wide slack) {
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const WideVec& from = vertices[loop[k]];
    const WideVec side = vertices[loop[(k + 1) % loop.size()]] - from;
    const WideVec inwards = cross(normal, side);
    if (dot(inwards, point - from) < -slack * norm(inwards)) return false;
  }
  return true;
}

}  // namespace

PairPath::PairPath(const WidePose& from_pose, const WidePose& to_pose, const WideVec& reference)
    : from(from_pose), to(to_pose), reference_w(reference) {
  const WideError error = wide_error(to, from);
  move_m = error.translation_m;
  turn_rad = error.rotation_rad;
}

OraclePose PairPath::at(Wide share) const {
  if (share <= 0) return {from.r, from.p - reference_w};
  if (share >= 1) return {to.r, to.p - reference_w};
  const WidePose between = moved_pose(from, share * move_m, share * turn_rad);
  return {between.r, between.p - reference_w};
}

FreeWitness::Sample FreeWitness::sampled(const PairPath& path, Wide at, Wide wanted_m) {
  Sample sample;
  sample.at = at;
  sample.pose = path.at(at);
  sample.gap_m = find(sample.pose, wanted_m).gap_m;
  if (sample.gap_m < wanted_m) {
    sample.gap_m = std::max(sample.gap_m, exhaustive_m(sample.pose));
  }
  sample.direction = last_;
  return sample;
}

/// A point that moves along psi deviates from its chord by at most max |psi''| / 8. Per face of B:
/// psi = n . (x + R a). Per face of A, seen from A: n . R^T (b - x). Per pair of edges: (R u x v) .
/// (x + R a - b), which is the gap times the sine of their angle.
bool FreeWitness::proven(const PairPath& path, const Sample& from, const Sample& to,
                         const Direction& d, Wide wanted_m) const {
  const Wide part = to.at - from.at;
  const Wide turn = part * norm(path.turn_rad), move = part * norm(path.move_m);
  const Wide lever_a = at_a_.lever_m, lever_b = at_b_.lever_m;
  WideVec n0, n1;
  if (!normal_of(from.pose, d, n0) || !normal_of(to.pose, d, n1)) return false;
  const Wide gap0 = gap_along(from.pose, n0).gap_m, gap1 = gap_along(to.pose, n1).gap_m;
  const Wide between = norm(from.pose.x) + move + lever_b;  // |b - x|
  if (d.kind == Kind::kFaceB) return std::min(gap0, gap1) - turn * turn * lever_a / 8 >= wanted_m;
  if (d.kind == Kind::kFaceA) {
    return std::min(gap0, gap1) - turn * (turn * between + 2 * move) / 8 >= wanted_m;
  }
  const WideVec v = along(b_, d.j), u = along(a_, d.i);
  const Wide lengths = norm(u) * norm(v);
  const Wide sine0 = norm(cross(from.pose.r * u, v)) / lengths;
  const Wide sine1 = norm(cross(to.pose.r * u, v)) / lengths;
  const Wide least_sine = std::max(sine0, sine1) - turn;
  if (!(least_sine > 0)) return false;
  const Wide bend = turn * turn * (between + lever_a) + 2 * turn * (move + turn * lever_a) +
                    turn * turn * lever_a;
  const Wide lowest = std::min(gap0 * sine0, gap1 * sine1) - bend / 8;
  return lowest >= 0 || lowest >= wanted_m * least_sine;
}

Wide FreeWitness::path_m(const PairPath& path, Wide wanted_m, Wide resolution_m) {
  const Wide speed = norm(path.move_m) + at_a_.lever_m * norm(path.turn_rad);
  Sample from = sampled(path, 0, wanted_m);
  Wide smallest = from.gap_m;
  if (from.gap_m - speed >= wanted_m) return smallest;
  struct Part {
    Sample from, to;
    int halvings;
  };
  std::vector<Part> parts;
  Sample to = sampled(path, 1, wanted_m);
  smallest = std::min(smallest, to.gap_m);
  parts.push_back({std::move(from), std::move(to), 0});
  while (!parts.empty()) {
    const Part part = std::move(parts.back());
    parts.pop_back();
    const Wide length = speed * (part.to.at - part.from.at);
    if ((part.from.gap_m + part.to.gap_m - length) / 2 >= wanted_m) continue;
    if (length <= resolution_m || part.halvings >= kMostHalvings) continue;
    if (smallest < wanted_m && part.halvings >= kHalvingsOfDeep) continue;
    if (proven(path, part.from, part.to, part.from.direction, wanted_m) ||
        proven(path, part.from, part.to, part.to.direction, wanted_m)) {
      continue;
    }
    Sample middle = sampled(path, (part.from.at + part.to.at) / 2, wanted_m);
    smallest = std::min(smallest, middle.gap_m);
    parts.push_back({middle, part.to, part.halvings + 1});
    parts.push_back({part.from, std::move(middle), part.halvings + 1});
  }
  return smallest;
}

Wide ProxyJudge::path_gap_m(const WidePose& before, const WidePose& after) {
  const Wide wanted = -allowed_depth_m(), resolution = tolerance_m_ / 50;
  Wide smallest = std::numeric_limits<Wide>::infinity();
  for (std::size_t k = 0; k < witnesses_.size(); ++k) {
    const PairPath path(before, after, references_[k]);
    const Wide way = norm(path.move_m) + radius_m_ * norm(path.turn_rad);
    if (witnesses_[k].far(path.at(0), way + tolerance_m_)) continue;
    smallest = std::min(smallest, witnesses_[k].path_m(path, wanted, resolution));
  }
  return smallest;
}

/// The touching pairs of features of one pair of pieces: vertex on face, face on vertex, edge on
/// edge; a force at each along every direction whose plane keeps the pieces apart and touches both
/// there.
void ProxyJudge::feature_rows(const WidePose& proxy, std::size_t pair,
                              std::vector<Row>& rows) const {
  const Wide height = 2 * tolerance_m_, slack = 10 * tolerance_m_;
  const FreeWitness& witness = witnesses_[pair];
  const OraclePiece &a = witness.piece_a(), &b = witness.piece_b();
  const OraclePose pose = in_frame(proxy, pair);
  std::vector<WideVec> va;
  for (const WideVec& v : a.vertices) va.push_back(pose.x + proxy.r * v);
  std::vector<WideVec> normals, points;
  const auto note_direction = [&](const WideVec& n) {
    if (witness.gap_m(pose, n) >= -height) normals.push_back(n);
  };
  for (std::size_t f = 0; f < b.loops.size(); ++f) {
    const WideVec& n = b.normals[f];
    note_direction(n);
    for (const WideVec& v : va) {
      if (std::abs(dot(n, v - b.vertices[b.loops[f][0]])) > height) continue;
      if (over_face(v, b.vertices, b.loops[f], n, slack)) points.push_back(v);
    }
  }
  for (std::size_t f = 0; f < a.loops.size(); ++f) {
    const WideVec outward = proxy.r * a.normals[f];
    note_direction(-1.0L * outward);
    for (const WideVec& v : b.vertices) {
      if (std::abs(dot(outward, va[a.loops[f][0]] - v)) > height) continue;
      if (over_face(v, va, a.loops[f], outward, slack)) points.push_back(v);
    }
  }
  for (const OracleEdge& e : a.edges) {
    const WideVec p = va[e.vertex[0]], u = va[e.vertex[1]] - p;
    for (const OracleEdge& g : b.edges) {
      const WideVec q = b.vertices[g.vertex[0]], v = b.vertices[g.vertex[1]] - q;
      const WideVec c = cross(u, v);
      const Wide square = dot(c, c);
      if (!(square > 1e-16L * dot(u, u) * dot(v, v))) continue;
      const WideVec n = (1 / std::sqrt(square)) * c, between = q - p;
      if (std::abs(dot(n, between)) > height) continue;
      const Wide s = dot(cross(between, v), c) / square, t = dot(cross(between, u), c) / square;
      const Wide of_s = slack / norm(u), of_t = slack / norm(v);
      if (s < -of_s || s > 1 + of_s || t < -of_t || t > 1 + of_t) continue;
      note_direction(n);
      note_direction(-1.0L * n);
      points.push_back(q + t * v);
    }
  }
  for (const WideVec& n : normals) {
    Wide lowest_a = std::numeric_limits<Wide>::infinity(), highest_b = -lowest_a;
    for (const WideVec& v : va) lowest_a = std::min(lowest_a, dot(n, v));
    for (const WideVec& v : b.vertices) highest_b = std::max(highest_b, dot(n, v));
    for (const WideVec& point : points) {
      const Wide at = dot(n, point);
      if (at - lowest_a > height || highest_b - at > height) continue;
      const WideVec arm = point - pose.x;
      rows.push_back({n, cross(arm, n), arm});
    }
  }
}

Wide ProxyJudge::residual_n(const WidePose& goal, const WidePose& proxy, Wide friction) {
  constexpr int kDirections = 16;
  constexpr Wide kHalfTurn = 3.14159265358979323846L;
  // Polygon round the circle of friction: no force that the circle holds is missing.
  const Wide wide_friction = friction / std::cos(kHalfTurn / kDirections);
  std::vector<Row> rows;
  for (std::size_t k = 0; k < witnesses_.size(); ++k) {
    const OraclePose relative = in_frame(proxy, k);
    if (witnesses_[k].far(relative, 10 * tolerance_m_)) continue;
    if (witnesses_[k].find(relative, 3 * tolerance_m_).gap_m > 2 * tolerance_m_) continue;
    feature_rows(proxy, k, rows);
  }
  const int per_row = friction > 0 ? kDirections : 1;
  WideColumns columns(6, static_cast<Eigen::Index>(rows.size()) * per_row);
  const auto column = [&](const WideVec& force, const WideVec& torque) {
    const Wide s = 1 / length_m_;
    WideColumn c;
    c << force.x, force.y, force.z, s * torque.x, s * torque.y, s * torque.z;
    return c;
  };
  Eigen::Index next = 0;
  for (const Row& row : rows) {
    if (!(friction > 0)) {
      columns.col(next++) = column(row.n, row.moment);
      continue;
    }
    const WideVec arm = row.arm;
    const WideVec other = std::abs(row.n.x) < 0.6L ? WideVec{1, 0, 0} : WideVec{0, 1, 0};
    const WideVec t = unit(cross(row.n, other)), s = cross(row.n, t);
    for (int k = 0; k < kDirections; ++k) {
      const Wide angle = 2 * kHalfTurn * k / kDirections;
      const WideVec force =
          row.n + (wide_friction * std::cos(angle)) * t + (wide_friction * std::sin(angle)) * s;
      columns.col(next++) = column(force, cross(arm, force));
    }
  }
  const WideError error = wide_error(goal, proxy);
  const Wide turn = norm(error.rotation_rad);
  const Wide share = turn > limit_rad_ ? limit_rad_ / turn : 1;
  return smallest_remainder(
      columns, column(k_t_ * error.translation_m, (k_r_ * share) * error.rotation_rad));
}

}  // namespace haptic::sim
