// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"

#include <utility>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr Real kHandStiffness_n_per_m = 1000;
constexpr Real kLooseRatio = 100;
/// The radius at which a turn counts like a displacement, in radii of the body.
constexpr Real kTurnShare = 0.5_r;
constexpr Real kGenerous = 20, kTooStiff = 1.25_r;

Spring spring_of(const FuzzBody& body, const DriverSpring& driver) {
  const Real radius = static_cast<Real>(body.radius_m());
  Spring spring;
  spring.k_t_n_per_m = kHandStiffness_n_per_m;
  if (body.role == BodyRole::kDriver) spring.k_t_n_per_m *= static_cast<Real>(driver.ratio);
  if (body.role == BodyRole::kLoose) spring.k_t_n_per_m *= kLooseRatio;
  spring.length_m = kTurnShare * radius;
  spring.k_r_nm_per_rad = spring.k_t_n_per_m * spring.length_m * spring.length_m;
  if (body.role != BodyRole::kDriver || !(driver.push_n > 0)) return spring;
  spring.soft_translation_m = static_cast<Real>(driver.push_n) / spring.k_t_n_per_m;
  spring.soft_rotation_rad = spring.soft_translation_m / spring.length_m;
  return spring;
}

/// The pose nearer to `pose` on the way from `anchor`, at which a pull is no more than `most`.
GripPose given_way(const Spring& spring, double yield_n, const GripPose& anchor,
                   const GripPose& pose) {
  const Real most_m = static_cast<Real>(yield_n) / spring.k_t_n_per_m;
  const Real most_rad = most_m / spring.length_m;
  const PoseError error = pose_error(anchor, pose);
  const Real far_m = error.translation_m.norm(), turn_rad = error.rotation_rad.norm();
  if (far_m <= most_m && turn_rad <= most_rad) return anchor;
  const Real kept = far_m > most_m ? most_m / far_m : Real{1};
  const Real kept_turn = turn_rad > most_rad ? most_rad / turn_rad : Real{1};
  return moved(pose, kept * error.translation_m, kept_turn * error.rotation_rad);
}

}  // namespace

std::optional<BodiesFault> bodies_fault_named(const std::string& name) {
  if (name == "certificate") return BodiesFault::kCertificate;
  if (name == "spring") return BodiesFault::kSpring;
  if (name == "reaction") return BodiesFault::kReaction;
  if (name == "restless") return BodiesFault::kRestless;
  if (name == "goal") return BodiesFault::kGoal;
  if (name == "bound") return BodiesFault::kBound;
  return std::nullopt;
}

GripPose grip_pose_at(const Vector& p, const Rotation& q) {
  GripPose pose;
  pose.x0_w = p.cast<Real>();
  pose.q_wa = q.cast<Real>().normalized();
  pose.r_wa = pose.q_wa.toRotationMatrix();
  return pose;
}

Pose pose_of(const GripPose& pose) {
  Pose result;
  result.p_wa = pose.x0_w;
  result.q_wa = pose.q_wa;
  return result;
}

std::vector<MovingBody> moving_bodies(const BodiesScene& scene) {
  std::vector<MovingBody> bodies;
  for (const FuzzBody& body : scene.bodies) {
    if (body.is) {
      bodies.push_back(*body.is);
      continue;
    }
    MovingBody moving;
    moving.spring = spring_of(body, scene.driver);
    moving.radius_m = static_cast<Real>(body.radius_m());
    moving.is_held_back = body.role == BodyRole::kHand;
    bodies.push_back(moving);
  }
  return bodies;
}

ProxyScale bodies_scale(const BodiesScene& scene) {
  if (scene.scale) return *scene.scale;
  return proxy_scale(static_cast<Real>(scene.felt_radius_m()), static_cast<Real>(scene.extent_m()),
                     0, 0);
}

BodiesSession::BodiesSession(const CompiledBodies& compiled, std::uint32_t work_units,
                             std::optional<BodiesFault> fault)
    : scene_(compiled.scene),
      bodies_(moving_bodies(compiled.scene)),
      scale_(bodies_scale(compiled.scene)),
      law_(std::make_unique<BodyLaw>()) {
  std::vector<BodyPairScene> pairs;
  Real epsilon_m = 0;
  for (const CompiledBodyPair& pair : compiled.pairs) {
    blobs_.emplace_back(pair.blob);
    views_.emplace_back();
    const RtStatus opened = SceneView::open(std::as_const(blobs_.back()).span(), views_.back());
    if (opened != RtStatus::kOk) {
      throw tools::InputError(scene_.name + ": not a usable pair: " + to_text(opened));
    }
    epsilon_m = static_cast<Real>(views_.back().parameters().epsilon_m);
    pairs.push_back({static_cast<std::uint32_t>(pair.a),
                     pair.b == kFuzzStanding ? kStanding : static_cast<std::uint32_t>(pair.b),
                     &views_.back()});
  }
  const auto count = static_cast<std::uint32_t>(bodies_.size());
  Arena counting;
  law_->place(counting, pairs, count, count);
  memory_ = tools::SceneBytes(counting.used());
  Arena arena(memory_.span().data());
  law_->place(arena, pairs, count, count);
  law_->read_scenes(pairs);
  BodyLaw::Parameters parameters;
  parameters.scale = scale_;
  parameters.epsilon_m = epsilon_m;
  if (scene_.passes > 0) parameters.passes = scene_.passes;
  if (work_units == 0) work_units = scene_.work_units;
  if (work_units > 0) parameters.work_units = work_units;
  if (fault == BodiesFault::kCertificate) parameters.scale.tolerance_m *= kGenerous;
  std::vector<MovingBody> given = bodies_;
  if (fault == BodiesFault::kSpring) {
    for (MovingBody& body : given) body.spring.k_r_nm_per_rad *= kTooStiff;
  }
  law_->configure(parameters, pairs, given);
  units_bound_ = parameters.work_units;
  for (const SceneView& view : views_)
    units_bound_ += view.header().capacity.max_work_units - view.parameters().work_units;
}

void BodiesSession::begin(std::span<const GripPose> poses) {
  anchors_.assign(poses.begin(), poses.end());
  law_->begin(poses);
}

BodiesTick BodiesSession::tick(std::span<GripPose> goals) {
  for (std::size_t k = 0; k < goals.size(); ++k) {
    if (scene_.bodies[k].role != BodyRole::kLoose) continue;
    goals[k] = anchors_[k];
    goals[k].x0_w.z() -= static_cast<Real>(scene_.bodies[k].sink_m);
  }
  return law_->tick(goals);
}

void BodiesSession::release_anchors() {
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    const FuzzBody& body = scene_.bodies[k];
    if (body.role != BodyRole::kLoose) continue;
    const GripPose& pose = law_->pose(static_cast<std::uint32_t>(k));
    anchors_[k] =
        body.sink_m > 0 ? pose : given_way(bodies_[k].spring, body.yield_n, anchors_[k], pose);
  }
}

}  // namespace haptic::sim
