// SPDX-License-Identifier: Apache-2.0
// Which planes a pass imposes: those that held the proxy last, and of the pairs that a step lacks
// the one whose plane is met.
#include <algorithm>
#include <array>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Passes after which the planes of a part at rest are chosen from the start again.
constexpr std::uint32_t kChoiceAge = 96;
/// The same where they are others than those chosen last.
constexpr std::uint32_t kNewChoiceAge = 16;

}  // namespace

/// Imposes the planes that held the proxy last, where they are C-faces still.
void Proxy::impose_last(const PoseError& error, ProxyTick& tick) noexcept {
  for (const ImposedPlane& last : kept_.active) near_.pairs[last.pair].held_in = pass_.number;
  for (const ReachedPair& reached : pass_.reached) {
    const ProxyPair& pair = near_.pairs[reached.pair];
    if (pair.held_in != pass_.number) continue;
    const auto take = [&](const PlaneId& id, SupportPair support) {
      const PlaneRegion& region = region_at_p(reached.pair, id, support, tick);
      if (!region.gap.defined) return;
      // Past the end of what it held, another plane may certify the pair: let the step tell.
      if (!region.overlap || region.gap.gap_m < -valid_depth(parameters_.scale)) return;
      ImposedPlane plane;
      plane.pair = reached.pair;
      plane.id = id;
      plane.at_start = true;
      if (!program_.imposed.push(plane) ||
          !add_region(program_.imposed.size() - 1, region, error)) {
        tick.limited = true;
      }
    };
    if (rest_.choose_from_start) continue;
    const std::uint32_t before = program_.imposed.size();
    for (const ImposedPlane& last : kept_.active) {
      if (last.pair == reached.pair && plane_applies(pair_at(pair, part_.pose), last.id)) {
        take(last.id, last.support);
      }
    }
    // What rubs along the others is to be held by this pair too: by the plane that it has now.
    if (has_friction() && program_.imposed.size() == before) take(reached.plane, reached.support);
  }
  rest_.choose_from_start = false;
  impose_pending(error, tick);
}

/// Imposes what a pass at this p found before it ended for want of budget: the planes at p, and at
/// the steps that showed them to be needed there too.
void Proxy::impose_pending(const PoseError& error, ProxyTick& tick) noexcept {
  for (const ImposedPlane& plane : kept_.pending) {
    if (is_imposed(plane.pair, plane.id)) continue;
    if (!program_.imposed.push(plane)) break;
    near_.pairs[plane.pair].held_in = pass_.number;
    need_view(near_.pairs[plane.pair], tick);
    keep_view(plane.pair, true);
    ImposedPlane& taken = program_.imposed[program_.imposed.size() - 1];
    taken.times = 1;
    taken.at_start = true;
    taken.at_step = false;
    if (!add_rows_at_p(program_.imposed.size() - 1, error, tick)) tick.limited = true;
  }
  std::uint32_t steps = 0;
  for (std::uint32_t k = kept_.pending.size(); k-- > 0;) {
    const ImposedPlane& plane = kept_.pending[k];
    if (!plane.at_step) continue;
    if (steps >= kGrantedSteps && !has_budget(tick)) break;
    for (std::uint32_t at = 0; at < program_.imposed.size(); ++at) {
      ImposedPlane& taken = program_.imposed[at];
      if (taken.pair != plane.pair || !(taken.id == plane.id)) continue;
      steps += 1;
      program_.far_rows = taken.at_step = true;
      taken.dx_m = plane.dx_m;
      taken.dtheta_rad = plane.dtheta_rad;
      taken.times = plane.times;
      const Step step = step_by(plane.dx_m, plane.dtheta_rad);
      if (!add_rows(at, step, error, plane.times > 1, tick)) tick.limited = true;
    }
  }
}

bool Proxy::is_imposed(std::uint32_t pair, const PlaneId& id) const noexcept {
  return std::any_of(
      program_.imposed.begin(), program_.imposed.end(),
      [&](const ImposedPlane& plane) { return plane.pair == pair && plane.id == id; });
}

/// True if the features of the plane that came closest to certifying a pair of facets touch, or
/// would along it: at p, or at the end of `step`. Not asked of others.
bool Proxy::meets(const ReachedPair& reached, const Step* step, ProxyTick& tick) noexcept {
  const ProxyPair& pair = near_.pairs[reached.pair];
  if (!pair.view->has_facet()) return true;
  // Not where the features lie over each other elsewhere, but where the pieces are nearest.
  const auto touches = [&](const PlaneRegion& region) {
    const Real most_m = region.gap.gap_m + parameters_.scale.tolerance_m;
    return region.overlap &&
           std::any_of(region.points.begin(), region.points.begin() + region.count,
                       [&](const ManifoldPoint& point) { return point.gap_m <= most_m; });
  };
  if (step == nullptr) {
    const PlaneRegion& at_p = region_at_p(reached.pair, reached.plane, reached.support, tick);
    return at_p.gap.defined && touches(at_p);
  }
  PlaneRegion at_q;
  at_q.gap = gap_at(pair, *step, reached.plane, reached.support, tick);
  if (!at_q.gap.defined) return false;
  find_region(pair, step->q, at_q, tick);
  return touches(at_q);
}

/// Of the pairs that a step lacks the one whose plane is to be imposed: of the first few, in the
/// order of what they lack, the first that meets at p, or where none does at the step's end; those
/// that follow another pair come last. Of pairs that only their own plane was asked of, a few are
/// looked at here, as their turn comes. None: the length of the list.
std::uint32_t Proxy::worst_that_meets(const Check& check, const Step& step, Real least_m,
                                      ProxyTick& tick) noexcept {
  if (!near_.pairs[pass_.reached[check.worst].pair].view->has_facet()) return check.worst;
  std::uint32_t opened = 0;
  for (const bool follow : {false, true}) {
    std::array<std::uint32_t, kMaxMeetingLooks> worst;
    std::uint32_t count = 0;
    std::uint32_t last = pass_.reached.size();
    while (count < worst.size()) {
      std::uint32_t next = pass_.reached.size();
      const auto gap_m = [&](std::uint32_t k) { return pass_.reached[k].gap_q_m; };
      const auto is_before = [&](std::uint32_t k, std::uint32_t other) {
        return gap_m(k) < gap_m(other) || (gap_m(k) == gap_m(other) && k < other);
      };
      for (std::uint32_t k = 0; k < pass_.reached.size(); ++k) {
        const ReachedPair& reached = pass_.reached[k];
        if (!reached.exact_q || !(gap_m(k) < least_from(least_m, reached.gap_p_m))) continue;
        if (reached.follows() != follow) continue;
        if (reached.open && opened == kMaxMeetingLooks) continue;
        if (last < pass_.reached.size() && !is_before(last, k)) continue;
        if (next == pass_.reached.size() || is_before(k, next)) next = k;
      }
      if (next == pass_.reached.size()) break;
      if (pass_.reached[next].open) {
        opened = has_budget(tick) ? opened + 1 : kMaxMeetingLooks;
        if (has_budget(tick))
          pass_.reached[next].open = !certify(pass_.reached[next], step, least_m, tick);
        continue;
      }
      if (meets(pass_.reached[next], nullptr, tick)) return next;
      worst[count++] = last = next;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
      if (meets(pass_.reached[worst[k]], &step, tick)) return worst[k];
    }
  }
  return pass_.reached.size();
}

/// Adds the plane that came closest to certifying the pair of this number in the list: at p, and
/// when that was not enough at the step.
bool Proxy::impose(std::uint32_t number, const Step& step, const PoseError& error,
                   ProxyTick& tick) noexcept {
  const ReachedPair& reached = pass_.reached[number];
  std::uint32_t at = 0;
  while (at < program_.imposed.size() &&
         !(program_.imposed[at].pair == reached.pair && program_.imposed[at].id == reached.plane)) {
    ++at;
  }
  if (at == program_.imposed.size()) {
    ImposedPlane plane;
    plane.pair = reached.pair;
    plane.id = reached.plane;
    plane.support = reached.support;
    if (pass_.is_short) take_touching(reached, plane, tick);
    if (!program_.imposed.push(plane)) return false;
    near_.pairs[plane.pair].held_in = pass_.number;
  }
  ImposedPlane& plane = program_.imposed[at];
  if (plane.id == reached.plane) plane.support = reached.support;
  plane.times += 1;
  if (!plane.at_start) {
    plane.at_start = true;
    // These alone at first: the step that they replace may lie so far ahead that its own rows would
    // ask for more than the plane does.
    const std::uint32_t rows = program_.rows.size();
    if (!add_rows_at_p(at, error, tick)) return false;
    if (program_.rows.size() > rows) return true;
  }
  program_.far_rows = plane.at_step = true;
  plane.dx_m = step.dx_m;
  plane.dtheta_rad = step.dtheta_rad;
  const std::uint32_t rows = program_.rows.size(), cones = program_.cones.size();
  if (add_rows(at, step, error, plane.times > 1, tick)) return true;
  // Its region is looked for a second time.
  return has_budget(tick) && make_room(rows, cones, error) &&
         add_rows(at, step, error, plane.times > 1, tick);
}

/// Of the planes of a pair that certify it at p, one whose features touch there, where the one that
/// came closest at the step would hold the part past the end of its features.
void Proxy::take_touching(const ReachedPair& reached, ImposedPlane& plane,
                          ProxyTick& tick) noexcept {
  if (reached.gap_p_m > parameters_.scale.tolerance_m) return;
  const auto touches = [&](const PlaneId& id, SupportPair support) {
    const PlaneRegion& region = region_at_p(reached.pair, id, support, tick);
    return region.gap.defined && region.overlap;
  };
  if (touches(plane.id, plane.support)) return;
  const std::uint32_t looked_at = std::min(reached.exposed_count, kMaxTouchingLooks);
  for (std::uint32_t k = 0; k < looked_at; ++k) {
    const ValidPlane& valid = found_.valid[reached.valid_begin + k];
    if (valid.gap_m > parameters_.scale.tolerance_m || is_imposed(reached.pair, valid.id)) continue;
    if (!touches(valid.id, valid.support)) continue;
    plane.id = valid.id;
    plane.support = valid.support;
    return;
  }
}

/// True if two planes of one pair are imposed: one of them may be more than the pair needs.
bool Proxy::crowded() const noexcept {
  for (std::uint32_t k = 0; k < program_.imposed.size(); ++k) {
    for (std::uint32_t l = 0; l < k; ++l) {
      if (program_.imposed[k].pair == program_.imposed[l].pair) return true;
    }
  }
  return false;
}

/// True if the planes that hold the proxy where it is must be chosen from the start to be sure: the
/// goal rests, or the last choice is long ago, sooner where they are others than then.
bool Proxy::choice_is_due() noexcept {
  std::uint64_t planes = 0;
  for (const ImposedPlane& plane : program_.imposed) {
    const std::uint64_t id = std::uint64_t{plane.id.i} << 19 | std::uint64_t{plane.id.j} << 3 |
                             static_cast<std::uint64_t>(plane.id.type) << 1 |
                             (plane.id.flipped ? 1u : 0u);
    planes = (planes ^ (std::uint64_t{plane.pair} << 35 | id)) * 0x9e3779b97f4a7c15u;
  }
  const std::uint32_t age = planes != rest_.chosen_planes ? kNewChoiceAge : kChoiceAge;
  const bool due = rest_.held > 0 || rest_.chosen_ago >= age;
  rest_.chosen_ago = due ? 0 : rest_.chosen_ago + 1;
  rest_.chosen_planes = planes;
  return due;
}

/// Planes with a multiplier: the next pass starts with them.
void Proxy::remember_active() noexcept {
  if (pass_.keeps_active) return;
  kept_.active.clear();
  for (std::uint32_t k = 0; k < program_.found.active_count; ++k) {
    const std::uint32_t at = program_.row_plane[program_.found.active[k]];
    if (at >= program_.imposed.size()) continue;  // what p may move by
    const ImposedPlane& plane = program_.imposed[at];
    bool known = false;
    for (const ImposedPlane& other : kept_.active) {
      known = known || (other.pair == plane.pair && other.id == plane.id);
    }
    if (!known) static_cast<void>(kept_.active.push(plane));
  }
}

}  // namespace haptic
