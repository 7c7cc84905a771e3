// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/contact_workload.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host_sim/oracle/oracle_piece.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kTick_s = 1e-3;
constexpr double kCubicPeak = 1.5;      // largest speed of the cubic over its mean
constexpr double kWantedShare = 0.29;   // of the poses in contact
constexpr std::size_t kLookEvery = 10;  // poses
constexpr double kLimitShare = 0.98;    // of the limits, for what rounding to Real adds

/// A feature of a body: a direction out of it and a point of it.
struct Feature {
  Vector direction, point;
};

/// Features of a body, to draw from.
class FeatureTable {
 public:
  explicit FeatureTable(const Solid& solid) : solid_(solid) {
    std::vector<WideVec> wide;
    for (const Vector& v : solid.vertices) wide.push_back({widen(v[0]), widen(v[1]), widen(v[2])});
    piece_ = make_oracle_piece(std::move(wide), solid.loops);
    for (const Vector& v : solid.vertices)
      middle_ += v / static_cast<double>(solid.vertices.size());
  }

  [[nodiscard]] Feature face(Seeded& random) const {
    const std::uint32_t f = random.below(count(piece_.loops));
    Vector point = Vector::Zero();
    for (const std::uint32_t v : solid_.loops[f])
      point += solid_.vertices[v] / static_cast<double>(solid_.loops[f].size());
    return {normal(f), point};
  }
  [[nodiscard]] Feature edge(Seeded& random) const {
    const OracleEdge& e = piece_.edges[random.below(count(piece_.edges))];
    const Vector &v0 = solid_.vertices[e.vertex[0]], &v1 = solid_.vertices[e.vertex[1]];
    const double share = random.uniform(0.3, 0.7);
    return {(normal(e.face[0]) + normal(e.face[1])).normalized(), v0 + share * (v1 - v0)};
  }
  [[nodiscard]] Feature vertex(Seeded& random) const {
    const std::uint32_t v = random.below(count(solid_.vertices));
    Vector sum = Vector::Zero();
    for (std::uint32_t f = 0; f < count(piece_.loops); ++f) {
      const auto& loop = solid_.loops[f];
      if (std::find(loop.begin(), loop.end(), v) != loop.end()) sum += normal(f);
    }
    return {sum.normalized(), solid_.vertices[v]};
  }
  [[nodiscard]] Feature anything(Seeded& random) const { return {random.direction(), middle_}; }
  [[nodiscard]] const Solid& solid() const { return solid_; }
  [[nodiscard]] std::uint32_t face_count() const { return count(piece_.loops); }
  [[nodiscard]] Vector normal(std::uint32_t f) const {
    const WideVec& n = piece_.normals[f];
    return {static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z)};
  }

 private:
  template <typename List>
  static std::uint32_t count(const List& list) {
    return static_cast<std::uint32_t>(list.size());
  }

  const Solid& solid_;
  OraclePiece piece_;
  Vector middle_ = Vector::Zero();
};

/// The motion that brings A's feature over B's: the turn of A and the distances.
struct KeyPlan {
  Feature a, b;
  double twist_rad = 0, tilt_rad = 0;
  Vector tilt_axis = Vector::UnitX();
  Vector slide = Vector::Zero();  ///< across B's direction [m]
  double gap_m = 0;               ///< s(n) along B's direction
};

Vector across(const Vector& n, const Vector& v) { return v - n * n.dot(v); }

/// s(n) = min over A of n.a - max over B of n.b.
double gap_along(const Vector& n, const WorkloadPose& pose, const Solid& a, const Solid& b) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vector& v : a.vertices) low = std::min(low, n.dot(pose.q_wa * v));
  for (const Vector& v : b.vertices) high = std::max(high, n.dot(v));
  return low + n.dot(pose.p_wa) - high;
}

WorkloadPose pose_of(const KeyPlan& plan, const Solid& a, const Solid& b) {
  const Vector& n = plan.b.direction;
  Rotation q = turn_between(plan.a.direction, -n);
  q = Rotation(Eigen::AngleAxisd(plan.twist_rad, n)) * q;
  const Vector axis = across(n, plan.tilt_axis).normalized();
  q = (Rotation(Eigen::AngleAxisd(plan.tilt_rad, axis)) * q).normalized();
  WorkloadPose pose{across(n, plan.b.point - q * plan.a.point + plan.slide), q};
  pose.p_wa += n * (plan.gap_m - gap_along(n, pose, a, b));
  return pose;
}

Pose real_pose(const Vector& p, const Rotation& q) { return pose_at(p, q.normalized()); }

/// How many poses so far were looked at, and how many of them are in contact.
struct ContactShare {
  std::size_t poses = 0, inside = 0;

  [[nodiscard]] bool short_of(double share) const {
    return static_cast<double>(inside) < share * static_cast<double>(poses);
  }
};

/// Draws the key poses of one recording.
class KeySequence {
 public:
  KeySequence(WorkloadKind kind, const FeatureTable& a, const FeatureTable& b, Seeded& random)
      : kind_(kind), a_(a), b_(b), random_(random) {
    choose_features();
  }

  [[nodiscard]] WorkloadPose first() {
    plan_.gap_m = kind_ == WorkloadKind::kFreeFlight ? random_.uniform(0.008, 0.045)
                                                     : random_.uniform(0.002, 0.012);
    plan_.slide = slide(0.003);
    return place();
  }
  /// More often down than up while fewer poses than wanted are in contact.
  [[nodiscard]] WorkloadPose next(const ContactShare& share) {
    const bool down = random_.uniform(0, 1) < (share.short_of(kWantedShare) ? 0.95 : 0.2);
    switch (kind_) {
      case WorkloadKind::kFreeFlight:
        plan_.gap_m = random_.uniform(0.008, 0.045);
        plan_.slide = slide(0.02);
        plan_.twist_rad += random_.uniform(-0.4, 0.4);
        break;
      case WorkloadKind::kDeep:
        plan_.gap_m = down ? random_.uniform(-0.012, -0.005) : random_.uniform(0.001, 0.008);
        plan_.slide = slide(0.004);
        plan_.tilt_rad += random_.uniform(-0.1, 0.1);
        break;
      case WorkloadKind::kGrazing:
        plan_.gap_m = down ? random_.uniform(-20e-6, 20e-6) : random_.uniform(0.0005, 0.004);
        plan_.slide = slide(0.012);
        plan_.twist_rad += random_.uniform(-0.1, 0.1);
        break;
      default:
        press(down);
    }
    return place();
  }
  /// True if neither the direction of the contact nor a face of either body separates them: all but
  /// the edge pairs, enough for a share.
  [[nodiscard]] bool seems_inside(const WorkloadPose& pose) const {
    const auto parts = [&](const Vector& n) {
      return gap_along(n, pose, a_.solid(), b_.solid()) > 0;
    };
    if (parts(plan_.b.direction)) return false;
    for (std::uint32_t f = 0; f < b_.face_count(); ++f) {
      if (parts(b_.normal(f))) return false;
    }
    for (std::uint32_t f = 0; f < a_.face_count(); ++f) {
      if (parts(-(pose.q_wa * a_.normal(f)))) return false;
    }
    return true;
  }

 private:
  [[nodiscard]] WorkloadPose place() const { return pose_of(plan_, a_.solid(), b_.solid()); }

  void press(bool down) {
    if (down) {
      plan_.gap_m = -log_uniform(20e-6, 0.0035);
    } else {
      const bool away = random_.below(2) == 1;
      plan_.gap_m = away ? random_.uniform(0.003, 0.010) : random_.uniform(0.0002, 0.004);
    }
    plan_.slide = slide(0.005);
    plan_.twist_rad += random_.uniform(-0.15, 0.15);
    if (micro_tilt_) {
      plan_.tilt_rad = log_uniform(1e-9, 1e-3);
      plan_.tilt_axis = random_.direction();
    }
  }

  void choose_features() {
    plan_.twist_rad = random_.uniform(0, 2 * std::numbers::pi);
    plan_.tilt_axis = random_.direction();
    const bool swapped = random_.below(2) == 1;
    switch (kind_) {
      case WorkloadKind::kFreeFlight:
        plan_.a = a_.anything(random_), plan_.b = b_.anything(random_);
        return;
      case WorkloadKind::kVertexFace:
      case WorkloadKind::kGrazing:
        plan_.a = swapped ? a_.face(random_) : a_.vertex(random_);
        plan_.b = swapped ? b_.vertex(random_) : b_.face(random_);
        plan_.tilt_rad = random_.uniform(0.02, 0.2);
        return;
      case WorkloadKind::kDeep:
        plan_.a = swapped ? a_.face(random_) : a_.vertex(random_);
        plan_.b = b_.face(random_);
        plan_.tilt_rad = random_.uniform(0.02, 0.3);
        return;
      case WorkloadKind::kEdgeEdge:
        plan_.a = a_.edge(random_), plan_.b = b_.edge(random_);
        plan_.tilt_rad = random_.uniform(0, 0.05);
        return;
      case WorkloadKind::kFaceFace:
        plan_.a = a_.face(random_), plan_.b = b_.face(random_);
        break;
      case WorkloadKind::kEdgeFace:
        plan_.a = a_.edge(random_), plan_.b = b_.face(random_);
        break;
      case WorkloadKind::kFaceEdge:
        plan_.a = a_.face(random_), plan_.b = b_.edge(random_);
        break;
    }
    micro_tilt_ = true;
    plan_.tilt_rad = log_uniform(1e-9, 1e-3);
  }

  [[nodiscard]] double log_uniform(double low, double high) {
    return low * std::exp(random_.uniform(0, std::log(high / low)));
  }
  [[nodiscard]] Vector slide(double reach_m) {
    return reach_m * random_.uniform(0, 1) * random_.direction();
  }

  WorkloadKind kind_;
  const FeatureTable &a_, &b_;
  Seeded& random_;
  KeyPlan plan_;
  bool micro_tilt_ = false;
};

/// Ticks from one key pose to the next at the speed limits, times `slowness`.
std::size_t ticks_between(const WorkloadPose& from, const WorkloadPose& to, double slowness) {
  const double length_m = (to.p_wa - from.p_wa).norm();
  const double angle_rad = from.q_wa.angularDistance(to.q_wa);
  const double least_s =
      kCubicPeak / kLimitShare *
      std::max(length_m / kWorkloadSpeed_m_per_s, angle_rad / kWorkloadTurn_rad_per_s);
  return static_cast<std::size_t>(std::ceil(slowness * least_s / kTick_s)) + 2;
}

void record(KeySequence& keys, std::size_t length, Seeded& random, ContactShare& share,
            std::vector<WorkloadPose>& poses) {
  const std::size_t end = poses.size() + length;
  WorkloadPose from = keys.first();
  while (poses.size() < end) {
    const WorkloadPose to = keys.next(share);
    const std::size_t ticks = ticks_between(from, to, random.uniform(1.0, 2.5));
    for (std::size_t k = 0; k < ticks && poses.size() < end; ++k) {
      const double t = static_cast<double>(k) / static_cast<double>(ticks);
      const double s = t * t * (3 - 2 * t);
      const Pose pose =
          real_pose(from.p_wa + s * (to.p_wa - from.p_wa), from.q_wa.slerp(s, to.q_wa));
      poses.push_back({pose.p_wa.cast<double>(), pose.q_wa.cast<double>()});
      if (poses.size() % kLookEvery != 0) continue;
      ++share.poses;
      share.inside += keys.seems_inside(poses.back()) ? 1u : 0u;
    }
    from = to;
  }
}

}  // namespace

const char* to_text(WorkloadKind kind) {
  constexpr const char* kNames[kWorkloadKinds] = {"free flight", "vertex-face", "face-face",
                                                  "edge-face",   "deep",        "edge-edge",
                                                  "grazing",     "face-edge"};
  return kNames[static_cast<std::size_t>(kind)];
}

ContactWorkload contact_workload(const Solid& a, const Solid& b, std::size_t pose_count,
                                 std::uint64_t seed) {
  if (pose_count < kWorkloadKinds)
    throw tools::InputError("a workload needs at least " + std::to_string(kWorkloadKinds) +
                            " poses, one of each kind");
  constexpr std::size_t kWantedLength = 500;
  const std::size_t rounds =
      std::max<std::size_t>(1, pose_count / (kWantedLength * kWorkloadKinds));
  const std::size_t count = rounds * kWorkloadKinds;
  const FeatureTable features_a(a), features_b(b);
  Seeded random(seed);
  ContactShare share;
  ContactWorkload workload;
  for (std::size_t k = 0; k < count; ++k) {
    Recording recording;
    recording.kind = static_cast<WorkloadKind>(k % kWorkloadKinds);
    recording.begin = workload.poses.size();
    recording.end = pose_count * (k + 1) / count;
    KeySequence keys(recording.kind, features_a, features_b, random);
    record(keys, recording.end - recording.begin, random, share, workload.poses);
    workload.recordings.push_back(recording);
  }
  return workload;
}

}  // namespace haptic::sim
