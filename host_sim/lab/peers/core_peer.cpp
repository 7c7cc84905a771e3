// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/core_peer.hpp"

#include <cmath>

#include "host_sim/lab/peers/geometric_query.hpp"
#include "host_sim/oracle/literal_tracker.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr double kEpsilon_m = 1e-4;  // the paper's, of the near set
constexpr double kStiffness_n_per_m = 1000.0;

Pose pose_of(const PeerPose& pose) {
  return pose_at(Vector(pose.p_wa[0], pose.p_wa[1], pose.p_wa[2]),
                 Rotation(pose.q_wxyz[0], pose.q_wxyz[1], pose.q_wxyz[2], pose.q_wxyz[3]));
}

class CorePeer final : public PeerQuery {
 public:
  CorePeer(const Solid& a, std::span<const Solid> pieces, const CoreSetting& setting)
      : session_(core_scene(a, pieces, setting), a.name + " on " + pieces.front().name),
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
      : session_(scene_of(a, {&b, 1}, kStiffness_n_per_m, kEpsilon_m), a.name + " on " + b.name),
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
    tracker_.wrench(kStiffness_n_per_m, force, torque);
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

std::vector<std::byte> core_scene(const Solid& a, std::span<const Solid> pieces,
                                  const CoreSetting& setting) {
  return scene_of(a, pieces, kStiffness_n_per_m, setting.epsilon_m, setting.law,
                  setting.exact_band_m, setting.max_pair_visits);
}

std::unique_ptr<PeerQuery> make_core_peer(const Solid& a, std::span<const Solid> pieces,
                                          const CoreSetting& setting) {
  return std::make_unique<CorePeer>(a, pieces, setting);
}

std::unique_ptr<PeerQuery> make_literal_peer(const Solid& a, const Solid& b, bool with_rotation) {
  return std::make_unique<LiteralPeer>(
      a, b, with_rotation ? DeltaReading::kTranslationAndRotation : DeltaReading::kTranslation);
}

}  // namespace haptic::sim
