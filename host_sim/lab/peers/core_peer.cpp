// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/core_peer.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/lab/peers/pair_tables.hpp"
#include "host_sim/oracle/literal_tracker.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/tracking/near_set.hpp"
#include "rt_core/tracking/pair_gate.hpp"
#include "rt_core/tracking/pair_verdict.hpp"

namespace haptic::sim {

namespace {

// The core's geometric query of one pair without law and wrench: gate, nearest C-faces, verdict.
// Made of the same functions of rt_core/contact in the order of HapticCore::step, for timing them
// alone.

class GeometricQuery {
 public:
  /// Pair 0 of `scene`, which must outlive the search.
  explicit GeometricQuery(const SceneView& scene);
  GeometricQuery(const GeometricQuery&) = delete;
  GeometricQuery& operator=(const GeometricQuery&) = delete;

  /// One query. Returns D_near, or the gap to a far body [m].
  Real query(const Pose& pose_wa);
  void reset();

 private:
  void advance(const Vec3& x0_w, const Quat& q_wa);

  PairView pair_;
  Vec3 grip_a_, reference_w_;
  Real epsilon_m_;
  double exact_band_m_;
  PairTables tables_;
  VerdictMemory verdict_;
  GatePlane gate_;
  Odometer odometer_;
  Vec3 last_x0_w_ = Vec3::Zero();
  Quat last_q_wa_ = Quat::Identity();
  bool has_last_ = false;
};

GeometricQuery::GeometricQuery(const SceneView& scene)
    : pair_(scene.pair(0)),
      grip_a_(reference_of(scene.bodies()[0])),
      reference_w_(reference_of(scene.bodies()[pair_.b.record->body])),
      epsilon_m_(static_cast<Real>(scene.parameters().epsilon_m)),
      exact_band_m_(scene.parameters().exact_band_m),
      tables_(pair_) {
  reset();
}

void GeometricQuery::reset() {
  tables_.bounds.reset(pair_.marks);
  verdict_ = VerdictMemory{};
  gate_ = GatePlane{};
  odometer_ = Odometer{};
  has_last_ = false;
}

void GeometricQuery::advance(const Vec3& x0_w, const Quat& q_wa) {
  if (has_last_) {
    const double step = static_cast<double>((x0_w - last_x0_w_).norm());
    const Real minus = (q_wa.coeffs() - last_q_wa_.coeffs()).squaredNorm();
    const Real plus = (q_wa.coeffs() + last_q_wa_.coeffs()).squaredNorm();
    const double turn = 2 * static_cast<double>(std::sqrt(std::min(minus, plus)));
    constexpr double kUp = 1 + 64 * static_cast<double>(kRealEpsilon);
    const double lever = static_cast<double>((last_x0_w_ - reference_w_).norm()) + step;
    odometer_.of_a += kUp * (step + turn * (lever + pair_.b.record->reach_m));
    odometer_.of_b += kUp * (step + turn * pair_.a.record->reach_m);
  }
  last_x0_w_ = x0_w;
  last_q_wa_ = q_wa;
  has_last_ = true;
}

Real GeometricQuery::query(const Pose& pose_wa) {
  const Quat q_wa = pose_wa.q_wa.normalized();
  const Mat3 r_wa = q_wa.toRotationMatrix();
  const Vec3 x0_w = pose_wa.p_wa + r_wa * grip_a_;
  const Vec3 y_w = x0_w - reference_w_;
  advance(x0_w, q_wa);
  double gap = gate_.gap_m(odometer_);
  if (!gate_.known || (!is_far(gap, gate_.face, exact_band_m_) &&
                       renew_gate(pair_, r_wa, y_w, odometer_, exact_band_m_, gate_))) {
    gap = gate_.gap_m(odometer_);
  }
  if (gate_.known && is_far(gap, gate_.face, exact_band_m_)) return static_cast<Real>(gap);
  turn_vertices(pair_.a, r_wa, tables_.lanes.data());
  const PairPose pose = make_pair_pose(pair_, tables_.lanes.data(), r_wa, y_w);
  tables_.bounds.advance(odometer_, pose.size_m);
  tables_.near.clear();
  const NearResult found =
      find_near_set(pose, epsilon_m_, tables_.bounds, tables_.scratch, tables_.near);
  const VerdictResult verdict = pair_verdict(pose, found, verdict_);
  gate_ = gate_plane(pose, found, odometer_);
  return verdict.verdict == Verdict::kSeparated
             ? std::max(found.d_near_m, verdict.separation_bound_m)
             : found.d_near_m;
}

constexpr double kPaperEpsilon_m = 1e-4;  // the paper's, of the near set
constexpr double kPeerStiffness_n_per_m = 1000.0;

Pose pose_of(const PeerPose& pose) {
  return pose_at(Vector(pose.p_wa[0], pose.p_wa[1], pose.p_wa[2]),
                 Rotation(pose.q_wxyz[0], pose.q_wxyz[1], pose.q_wxyz[2], pose.q_wxyz[3]));
}

class CorePeer final : public PeerQuery {
 public:
  CorePeer(const Solid& a, std::span<const Solid> pieces)
      : session_(scene_of(a, pieces, kPeerStiffness_n_per_m, kPaperEpsilon_m, LawId::kPaper,
                          tools::kDefaultExactBand_m),
                 a.name + " on " + pieces.front().name),
        core_(session_.core()),
        search_(session_.view()) {}

  void prepare(const PeerPose& pose) override {
    input_.pose_wa = pose_of(pose);
    ++input_.sequence;
    input_.stamp_ns += 1'000'000;
    input_.report_goal_contact = true;
  }
  void query() override { result_ = core_.step(input_); }
  void query_only() override { sink_ = search_.query(input_.pose_wa); }
  [[nodiscard]] bool has_query_only() const override { return core_.pair_count() == 1; }
  [[nodiscard]] PeerAnswer answer() const override;
  void reset() override {
    core_.reset();
    search_.reset();
  }
  [[nodiscard]] bool coherent() const override { return true; }

 private:
  CoreSession session_;
  HapticCore& core_;
  GeometricQuery search_;
  volatile Real sink_ = 0;
  StepInput input_;
  StepResult result_;
};

PeerAnswer CorePeer::answer() const {
  const PairReport report = core_.pair_report(result_.nearest_pair);
  PeerAnswer answer;
  answer.depth_m = static_cast<double>(report.d_near_m);
  answer.penetrating = report.d_near_m <= 0;
  for (std::uint32_t k = 0; k < core_.pair_count(); ++k)
    answer.patch_points += static_cast<std::uint32_t>(core_.pair_report(k).contact_nodes.size());
  answer.separated = report.exact ? SeparatedValue::kPlane : SeparatedValue::kLowerBound;
  answer.normal_w = {static_cast<double>(report.normal_w[0]),
                     static_cast<double>(report.normal_w[1]),
                     static_cast<double>(report.normal_w[2])};
  return answer;
}

class LiteralPeer final : public PeerQuery {
 public:
  LiteralPeer(const Solid& a, const Solid& b, DeltaReading reading)
      : session_(scene_of(a, {&b, 1}, kPeerStiffness_n_per_m, kPaperEpsilon_m),
                 a.name + " on " + b.name),
        tracker_(session_.view(), reading) {}

  void prepare(const PeerPose& pose) override { pose_ = pose_of(pose); }
  void query() override { tracker_.update(pose_); }
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.depth_m = tracker_.d_near_m()[0];
    answer.penetrating = answer.depth_m <= 0;
    answer.patch_points = static_cast<std::uint32_t>(tracker_.near_nodes(0).size());
    answer.separated = SeparatedValue::kPlane;
    Point force{}, torque{};
    tracker_.wrench(kPeerStiffness_n_per_m, force, torque);
    const double length =
        std::sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
    if (length > 0) answer.normal_w = {force[0] / length, force[1] / length, force[2] / length};
    return answer;
  }
  void reset() override { tracker_.reset(); }
  [[nodiscard]] bool coherent() const override { return true; }

 private:
  CoreSession session_;
  LiteralTracker tracker_;
  Pose pose_;
};

}  // namespace

std::unique_ptr<PeerQuery> make_core_peer(const Solid& a, std::span<const Solid> pieces) {
  return std::make_unique<CorePeer>(a, pieces);
}

std::unique_ptr<PeerQuery> make_literal_peer(const Solid& a, const Solid& b, bool with_rotation) {
  return std::make_unique<LiteralPeer>(
      a, b, with_rotation ? DeltaReading::kTranslationAndRotation : DeltaReading::kTranslation);
}

}  // namespace haptic::sim
