// SPDX-License-Identifier: Apache-2.0
#include "hal/device_link.hpp"

namespace haptic::hal {

static_assert(std::atomic_ref<std::uint64_t>::is_always_lock_free);

LinkCounters snapshot(LinkCounters& live) noexcept {
  static constexpr std::uint64_t LinkCounters::*kMembers[] = {
      &LinkCounters::reports,     &LinkCounters::states,       &LinkCounters::bad_length,
      &LinkCounters::bad_check,   &LinkCounters::bad_number,   &LinkCounters::not_advancing,
      &LinkCounters::sent,        &LinkCounters::send_busy,    &LinkCounters::send_failed,
      &LinkCounters::in_failed,   &LinkCounters::answers_late, &LinkCounters::connects,
      &LinkCounters::disconnects, &LinkCounters::guard_held};
  static_assert(sizeof(kMembers) / sizeof(kMembers[0]) * sizeof(std::uint64_t) ==
                sizeof(LinkCounters));
  LinkCounters copy;
  for (const auto member : kMembers)
    copy.*member = std::atomic_ref<std::uint64_t>(live.*member).load(std::memory_order_relaxed);
  return copy;
}

}  // namespace haptic::hal
