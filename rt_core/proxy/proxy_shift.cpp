// SPDX-License-Identifier: Apache-2.0
// The shifts of the proxy's cones: Coulomb's law without lift.
//
// The cone n.dp - mu |dp_t| >= -gap lifts a point that slides. Shifted by s, to
// n.dp - mu (|dp_t| - s) >= -gap, it has the same forces, and with s = |dp_t| of its own solution
// nothing is lifted: that is Coulomb's law (De Saxce and Feng, Mathematical and Computer Modelling
// 28, 1998; Acary and Cadoux, in Recent Advances in Contact Mechanics, 2013). A part that stays
// where it is keeps any shifted cone, so the energy falls for any shifts. They are found
// in two ways at once: s from the slip of the program before, and the balance of the forces that
// program has found, in which what slides keeps its planes. Where that balance holds for every
// point it is the solution, and no further program is needed.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rt_core/proxy/proxy_step.hpp"
#include "rt_core/proxy/slide_forces.hpp"

namespace haptic {
namespace {

/// Shares of the tolerance: the lift that is left, so that no point sinks, and what a point may
/// sink below it or be lifted beyond. A slip of less than lift / mu costs as much by its lift as it
/// gains. The tolerance of single precision is so wide that a smaller share has to do: eight
/// roundings of the largest coordinate. With two a groove is felt 1.5 % too smooth.
constexpr Real kLiftShare = sizeof(Real) == sizeof(float) ? 0.125_r : 0.25_r;
constexpr Real kSinkShare = 0.125_r, kMoreLift = 0.25_r;
/// A point that comes by less than this share of the goal's way is held up by more than its
/// friction, or about to slide.
constexpr Real kHardlySlides = 0.25_r;
/// Angle by which the friction of a point may miss its slip [rad], and that from which on it is not
/// turned any more.
constexpr Real kStraight = 0.007_r, kNoTurn = 1.0e-4_r;
/// And so many times the slip of its program an inexact balance is not to be trusted beyond.
constexpr Real kNear = 4;
/// Share of the tolerance by which a balance may miss what is no part of it.
constexpr Real kRowShare = 1.0e-3_r;

}  // namespace

/// The shift that a point should have which moves by `motion`.
Real Proxy::wanted_shift_m(const FrictionCone& cone, const PoseError& motion) const noexcept {
  const Real lift_m = kLiftShare * parameters_.scale.tolerance_m;
  const Real slip_m = std::sqrt(slip_of(cone, motion).squaredNorm());
  return std::max(slip_m - lift_m / cone.friction, Real{0});
}

/// True if no point sinks by `motion`, nor is lifted, where it may not be.
bool Proxy::shifts_fit(const PoseError& motion, bool may_lift) const noexcept {
  const Real tolerance_m = parameters_.scale.tolerance_m;
  for (const FrictionCone& cone : program_.cones) {
    const Real lacks_m = cone.friction * (wanted_shift_m(cone, motion) - cone.shift_m);
    const Real sunk_m = cone.least_m - rise_of(cone, motion);
    if (std::max(-lacks_m, sunk_m) > kSinkShare * tolerance_m) return false;
    if (!may_lift && lacks_m > kMoreLift * tolerance_m) return false;
  }
  return true;
}

/// True if a point comes by a small share of the goal's way at the most.
bool Proxy::hardly_slides(const FrictionCone& cone, const PoseError& motion) const noexcept {
  return wanted_shift_m(cone, motion) <= kHardlySlides * wanted_shift_m(cone, slip_.way);
}

/// Shifts the cones until each has the slip that its program finds. Where that does not end a point
/// may be lifted, but none sinks: then no cone is shifted. A part that a program holds may also be
/// free to slide along with the goal, for friction between planes that look at each other can press
/// them together: in the first pass of a tick it slides where it can.
void Proxy::settle_cones(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept {
  if (!kSceneTraits.friction || program_.cones.empty()) return;
  Balance first;
  if (find_balance(error, false, first, tick) && first.is_exact) {
    take(first);
    return;
  }
  cut_cones(error, tolerance_m, tick);
  bool may_slide = is_first_pass(), tried = false;
  QpResult held;
  for (std::uint32_t k = 0;; ++k) {
    const bool ends = k == kMaxShiftsOfRound || program_.shift_programs >= kMaxShiftPrograms ||
                      (k > 0 && !has_budget(tick));
    const PoseError motion = asked(program_.found.z, error);
    const bool fits = shifts_fit(motion, ends);
    const bool stays = fits && is_held(motion);
    if (stays && tried) {
      shift_cones(PoseError{});
      program_.found = held;
    }
    if (fits && (ends || !may_slide || !stays)) return;
    if (ends) {
      tick.limited = true;
      shift_cones(PoseError{});
    } else {
      Balance balance;
      const bool found = find_balance(error, fits, balance, tick) &&
                         (balance.is_exact || fits || is_near(balance.motion, motion));
      if (fits && !found) return;
      if (fits) {
        may_slide = false;
        tried = true;
        held = program_.found;
      }
      if (balance.is_exact) {
        if (!(fits && is_held(balance.motion))) take(balance);
        return;
      }
      shift_cones(found ? balance.motion : motion);
      program_.shift_programs += 1;
    }
    const QpResult last = program_.found;
    program_.found = solve_rows(tolerance_m, tick, std::span(last.active).first(last.active_count));
    cut_cones(error, tolerance_m, tick);
    if (ends) return;
  }
}

/// True if the goal goes on and no point comes along by `motion`.
bool Proxy::is_held(const PoseError& motion) const noexcept {
  for (const FrictionCone& cone : program_.cones) {
    if (!hardly_slides(cone, motion)) return false;
  }
  return true;
}

/// Makes an exact balance the solution of the program.
void Proxy::take(const Balance& balance) noexcept {
  shift_cones(balance.motion);
  program_.found.z = balance.z;
  for (FrictionCone& cone : program_.cones) {
    if (cone.shift_m > 0) cone.direction_w = -slip_of(cone, balance.motion).normalized();
  }
}

/// True if by a balance that has not come to its end no point slides by many times what it does in
/// the program or comes by with the goal.
bool Proxy::is_near(const PoseError& balanced, const PoseError& motion) const noexcept {
  for (const FrictionCone& cone : program_.cones) {
    const Real most_m =
        kNear * std::max(wanted_shift_m(cone, motion), wanted_shift_m(cone, slip_.way));
    if (wanted_shift_m(cone, balanced) > most_m) return false;
  }
  return true;
}

/// Shifts every cone by the slip of `motion`.
void Proxy::shift_cones(const PoseError& motion) noexcept {
  std::array<Real, kMaxFrictionCones> change_m;
  for (std::uint32_t c = 0; c < program_.cones.size(); ++c) {
    const Real shift_m = wanted_shift_m(program_.cones[c], motion);
    change_m[c] = shift_m - program_.cones[c].shift_m;
    program_.cones[c].shift_m = shift_m;
  }
  for (std::uint32_t row = 0; row < program_.rows.size(); ++row) {
    const std::uint32_t c = program_.row_cone[row];
    if (c < program_.cones.size()) program_.rows[row].h -= program_.cones[c].friction * change_m[c];
  }
}

/// What a force along w at the point of a cone is in the coordinates of the program. `pushes`: of
/// the plane, which turns with the part, and not along it alone.
QpVector Proxy::force_at(const FrictionCone& cone, const Vec3& w, bool pushes) const noexcept {
  QpVector force = QpVector::Zero();
  force.head<3>() = w;
  if (!is_locked()) {
    Vec3 moment = cone.arm.app_w.cross(w);
    if (pushes) moment += cone.arm.turn_w;
    force.tail<3>() = moment / program_.secant.length_m;
  }
  return force;
}

/// Turns the force of a point against a slip, > 0.
void Proxy::aim(SlideForce& force, const Vec3& slip) const noexcept {
  const FrictionCone& cone = program_.cones[force.cone];
  force.slip_m = std::sqrt(slip.squaredNorm());
  const Vec3 t = -slip / force.slip_m;
  force.along = force_at(cone, cone.normal_w + cone.friction * t, true);
  force.across = force_at(cone, cone.normal_w.cross(t), false);
  force.turns = cone.friction * force.size / force.slip_m;
}

/// The forces of the last program: one for each point that slides, or is to begin to, for its
/// plane, and one for each other row, for that.
void Proxy::take_forces(const PoseError& error, bool begins, SlideForces& taken) const noexcept {
  const PoseError motion = asked(program_.found.z, error);
  const Real lift_m = kLiftShare * parameters_.scale.tolerance_m;
  for (std::uint32_t i = 0; i < program_.found.active_count; ++i) {
    const std::uint32_t row = program_.found.active[i];
    const std::uint32_t c = program_.row_cone[row];
    const bool moves =
        c < program_.cones.size() && (begins || wanted_shift_m(program_.cones[c], motion) > 0);
    SlideForce* force = nullptr;
    for (std::uint32_t k = 0; moves && k < taken.count; ++k) {
      if (taken.forces[k].cone == c) force = &taken.forces[k];
    }
    if (force == nullptr) {
      force = &taken.forces[taken.count++];
      *force = SlideForce{};
      if (moves) {
        taken.slides = true;
        force->cone = c;
        force->plane = force_at(program_.cones[c], program_.cones[c].normal_w, true);
        force->h = program_.cones[c].least_m + lift_m - rise_of(program_.cones[c], error);
      } else {
        force->plane = force->along = program_.rows[row].g;
        force->h = program_.rows[row].h;
        if (c < program_.cones.size()) taken.stuck[taken.stuck_count++] = c;
      }
    }
    force->size += program_.found.multiplier[i];
  }
  for (std::uint32_t k = 0; k < taken.count; ++k) {
    SlideForce& force = taken.forces[k];
    if (!begins && force.cone < program_.cones.size())
      aim(force, slip_of(program_.cones[force.cone], motion));
  }
}

/// The motion in which the points that slide in the last program keep their planes and the others
/// their rows, with friction against the slip of each; if it `begins`, all points slide that the
/// program presses. False: there is none of forces that push. Newton's method on the
/// directions of the slips.
bool Proxy::find_balance(const PoseError& error, bool begins, Balance& found,
                         ProxyTick& tick) const noexcept {
  SlideForces taken;
  take_forces(error, begins, taken);
  if (!taken.slides) return false;
  auto& [forces, stuck, count, stuck_count, slides] = taken;
  QpVector pull = QpVector::Zero();
  pull.head<3>() = error.translation_m;
  if (!is_locked()) pull.tail<3>() = program_.secant.length_m * error.rotation_rad;
  std::uint32_t left = kMaxBalances;
  if (begins) {
    // It would begin to slide as it did without friction. What two planes that look at each other
    // press out of friction alone is not there in a slide.
    for (std::uint32_t k = 0; k < count; ++k) {
      forces[k].size = forces[k].turns = 0;
      forces[k].along = forces[k].plane;
    }
    left -= 1;
    ++tick.work.balances;
    const PoseError begun = asked(balance(std::span(forces).first(count), pull), error);
    for (std::uint32_t k = 0; k < count; ++k) {
      SlideForce& force = forces[k];
      force.size = 0;
      if (force.cone < program_.cones.size())
        aim(force, slip_of(program_.cones[force.cone], begun));
    }
  }
  for (bool turns = true; left > 0 && turns;) {
    for (std::uint32_t had = 0; had != count;) {  // a force that would pull is none
      if (left == 0) return false;
      left -= 1;
      ++tick.work.balances;
      had = count;
      found.z = balance(std::span(forces).first(had), pull);
      std::uint32_t worst = 0;
      for (std::uint32_t k = 1; k < had; ++k) {
        if (forces[k].size < forces[worst].size) worst = k;
      }
      if (forces[worst].size > 0) continue;
      if (--count == 0) return false;
      forces[worst] = forces[count];
    }
    found.motion = asked(found.z, error);
    found.is_exact = true;
    turns = false;
    for (std::uint32_t k = 0; k < count; ++k) {
      if (forces[k].cone >= program_.cones.size()) continue;
      const FrictionCone& cone = program_.cones[forces[k].cone];
      const Vec3 slip = slip_of(cone, found.motion);
      const Vec3 rub = Vec3(forces[k].along.head<3>()) - cone.normal_w;
      const Real along_m = -rub.dot(slip) / cone.friction;
      if (!(along_m > 0)) return found.is_exact = false;
      const Real across2 = slip.squaredNorm() - along_m * along_m;
      const Real length_m = std::min(along_m, forces[k].slip_m);
      const Real length2 = length_m * length_m;
      found.is_exact = found.is_exact && across2 <= kStraight * kStraight * length2;
      if (across2 <= kNoTurn * kNoTurn * length2) continue;
      turns = true;
      aim(forces[k], slip);
    }
  }
  found.is_exact = found.is_exact && keeps_the_rest(found, std::span(stuck).first(stuck_count));
  return true;
}

/// True if by a balance nothing sinks, no row is left out, and what sticks does not slide.
bool Proxy::keeps_the_rest(const Balance& found,
                           std::span<const std::uint32_t> stuck) const noexcept {
  const Real sink_m = kRowShare * parameters_.scale.tolerance_m;
  for (const FrictionCone& cone : program_.cones) {
    if (rise_of(cone, found.motion) < cone.least_m - sink_m) return false;
  }
  for (std::uint32_t row = 0; row < program_.rows.size(); ++row) {
    if (program_.row_cone[row] < program_.cones.size()) continue;
    if (program_.rows[row].g.dot(found.z) < program_.rows[row].h - sink_m) return false;
  }
  for (const std::uint32_t c : stuck) {
    if (wanted_shift_m(program_.cones[c], found.motion) > 0) return false;
  }
  return true;
}

}  // namespace haptic
