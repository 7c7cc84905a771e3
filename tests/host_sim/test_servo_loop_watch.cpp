// SPDX-License-Identifier: Apache-2.0
// What a watch of the servo loop sees. What the machine's clock says is not judged here.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "host_sim/session/core_session.hpp"
#include "tests/host_sim/sample_scenes.hpp"

namespace haptic::sim {

TEST_SUITE("host_sim.servo_loop_watch") {
  TEST_CASE("servo loop: a watch gets lateness and length of the ticks") {
    CoreSession session(test::scene_of(test::tetrahedron(), test::box(0.1, 0.06, 0.05)), "scene");
    ServoParameters parameters;
    parameters.limits = hal::limits_of(hal::reference_capabilities(), 1'000'000);
    ServoTick tick(session.core(), parameters, session.view().header().capacity, nullptr);
    hal::MailboxMemory mailbox;
    hal::ServoLoop loop(tick, mailbox, {});
    struct Seen {
      const hal::ServoLoop& loop;
      std::atomic<bool> stop{false};
      std::int64_t largest_lateness_ns = 0, largest_tick_ns = 0;
    } seen{loop};
    loop.watch(
        [](void* context, const ServoInput&, const ServoResult&) {
          auto& s = *static_cast<Seen*>(context);
          const hal::ServoLoopCounters& c = s.loop.counters();
          s.largest_lateness_ns = std::max(s.largest_lateness_ns, c.last_lateness_ns);
          s.largest_tick_ns = std::max(s.largest_tick_ns, c.last_tick_ns);
          if (c.ticks == 20) s.stop = true;
        },
        &seen);
    CHECK(loop.run(seen.stop) == 0);
    CHECK(loop.counters().ticks == 20);
    CHECK(seen.largest_lateness_ns == loop.counters().largest_lateness_ns);
    CHECK(std::max(seen.largest_tick_ns, loop.counters().last_tick_ns) ==
          loop.counters().largest_tick_ns);
    CHECK(seen.largest_tick_ns > 0);
  }
}

}  // namespace haptic::sim
