// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/free_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "rt_core/base/step_flags.hpp"
#include "rt_core/proxy/proxy_qp.hpp"
#include "rt_core/scene/envelope_of.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {
namespace {

/// The goal counts as hooked when it is this many radii of the part away from the proxy.
constexpr Real kHookedShare = 1.0_r;
/// A pull that nothing holds is no larger where the part stays where it is [N], and the share of it
/// that a plane may leave.
constexpr Real kStuck_n = 0.05_r, kStuckShare = 0.01_r;

}  // namespace

Spring coupling_spring(const CouplingParameters& c) noexcept {
  Spring spring;
  spring.k_t_n_per_m = static_cast<Real>(c.k_t_n_per_m);
  spring.k_r_nm_per_rad = static_cast<Real>(c.k_r_nm_per_rad);
  spring.length_m = std::sqrt(spring.k_r_nm_per_rad / spring.k_t_n_per_m);
  // Of a largest error and a largest pull the smaller counts.
  const auto soft = [](double error, double pull, double stiffness) {
    if (pull > 0 && !(error > 0 && error < pull / stiffness)) error = pull / stiffness;
    return static_cast<Real>(error);
  };
  spring.soft_translation_m = soft(c.max_translation_error_m, c.max_pull_n, c.k_t_n_per_m);
  spring.soft_rotation_rad = soft(c.max_rotation_error_rad, c.max_turn_nm, c.k_r_nm_per_rad);
  return spring;
}

/// Pieces and lengths of the proxy from the scene.
void FreeMotion::read_scene(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  const CouplingParameters& c = p.coupling;
  proxy_.read_scene(scene);
  spring_ = coupling_spring(c);
  damping_ns_per_m_ = static_cast<Real>(c.damping_ns_per_m);
  damping_share_ = static_cast<Real>(c.damping_share);
  radius_m_ = scene_size(scene).radius_m;
  epsilon_m_ = static_cast<Real>(p.epsilon_m);
  Proxy::Parameters parameters;
  parameters.spring = spring_;
  parameters.scale = proxy_scale(scene);
  tolerance_m_ = parameters.scale.tolerance_m;
  parameters.passes = c.passes;
  parameters.work_units = p.work_units;
  parameters.radius_m = radius_m_;
  parameters.epsilon_m = epsilon_m_;
  parameters.envelope = envelope_of(p);
  parameters.locked = scene.is_locked();
  proxy_.configure(parameters);
}

void FreeMotion::reset() noexcept {
  proxy_.reset();
  if (is_shared()) shared_->started = false;
  hold_.reset();
  at_rest_ = false;
}

/// The coupling's damping as a factor on the spring's wrench W. What the proxy does lies across W,
/// along the surfaces that hold it, so the spring stretches at -W.v / N with N the length of
/// (F, tau / L), and damping B against that is -(B W.v / N^2) W: no tangential noise, no pull, and
/// nothing where there is none. At most a share of the spring either way: it grows from zero with
/// the first touch and fades with the last.
Real FreeMotion::damping_gain(const Wrench& spring_w, const Twist& twist_w) const noexcept {
  const Vec3 leverage = spring_w.torque_w / spring_.length_m;
  const Real pull2 = spring_w.force_w.squaredNorm() + leverage.squaredNorm();
  if (!(pull2 > 0)) return 1;
  const Real power =
      spring_w.force_w.dot(twist_w.linear_w) + spring_w.torque_w.dot(twist_w.angular_w);
  const Real change = -damping_ns_per_m_ * power / pull2;
  if (!std::isfinite(change)) return 1;
  return 1 + std::clamp(change, -damping_share_, damping_share_);
}

/// How often the spring's wrench fits into its limits, at least once.
Real FreeMotion::room_to_limit(const Wrench& spring_w) const noexcept {
  Real room = std::numeric_limits<Real>::max();
  const auto bound = [&](Real soft, Real stiffness, const Vec3& pull) {
    const Real size = std::sqrt(pull.squaredNorm());
    if (soft > 0 && size > 0) room = std::min(room, soft * stiffness / size);
  };
  bound(spring_.soft_translation_m, spring_.k_t_n_per_m, spring_w.force_w);
  bound(spring_.soft_rotation_rad, spring_.k_r_nm_per_rad, spring_w.torque_w);
  return std::max(room, Real{1});
}

/// True if the part has stayed where it is although a pull is left that nothing holds: of the last
/// program, with its friction, and of the planes that the part touches. A part that nothing touches
/// is free in rotation too.
bool FreeMotion::is_stuck(const FreePose& free) const noexcept {
  if (free.proxy.moved || free.proxy.recovering || !(free.proxy.residual_n > kStuck_n))
    return false;
  const Wrench& pull = free.spring_w;
  const Vec3 leverage = pull.torque_w / spring_.length_m;
  const Real pull2 = pull.force_w.squaredNorm() + leverage.squaredNorm();
  if (felt().plane_count == 0) return pull2 > kStuck_n * kStuck_n;
  // The force that is left is the shortest z + F with n.(z + F) >= 0 for every normal n.
  std::array<QpRow, kMaxFeltPlanes> rows;
  for (std::uint32_t k = 0; k < felt().plane_count; ++k) {
    const Vec3& normal_w = felt().planes[k].normal_w;
    rows[k].g.head<3>() = normal_w;
    rows[k].h = -normal_w.dot(pull.force_w);
  }
  const QpResult found =
      closest_point(std::span(rows).first(felt().plane_count), kStuckShare * kStuck_n);
  const Vec3 left_n = found.z.head<3>() + pull.force_w;
  return !found.capped && left_n.squaredNorm() > kStuck_n * kStuck_n;
}

FreePose FreeMotion::move(const GripPose& goal, const Twist& twist_w, SearchRoom& room) noexcept {
  FreePose free;
  free.proxy = is_shared() ? shared_->told : proxy_.tick(goal, room.scratch);
  free.grip = is_shared() ? shared_->pose : proxy_.pose();
  LeftPull pull;
  pull.error = free.proxy.error;
  pull.held_m = is_shared() ? shared_->held_m : proxy_.held_m();
  pull.open_n = free.proxy.residual_n;
  pull.spent = free.proxy.spent;
  pull.moved = free.proxy.moved;
  const PoseError error = hold_.felt(pull, spring_, radius_m_);
  if (is_shared()) {
    free.flags |= shared_->flags;
    free.given_j = shared_->given_j;
  }
  if (hold_.holds()) free.flags |= kFlagHeld;
  if (free.proxy.limited) free.flags |= kFlagProxyLimited;
  if (free.proxy.spent) free.flags |= kFlagBehind;
  if (free.proxy.crowded) free.flags |= kFlagListFull;
  if (free.proxy.recovering) free.flags |= kFlagRecovery;
  const Real hooked = kHookedShare * radius_m_;
  if (error.translation_m.squaredNorm() > hooked * hooked) free.flags |= kFlagHooked;
  if (is_saturated(spring_, error)) free.flags |= kFlagSaturated;
  const Real turned_m = radius_m_ * std::sqrt(error.rotation_rad.squaredNorm());
  at_rest_ = felt().plane_count == 0 && turned_m <= tolerance_m_ &&
             error.translation_m.squaredNorm() <= tolerance_m_ * tolerance_m_;
  free.spring_w = free.wrench_w = spring_wrench(spring_, error);
  if (is_stuck(free)) free.flags |= kFlagProxyStuck;
  free.stored.linear_j =
      static_cast<double>(potential_j(spring_, {error.translation_m, Vec3::Zero()}));
  free.stored.angular_j =
      static_cast<double>(potential_j(spring_, {Vec3::Zero(), error.rotation_rad}));
  if (!(damping_ns_per_m_ > 0)) return free;
  // A pull grows by damping up to its limit, and no further.
  const Real gain = std::min(damping_gain(free.spring_w, twist_w), room_to_limit(free.spring_w));
  free.wrench_w = {gain * free.spring_w.force_w, gain * free.spring_w.torque_w};
  return free;
}

void FreeMotion::describe(PairIndex index, SearchRoom& room, const HullScratch& hull,
                          ContactGeometry& out) noexcept {
  Proxy* const proxy = is_shared() ? shared_->over_standing : &proxy_;
  if (proxy == nullptr) return;
  const FeltContact& felt = proxy->felt();
  const auto end = felt.planes.begin() + felt.plane_count;
  const auto is_of = [&](const FeltPlane& plane) { return plane.pair == index; };
  if (std::none_of(felt.planes.begin(), end, is_of)) return;
  const std::uint32_t near_begin = room.near.size(), nodes_begin = room.contact_nodes.size();
  PairPose pose;
  const NearResult found = proxy->near_set_of(index, room.scratch, room.near, pose);
  const std::span<NearNode> nodes(room.near.begin() + near_begin, room.near.size() - near_begin);
  if (!nodes.empty()) {
    locate_contacts(pose, nodes, false);
    bool several_planes = false;
    static_cast<void>(make_contact_patch(pose, nodes, found.d_near_m, epsilon_m_,
                                         room.contact_nodes, several_planes));
    ContactNodes contact;
    contact.near = nodes;
    contact.nodes = room.contact_nodes.view().subspan(nodes_begin);
    contact.d_near_m = found.d_near_m;
    contact.situation = situation_of(nodes, found.d_near_m, epsilon_m_, 1);
    contact.epsilon_m = epsilon_m_;
    describe_contact(*pose.pair, contact, proxy->pose().x0_w, hull, out);
    out.cut = out.cut || (found.flags & kNearSetCut) != 0;
  }
  room.near.truncate(near_begin);
  room.contact_nodes.truncate(nodes_begin);
}

}  // namespace haptic
