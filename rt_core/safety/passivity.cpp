// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/passivity.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

double dot(const Vec3& l, const Vec3& r) noexcept {
  return (static_cast<double>(l.x()) * static_cast<double>(r.x()) +
          static_cast<double>(l.y()) * static_cast<double>(r.y())) +
         static_cast<double>(l.z()) * static_cast<double>(r.z());
}

/// Errors of V between two ticks, in units of its last digit: those of poses and proxy as well.
constexpr double kRoundings = 1.0e4;

Vec3 finite_or_zero(const Vec3& v) noexcept { return is_finite(v) ? v : Vec3(Vec3::Zero()); }

/// `pull` less `damper`: along the pull no more than takes it to zero, across it no more than its
/// own size, so that the wrench neither turns into a pull nor into a grip on the way along.
Vec3 damped(const Vec3& pull, const Vec3& damper) noexcept {
  const double pull2 = dot(pull, pull);
  if (!(pull2 > 0.0)) return pull;
  const double along = dot(damper, pull) / pull2;
  Vec3 across = damper - static_cast<Real>(along) * pull;
  const double across2 = dot(across, across);
  if (across2 > pull2) across *= static_cast<Real>(std::sqrt(pull2 / across2));
  const Vec3 result = static_cast<Real>(1.0 - std::min(along, 1.0)) * pull - across;
  return is_finite(result) ? result : pull;
}

}  // namespace

Passivity::Passivity(const PassivityLimits& limits) noexcept {
  limits_.mass_kg = non_negative(limits.mass_kg);
  limits_.damping_ns_per_m = non_negative(limits.damping_ns_per_m);
  limits_.rotor_kg_m2 = non_negative(limits.rotor_kg_m2);
  limits_.rotor_damping_nms_per_rad = non_negative(limits.rotor_damping_nms_per_rad);
  limits_.noise_j = non_negative(limits.noise_j);
}

void Passivity::reset() noexcept {
  debt_j_ = 0;
  counts_ = started_ = false;
  stored_ = {};
  gain_ = 1;
  command_w_ = output_w_ = Wrench{};
  pending2_ = {};
}

/// The share of the wrench that a limit behind this layer has let through: 1 where the wrench that
/// acted is as large as one of the last outputs. A spring that is felt in part stores in part.
double Passivity::passed_on(const Vec3& accepted, std::size_t part) const noexcept {
  double least2 = pending2_[0][part];
  for (const auto& output2 : pending2_) least2 = std::min(least2, output2[part]);
  const double accepted2 = dot(accepted, accepted);
  return accepted2 < least2 ? std::sqrt(accepted2 / least2) : 1.0;
}

/// What differs in nothing from no debt: encoder noise, and the rounding of V.
double Passivity::ignored_j(const PassivityInput& input) const noexcept {
  const double stored_j = input.stored.linear_j + input.stored.angular_j;
  const double rounding_j = kRoundings * static_cast<double>(kRealEpsilon) *
                            (stored_j + stored_.linear_j + stored_.angular_j);
  return static_cast<double>(limits_.noise_j) + (std::isfinite(rounding_j) ? rounding_j : 0.0);
}

/// Energy that the rendering has made in the interval that ends now: the spring's change and the
/// work of what acted.
template <bool kTurns>
double Passivity::generated_j(const PassivityInput& input, const Wrench& command) const noexcept {
  const Wrench& said = input.accepted_valid ? input.accepted_w : output_w_;
  const Wrench acted = is_finite(said) ? said : Wrench{};
  const Vec3 way = finite_or_zero(input.way_m);
  const auto change_j = [&](double now_j, double then_j, const Vec3& now_w, const Vec3& then_w,
                            const Vec3& along) {
    if (input.stores) return static_cast<double>(gain_) * (now_j - then_j);
    return -0.5 * (dot(now_w, along) + dot(then_w, along));
  };
  double made_j = dot(acted.force_w, way) +
                  passed_on(acted.force_w, 0) * change_j(input.stored.linear_j, stored_.linear_j,
                                                         command.force_w, command_w_.force_w, way);
  if (input.given_j != 0)
    made_j -= static_cast<double>(gain_) * passed_on(acted.force_w, 0) * input.given_j;
  if constexpr (kTurns) {
    const Vec3 turn = finite_or_zero(input.turn_rad);
    made_j += dot(acted.torque_w, turn) +
              passed_on(acted.torque_w, 1) * change_j(input.stored.angular_j, stored_.angular_j,
                                                      command.torque_w, command_w_.torque_w, turn);
  }
  return made_j;
}

PassivityResult Passivity::update(const PassivityInput& input) noexcept {
  return take<true>(input);
}

PassivityResult Passivity::update_place(const PassivityInput& input) noexcept {
  return take<false>(input);
}

template <bool kTurns>
PassivityResult Passivity::take(const PassivityInput& input) noexcept {
  PassivityResult result;
  const Wrench command = is_finite(input.command_w) ? input.command_w : Wrench{};
  result.wrench_w = command;
  const bool newer = started_ && input.stamp_ns > stamp_ns_;
  const double interval_s =
      newer ? static_cast<double>(seconds_between(stamp_ns_, input.stamp_ns)) : 0.0;
  const bool touches = dot(command.force_w, command.force_w) > 0.0 ||
                       (kTurns && dot(command.torque_w, command.torque_w) > 0.0);
  if (started_ && counts_ && !input.fading) {
    double made_j = generated_j<kTurns>(input, command);
    if (interval_s > 0.0) {
      const Vec3 way = finite_or_zero(input.way_m), turn = finite_or_zero(input.turn_rad);
      made_j -= static_cast<double>(limits_.damping_ns_per_m) * dot(way, way) / interval_s;
      if (kTurns) {
        made_j -=
            static_cast<double>(limits_.rotor_damping_nms_per_rad) * dot(turn, turn) / interval_s;
      }
    }
    const double debt_j = debt_j_ + made_j;
    if (std::isfinite(debt_j)) debt_j_ = debt_j < 0.0 ? kSpareShare * debt_j : debt_j;
  }
  if (!touches) {
    debt_j_ = std::max(0.0, debt_j_) / (1.0 + interval_s / static_cast<double>(kDebtFades_s));
  }
  const bool may_pay = touches && !input.fading && interval_s > 0.0 && debt_j_ > ignored_j(input);
  if (may_pay && input.twist_valid && is_finite(input.twist_w)) pay<kTurns>(input, result);
  result.debt_j = std::max(0.0, debt_j_);

  counts_ = !input.fading;
  started_ = true;
  stamp_ns_ = input.stamp_ns;
  const bool known = std::isfinite(input.stored.linear_j) && std::isfinite(input.stored.angular_j);
  stored_ = known ? input.stored : StoredEnergy{};
  gain_ = input.gain;
  command_w_ = command;
  output_w_ = result.wrench_w;
  for (std::size_t k = kPendingOutputs - 1; k > 0; --k) pending2_[k] = pending2_[k - 1];
  pending2_[0] = {dot(output_w_.force_w, output_w_.force_w),
                  dot(output_w_.torque_w, output_w_.torque_w)};
  return result;
}

/// alpha = min(G / (T |v|^2), share m / T), and in rotation the same share of the rotor's: all of
/// the debt within one interval, if the device moves on as it does and that is not too much.
template <bool kTurns>
void Passivity::pay(const PassivityInput& input, PassivityResult& result) const noexcept {
  const double share = static_cast<double>(kControllerShare);
  const double interval_s = static_cast<double>(seconds_between(stamp_ns_, input.stamp_ns));
  const Twist& v = input.twist_w;
  double most_j = share * static_cast<double>(limits_.mass_kg) * dot(v.linear_w, v.linear_w);
  if (kTurns) {
    most_j += share * static_cast<double>(limits_.rotor_kg_m2) * dot(v.angular_w, v.angular_w);
  }
  if (!(most_j > 0.0) || !std::isfinite(most_j)) return;
  const double part = std::min((debt_j_ - ignored_j(input)) / most_j, 1.0) * share / interval_s;
  const Real alpha = static_cast<Real>(part * static_cast<double>(limits_.mass_kg));
  const Wrench pull = result.wrench_w;
  result.wrench_w.force_w = damped(pull.force_w, alpha * v.linear_w);
  if (kTurns) {
    const Real alpha_r = static_cast<Real>(part * static_cast<double>(limits_.rotor_kg_m2));
    result.wrench_w.torque_w = damped(pull.torque_w, alpha_r * v.angular_w);
  }
  result.alpha_ns_per_m = alpha;
  result.acted =
      result.wrench_w.force_w != pull.force_w || result.wrench_w.torque_w != pull.torque_w;
}

}  // namespace haptic
