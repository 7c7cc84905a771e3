// SPDX-License-Identifier: Apache-2.0
// The servo loop in a process that may make no other system call.
#include <doctest/doctest.h>

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <new>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "host_sim/session/core_session.hpp"
#include "tests/host_sim/sample_scenes.hpp"

namespace haptic::sim {
namespace {

constexpr int kPatience_ms = 20'000;
constexpr std::uint64_t kTicks = 500;
enum ConfinedExit { kAllWell = 0, kNotConfined, kSanitized, kLoopFailed, kTooFew };

struct Shared {
  hal::MailboxMemory mailbox;
  std::atomic<bool> stop{false}, begun{false};
  std::atomic<std::uint64_t> ticks{0};
};

// Held within the box of the scene.
DeviceState pressing(std::uint64_t sequence) {
  DeviceState state;
  state.sequence = sequence;
  state.stamp_ns = hal::monotonic_ns();
  state.link = LinkState::kReady;
  state.pose_dh.p_m[2] = 0.02_r;
  state.switches = sequence < 50 ? 0u : 1u;
  return state;
}

int run_confined(Shared& shared, bool report_clocked) {
  CoreSession session(test::scene_of(test::tetrahedron(), test::box(0.1, 0.06, 0.05)), "scene");
  ServoParameters parameters;
  parameters.limits = hal::limits_of(hal::reference_capabilities(), 1'000'000);
  ServoTick tick(session.core(), parameters, session.view().header().capacity, nullptr);
  hal::ServoLoopSettings settings;
  settings.report_clocked = report_clocked;
  hal::ServoLoop loop(tick, shared.mailbox, settings);
  loop.watch([](void* context, const ServoInput&,
                const ServoResult&) { static_cast<Shared*>(context)->ticks.fetch_add(1); },
             &shared);
  const int error = hal::confine_servo();
  if (error == ENOTSUP) return kSanitized;
  if (error != 0) return kNotConfined;
  shared.begun = true;
  if (loop.run(shared.stop) != 0) return kLoopFailed;
  // Nothing is put away: that takes system calls.
  _exit(loop.counters().ticks >= kTicks ? kAllWell : kTooFew);
}

}  // namespace

TEST_SUITE("host_sim.confined_loop") {
  TEST_CASE("servo loop: runs confined, by the timer and by reports") {
    for (const bool report_clocked : {false, true}) {
      CAPTURE(report_clocked);
      hal::SharedMemory memory(sizeof(Shared));
      Shared& shared = *new (memory.bytes().data()) Shared;
      hal::DeviceSide device(shared.mailbox);
      hal::ServoProcess child;
      REQUIRE(child.start([&] { return run_confined(shared, report_clocked); }) == 0);
      std::uint64_t sequence = 0;
      hal::ProcessEnd end;
      while (shared.ticks.load() < kTicks && !end.ended) {
        device.publish(pressing(++sequence), report_clocked);
        end = child.poll(1);
      }
      shared.stop = true;
      device.publish(pressing(++sequence), report_clocked);
      if (!end.ended) end = child.finish(kPatience_ms);
      CHECK(end.signal == 0);
      if (end.exit_code == kSanitized) {
        MESSAGE("skipped: a sanitizer is compiled in, whose run-time makes system calls");
        return;
      }
      CHECK(end.exit_code == kAllWell);
      CHECK(device.command().tick >= kTicks);
      CHECK(device.command().sequence > 50);
    }
  }
}

}  // namespace haptic::sim
