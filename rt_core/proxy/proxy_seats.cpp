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
  if (near_.pairs[slot].inside) {
    need_view(near_.pairs[slot], tick);
    const auto other =
        std::find_if(pass_.reached.begin(), pass_.reached.end(), [&](const ReachedPair& r) {
          return !near_.pairs[r.pair].inside && near_.pairs[r.pair].held_in != pass_.number;
        });
    if (other != pass_.reached.end()) {
      give_seat(static_cast<std::uint32_t>(other - pass_.reached.begin()), slot, reached);
    }
  }
  static_cast<void>(pass_.beside.push(slot));
}

/// What is known of a pair within reach that has no seat.
ReachedPair Proxy::seen(std::uint32_t slot) const noexcept {
  const ProxyPair& pair = near_.pairs[slot];
  ReachedPair reached;
  reached.pair = slot;
  reached.exact_p = pair.gap_version == part_.version;
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
  for (std::uint32_t k = 0; k < pass_.reached.size(); ++k) {
    const std::uint32_t seat = near_.next_seat < pass_.reached.size() ? near_.next_seat : 0;
    near_.next_seat = seat + 1;
    const ReachedPair& reached = pass_.reached[seat];
    const ProxyPair& pair = near_.pairs[reached.pair];
    if (reached.open || reached.unsure || pair.inside || (reached.shared && !shared_too)) continue;
    if (pair.held_in != pass_.number && !(worth_m(reached, least_m) < 0)) return seat;
  }
  return pass_.reached.size();
}

/// Puts `reached`, of the pair in `slot`, into a seat; `slot` is that of the pair that had it then.
void Proxy::give_seat(std::uint32_t seat, std::uint32_t& slot,
                      const ReachedPair& reached) noexcept {
  keep_plane(pass_.reached[seat]);
  keep_view(pass_.reached[seat].pair, false);
  slot = pass_.reached[seat].pair;
  pass_.reached[seat] = reached;
  recall_valid(pass_.reached[seat]);
  keep_view(reached.pair, true);
}

/// Forms the view of a listed pair that has none; where pairs take turns, in place of one that this
/// pass does not keep.
void Proxy::form_view(ProxyPair& pair, ProxyTick& tick) noexcept {
  const auto slot = static_cast<std::uint32_t>(&pair - near_.pairs.data());
  std::uint32_t at = slot;
  if (takes_turns()) {
    tick.work.search_work += 1;
    for (std::uint32_t k = 0; k < near_.view_of.size(); ++k) {
      at = near_.next_view < near_.view_of.size() ? near_.next_view : 0;
      near_.next_view = at + 1;
      if (near_.view_of[at].kept_in != pass_.number) break;
    }
    ProxyPair& before = near_.pairs[near_.view_of[at].slot];
    if (before.view == &near_.views[at]) before.view = nullptr;
    near_.view_of[at] = {slot, 0};
  }
  near_.views[at] = near_.scene[0].pair(pair.index);
  near_.views[at].skin_m = skin_m();
  pair.view = &near_.views[at];
}

/// True if this pass keeps the view of a pair that has one.
void Proxy::keep_view(std::uint32_t slot, bool keep) noexcept {
  if (!takes_turns()) return;
  near_.view_of[static_cast<std::uint32_t>(near_.pairs[slot].view - near_.views.data())].kept_in =
      keep ? pass_.number : 0;
}

}  // namespace haptic
