// SPDX-License-Identifier: Apache-2.0
// Which of the pairs within reach a pass looks at closely, where a scene asks for fewer seats than
// it has near pairs. Those without one are certified by their own plane; one that its plane does
// not certify takes the seat of a pair that needs it no more, so what a pass finds is what it would
// with a seat for each.
#include <algorithm>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {

/// There is no seat for a pair within reach; one that the part is inside of takes that of another
/// which it is not, and of which no plane is imposed.
void Proxy::stand_beside(const ReachedPair& reached, ProxyTick& tick) noexcept {
  if (!takes_turns()) return;
  std::uint32_t slot = reached.pair;
  if (pairs_[slot].inside) {
    need_view(pairs_[slot], tick);
    const auto other = std::find_if(reached_.begin(), reached_.end(), [&](const ReachedPair& r) {
      return !pairs_[r.pair].inside && pairs_[r.pair].held_in != pass_;
    });
    if (other != reached_.end()) {
      give_seat(static_cast<std::uint32_t>(other - reached_.begin()), slot, reached);
    }
  }
  static_cast<void>(beside_.push(slot));
}

/// What is known of a pair within reach that has no seat.
ReachedPair Proxy::seen(std::uint32_t slot) const noexcept {
  const ProxyPair& pair = pairs_[slot];
  ReachedPair reached;
  reached.pair = slot;
  reached.exact_p = pair.gap_version == version_;
  reached.gap_m = reached.exact_p ? pair.gap_m : clear_m(pair);
  reached.gap_p_m = reached.gap_q_m = reached.path_m = reached.gap_m;
  reached.unsure = pair.waits;
  reached.plane = pair.plane;
  reached.support = pair.support;
  return reached;
}

/// A seat whose pair the step that is looked at has certified, and of which no plane is imposed;
/// none: the length of the list. The search goes on where the last one ended. Cost: one look at
/// each seat at most, and over as many calls as find one no more than a round of the list.
std::uint32_t Proxy::free_seat(Real least_m, bool shared_too) noexcept {
  for (std::uint32_t k = 0; k < reached_.size(); ++k) {
    const std::uint32_t seat = next_seat_ < reached_.size() ? next_seat_ : 0;
    next_seat_ = seat + 1;
    const ReachedPair& reached = reached_[seat];
    const ProxyPair& pair = pairs_[reached.pair];
    if (reached.open || reached.unsure || pair.inside || (reached.shared && !shared_too)) continue;
    if (pair.held_in != pass_ && !(worth_m(reached, least_m) < 0)) return seat;
  }
  return reached_.size();
}

/// Puts `reached`, of the pair in `slot`, into a seat; `slot` is that of the pair that had it then.
void Proxy::give_seat(std::uint32_t seat, std::uint32_t& slot,
                      const ReachedPair& reached) noexcept {
  keep_plane(reached_[seat]);
  keep_view(reached_[seat].pair, false);
  slot = reached_[seat].pair;
  reached_[seat] = reached;
  recall_valid(reached_[seat]);
  keep_view(reached.pair, true);
}

/// Forms the view of a listed pair that has none; where pairs take turns, in place of one that this
/// pass does not keep.
void Proxy::form_view(ProxyPair& pair, ProxyTick& tick) noexcept {
  const auto slot = static_cast<std::uint32_t>(&pair - pairs_.data());
  std::uint32_t at = slot;
  if (takes_turns()) {
    tick.search_work += 1;
    for (std::uint32_t k = 0; k < view_of_.size(); ++k) {
      at = next_view_ < view_of_.size() ? next_view_ : 0;
      next_view_ = at + 1;
      if (view_of_[at].kept_in != pass_) break;
    }
    ProxyPair& before = pairs_[view_of_[at].slot];
    if (before.view == &views_[at]) before.view = nullptr;
    view_of_[at] = {slot, 0};
  }
  views_[at] = scene_[0].pair(pair.index);
  views_[at].skin_m = skin_m();
  pair.view = &views_[at];
}

/// Whether this pass keeps the view of a pair that has one.
void Proxy::keep_view(std::uint32_t slot, bool keep) noexcept {
  if (!takes_turns()) return;
  view_of_[static_cast<std::uint32_t>(pairs_[slot].view - views_.data())].kept_in =
      keep ? pass_ : 0;
}

}  // namespace haptic
