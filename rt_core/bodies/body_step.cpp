// SPDX-License-Identifier: Apache-2.0
// One step of several bodies: where it ends, what all pairs say of it, and how it is taken.
#include <algorithm>
#include <cmath>

#include "rt_core/bodies/body_law.hpp"
#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {

Real BodyLaw::sum_j(const Step& step) const noexcept {
  Real sum = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Body& body = bodies_[i];
    sum += haptic::potential_j(body.is.spring, pose_error(body.goal, step.q[i]));
  }
  return sum;
}

/// Force of the springs along what a program asks for and a step, null: none, does not do.
Real BodyLaw::left_over_n(const Step* step) const noexcept {
  Real most_n = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Body& body = bodies_[i];
    if (!body.is.is_held_back) continue;
    BodyMotion left = body.wish;
    if (step != nullptr) {
      left.translation_m -= step->motion[i].translation_m;
      left.rotation_rad -= step->motion[i].rotation_rad;
    }
    const Real turn_m = body.secant.length_m * norm_of(left.rotation_rad);
    most_n = std::max(
        most_n, body.secant.k_t_n_per_m * root_of_squares(norm_of(left.translation_m), turn_m));
  }
  return most_n;
}

BodyLaw::Step BodyLaw::step_by(
    const std::array<BodyMotion, kMostMovingBodies>& motion) const noexcept {
  Step step;
  step.motion = motion;
  for (std::uint32_t i = 0; i < count_; ++i)
    step.q[i] = moved(bodies_[i].p, motion[i].translation_m, motion[i].rotation_rad);
  return step;
}

bool BodyLaw::is_still(const Step& step) const noexcept {
  const ProxyScale& scale = parameters_.scale;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const BodyMotion& motion = step.motion[i];
    if (motion.translation_m.squaredNorm() > scale.still_m * scale.still_m ||
        motion.rotation_rad.squaredNorm() > scale.still_rad * scale.still_rad) {
      return false;
    }
  }
  return true;
}

/// True if the goals rest and a step lowers the energy by no more than bodies at rest may leave.
bool BodyLaw::gains_nothing(const Step& step) const noexcept {
  if (held_ == 0 || close_m_ > 0) return false;
  const Real start_j = sum_j();
  return start_j - sum_j(step) < kIdleShare * start_j;
}

void BodyLaw::set_step(BodyPair& pair, const Step& step) const noexcept {
  const auto motion = [&](std::uint32_t i) { return moves(i) ? step.motion[i] : BodyMotion{}; };
  const auto end = [&](std::uint32_t i) -> const GripPose& {
    return moves(i) ? step.q[i] : bodies_[i].p;
  };
  const std::uint32_t a = pair.a(), b = pair.has_b() ? pair.b() : a;
  pair.set_step(end(a), end(b), motion(a), motion(b));
}

BlockRow BodyLaw::on_blocks(const BodyPair& pair, BlockRow row) const noexcept {
  if (pair.has_b() && !moves(pair.b())) row.b = kNoBlock;
  if (moves(pair.a())) return row;
  row.a = row.b;
  row.g_a = row.g_b;
  row.b = kNoBlock;
  return row;
}

void BodyLaw::shorten(const BodyPair& pair, Real share) noexcept {
  bodies_[pair.a()].share *= share;
  if (pair.has_b()) bodies_[pair.b()].share *= share;
}

/// Asks all pairs; where none lacks a plane, but the way of some is not certified, their bodies are
/// to go a share of it.
BodyLaw::Check BodyLaw::check(const Step& step, Real least_m, bool knows_last,
                              ProxyTick& tick) noexcept {
  Check result;
  std::array<Real, kMostOpenPairs> share;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    BodyPair& pair = pairs_[k];
    set_step(pair, step);
    const BodyPair::Check found = pair.check(least_m, knows_last, tick);
    share[k] = found.ok ? Real{1} : found.share;
    result.ok = result.ok && found.ok;
    result.spent = result.spent || (found.spent && !found.ok);
    if (found.lacking_m > result.lacking_m) {
      result.lacking_m = found.lacking_m;
      result.worst = static_cast<std::uint32_t>(k);
    }
  }
  if (result.lacking_m > 0) {
    result.spent = false;
    return result;
  }
  // The shortest that one of its pairs asks for.
  std::array<Real, kMostMovingBodies> least;
  least.fill(1);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const std::uint32_t a = pairs_[k].a(), b = pairs_[k].has_b() ? pairs_[k].b() : a;
    if (moves(a)) least[a] = std::min(least[a], share[k]);
    if (moves(b)) least[b] = std::min(least[b], share[k]);
  }
  for (std::uint32_t i = 0; i < count_; ++i) bodies_[i].share *= least[i];
  return result;
}

/// Displaces a step that is not certified out of what it violates, without a turn.
bool BodyLaw::correct(Step& step, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  Step trial = step;
  for (std::uint32_t k = 0; k <= kMaxCorrections; ++k) {
    if (!has_budget(tick)) return false;
    const Check result = check(trial, kCorrectedShare * -scale.tolerance_m, false, tick);
    if (result.ok) {
      const Real most = scale.step_m + scale.margin_m;
      for (std::uint32_t i = 0; i < count_; ++i) {
        const Vec3 way = trial.motion[i].translation_m - step.motion[i].translation_m;
        if (way.squaredNorm() > most * most) return false;
        const Body& body = bodies_[i];
        const bool is_limited = body.most_m < kUnbounded;
        if (is_limited && norm_of(trial.motion[i].translation_m) > body.way_left_m) return false;
      }
      step = trial;
      return true;
    }
    if (k == kMaxCorrections || !(result.lacking_m > 0)) break;
    program_.clear();
    for (BodyPair& pair : pairs_) {
      const bool fits = pair.for_each_lacking(tick, [&](const Vec3& normal_w, Real gap_m) {
        BlockRow row;
        row.a = static_cast<std::uint8_t>(pair.a());
        if (pair.has_b()) row.b = static_cast<std::uint8_t>(pair.b());
        row.h = -gap_m;
        for (std::size_t c = 0; c < 3; ++c) {
          const Real n = normal_w[static_cast<Eigen::Index>(c)];
          row.g_a[c] = n / bodies_[pair.a()].weight;
          if (pair.has_b()) row.g_b[c] = -n / bodies_[pair.b()].weight;
        }
        return program_.push(on_blocks(pair, row));
      });
      if (!fits) return false;
    }
    program_.solve(1.0e-4_r * scale.tolerance_m);
    tick.work.qp_programs += program_.programs();
    tick.work.qp_steps += program_.steps();
    tick.work.search_work += program_.more_units();
    for (std::uint32_t i = 0; i < count_; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        trial.motion[i].translation_m[static_cast<Eigen::Index>(c)] +=
            program_.z(i)[c] / bodies_[i].weight;
      }
    }
    trial = step_by(trial.motion);
  }
  return false;
}

/// Planes with a multiplier, and what they push with: a program for a share of the errors tells
/// that share of it.
void BodyLaw::remember_active() noexcept {
  for (Body& body : bodies_) body.force_m = BodyMotion{};
  for (BodyPair& pair : pairs_) {
    pair.remember_active();
    BodyMotion none;
    pair.add_forces(1 / bodies_[mover_of(pair)].pull_share, bodies_[pair.a()].force_m,
                    pair.has_b() ? bodies_[pair.b()].force_m : none);
  }
}

void BodyLaw::accept(const Step& step, bool is_certified) noexcept {
  for (BodyPair& pair : pairs_) {
    if (is_certified) {
      pair.accept();
    } else {
      pair.carry();
    }
  }
  const ProxyScale& scale = parameters_.scale;
  moved_little_ = true;
  for (std::uint32_t i = 0; i < count_; ++i) {
    Body& body = bodies_[i];
    const BodyMotion& motion = step.motion[i];
    const Real far_m = norm_of(motion.translation_m), turn_rad = norm_of(motion.rotation_rad);
    moved_little_ = moved_little_ && far_m <= scale.last_m && turn_rad <= scale.last_rad;
    body.way_left_m = std::max(body.way_left_m - far_m, Real{0});
    body.turn_left_rad = std::max(body.turn_left_rad - turn_rad, Real{0});
    body.p = step.q[i];
    way_[std::size_t{steps_} * count_ + i] = body.p;
  }
  steps_ += 1;
}

}  // namespace haptic
