// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/voxel_peer.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace haptic::sim {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kCoarser = 8;  ///< step of a field over that of the finer one
constexpr std::size_t kFields = 3;
constexpr double kFullPoints = 10;  ///< McNeely 1999, section 4.4: more are scaled to as many
constexpr double kMass_kg = 0.05;
/// Bound of stiffness times the tick squared over mass: with less the explicit step neither grows
/// nor rings.
constexpr double kCalmShare = 0.5;

struct Place {
  Vector p = Vector::Zero();
  Rotation q = Rotation::Identity();
};

Place place_of(const PeerPose& pose) {
  return {{pose.p_wa[0], pose.p_wa[1], pose.p_wa[2]},
          Rotation(pose.q_wxyz[0], pose.q_wxyz[1], pose.q_wxyz[2], pose.q_wxyz[3])};
}

Vector turn_of(const Rotation& from, const Rotation& to) {
  Rotation by = to * from.conjugate();
  if (by.w() < 0) by.coeffs() = -by.coeffs();
  const Eigen::AngleAxisd turn(by);
  return turn.angle() * turn.axis();
}

Rotation turned_by(const Vector& turn, const Rotation& q) {
  const double angle = turn.norm();
  if (angle == 0) return q;
  return (Rotation(Eigen::AngleAxisd(angle, turn / angle)) * q).normalized();
}

class VoxelPeer : public CoupledPeer {
 public:
  VoxelPeer(const VoxelScene& scene, const CouplingGains& gains, const VoxelSettings& settings)
      : scene_(scene), gains_(gains), settings_(settings) {}

  void begin(const PeerPose& grip) override {
    at_ = goal_ = place_of(grip);
    felt_ = at_;
  }
  [[nodiscard]] PeerPose place() const override {
    PeerPose pose;
    for (std::size_t i = 0; i < 3; ++i) pose.p_wa[i] = felt_.p[static_cast<Eigen::Index>(i)];
    pose.q_wxyz = {felt_.q.w(), felt_.q.x(), felt_.q.y(), felt_.q.z()};
    return pose;
  }

 protected:
  [[nodiscard]] const CouplingGains& gains() const { return gains_; }
  [[nodiscard]] const VoxelSettings& settings() const { return settings_; }
  [[nodiscard]] const VoxelScene& scene() const { return scene_; }

  Place at_, goal_, felt_;

 private:
  const VoxelScene& scene_;
  CouplingGains gains_;
  VoxelSettings settings_;
};

class TangentPlanes final : public VoxelPeer {
 public:
  TangentPlanes(const VoxelScene& scene, const CouplingGains& gains, const VoxelSettings& settings)
      : VoxelPeer(scene, gains, settings) {
    const double square = gains.tick_s * gains.tick_s / kCalmShare,
                 contact = settings.contact_n_per_m;
    const double radius = scene.points().radius_m();
    mass_kg_ = std::max(kMass_kg, (gains.k_t_n_per_m + contact) * square);
    inertia_kgm2_ = (gains.k_r_nm_per_rad + contact * radius * radius) * square;
    damping_ = 2 * std::sqrt(gains.k_t_n_per_m * mass_kg_);
    turn_damping_ = 2 * std::sqrt(gains.k_r_nm_per_rad * inertia_kgm2_);
  }

  void begin(const PeerPose& grip) override {
    VoxelPeer::begin(grip);
    speed_.setZero();
    turning_.setZero();
  }

  void tick(const PeerPose& goal) override {
    const Place last = goal_;
    goal_ = place_of(goal);
    felt_ = at_;
    Vector force = Vector::Zero(), torque = Vector::Zero();
    add_contacts(force, torque);
    const double tick_s = gains().tick_s;
    force += gains().k_t_n_per_m * (goal_.p - at_.p) + damping_ * (goal_.p - last.p) / tick_s;
    torque += gains().k_r_nm_per_rad * turn_of(at_.q, goal_.q) +
              turn_damping_ * turn_of(last.q, goal_.q) / tick_s;
    const double share = tick_s / mass_kg_, turn_share = tick_s / inertia_kgm2_;
    speed_ = (speed_ + share * force) / (1 + share * damping_);
    turning_ = (turning_ + turn_share * torque) / (1 + turn_share * turn_damping_);
    at_.p += tick_s * speed_;
    at_.q = turned_by(tick_s * turning_, at_.q);
    if (!at_.p.allFinite() || at_.p.norm() > 10) throw std::runtime_error("voxels: it diverged");
  }

 private:
  void add_contacts(Vector& force, Vector& torque) const {
    const DistanceField& fine = scene().fields().front();
    Vector push = Vector::Zero(), turn = Vector::Zero();
    std::size_t count = 0;
    const Eigen::Matrix3d r = at_.q.toRotationMatrix();
    scene().points().near(
        at_.p, r, scene().fields(), fine.step_m(), [&](const Vector& arm, const ShellPoint& point) {
          const Vector p = at_.p + arm;
          const std::size_t voxel = fine.nearest(p);
          if (voxel == DistanceField::kOutside) return;
          const std::uint8_t layer = scene().layer(voxel);
          if (layer == 0) return;
          const Vector normal = r * point.normal.cast<double>();
          // How far the point is beyond the plane through the voxel's middle.
          const double depth = (p - fine.place(voxel)).dot(normal) + (layer - 1) * fine.step_m();
          if (depth <= 0) return;
          ++count;
          push -= depth * normal;
          turn -= depth * arm.cross(normal);
        });
    if (count == 0) return;
    const double n = static_cast<double>(count);
    const double of_point =
        settings().contact_n_per_m / kFullPoints * std::min(1.0, kFullPoints / n);
    force += of_point * push;
    torque += of_point * turn;
  }

  double mass_kg_ = 0, inertia_kgm2_ = 0, damping_ = 0, turn_damping_ = 0;
  Vector speed_ = Vector::Zero(), turning_ = Vector::Zero();
};

class DistancePush final : public VoxelPeer {
 public:
  using VoxelPeer::VoxelPeer;

  void tick(const PeerPose& goal) override {
    goal_ = place_of(goal);
    Vector6 wrench;
    wrench << gains().k_t_n_per_m * (goal_.p - at_.p),
        gains().k_r_nm_per_rad * turn_of(at_.q, goal_.q);
    Matrix6 stiffness = Matrix6::Zero();
    stiffness.diagonal() << Vector::Constant(gains().k_t_n_per_m),
        Vector::Constant(gains().k_r_nm_per_rad);
    const DistanceField& fine = scene().fields().front();
    const bool by_gradient = settings().along == PushAlong::kGradient;
    const double of_point = settings().contact_n_per_m;
    const Eigen::Matrix3d r = at_.q.toRotationMatrix();
    scene().points().near(at_.p, r, scene().fields(), 0,
                          [&](const Vector& arm, const ShellPoint& point) {
                            Vector gradient;
                            const double distance = fine.between(at_.p + arm, gradient);
                            if (distance >= 0) return;
                            Vector along = -(r * point.normal.cast<double>());
                            if (by_gradient && gradient.squaredNorm() > 0.01)
                              along = gradient.normalized();
                            Vector6 row;
                            row << along, arm.cross(along);
                            wrench -= of_point * distance * row;
                            stiffness.selfadjointView<Eigen::Lower>().rankUpdate(row, of_point);
                          });
    const Vector6 step = stiffness.selfadjointView<Eigen::Lower>().ldlt().solve(wrench);
    at_.p += step.head<3>();
    at_.q = turned_by(step.tail<3>(), at_.q);
    felt_ = at_;
  }
};

}  // namespace

VoxelScene::VoxelScene(std::span<const SurfaceTriangle> part,
                       std::span<const SurfaceTriangle> standing, const SpaceBox& reach,
                       double voxel_m, double spacing_m)
    : points_(point_shell(part, spacing_m)) {
  double step_m = voxel_m;
  for (std::size_t k = 0; k < kFields; ++k) {
    SpaceBox box;
    for (const SurfaceTriangle& t : standing) {
      for (const Vector& corner : t) box.include(corner);
    }
    const Vector margin = Vector::Constant(DistanceField::kBandSteps * step_m);
    box.low = (box.low - margin).cwiseMax(reach.low - margin);
    box.high = (box.high + margin).cwiseMin(reach.high + margin);
    fields_.emplace_back(standing, box, step_m);
    step_m *= kCoarser;
  }
  const DistanceField& fine = fields_.front();
  layers_.resize(fine.samples());
  for (std::size_t voxel = 0; voxel < layers_.size(); ++voxel) {
    const double steps = static_cast<double>(fine.value(voxel)) / voxel_m;
    layers_[voxel] = steps > 0.5 ? 0 : static_cast<std::uint8_t>(1 + std::floor(0.5 - steps));
  }
}

std::unique_ptr<CoupledPeer> make_voxel_peer(const VoxelScene& scene, const CouplingGains& gains,
                                             const VoxelSettings& settings) {
  if (settings.form == VoxelForm::kTangentPlanes)
    return std::make_unique<TangentPlanes>(scene, gains, settings);
  return std::make_unique<DistancePush>(scene, gains, settings);
}

}  // namespace haptic::sim
