// SPDX-License-Identifier: Apache-2.0
// The timed loop on a USB device, over the in-process bus, and the hand that holds the device. What
// the machine's clock says is counted and not judged here.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "host_sim/device/hand_routine.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/device/usb_loop_run.hpp"
#include "tests/host_sim/sample_scenes.hpp"

namespace haptic::sim {
namespace {

MotionSample sample(double t_s, double x_m) {
  MotionSample result;
  result.t_s = t_s;
  result.p[0] = x_m;
  return result;
}

bool in_order(const Quantiles& q) { return std::is_sorted(q.at_ns.begin(), q.at_ns.end()); }

}  // namespace

TEST_SUITE("host_sim.usb_loop") {
  TEST_CASE("quantiles: the smallest value that the share does not exceed") {
    CHECK(quantiles_of({}).count == 0);
    CHECK(quantiles_of({7}).at_ns == std::array<std::int64_t, 4>{7, 7, 7, 7});
    std::vector<std::int64_t> values;
    for (std::int64_t k = 2000; k > 0; --k) values.push_back(k);
    const Quantiles q = quantiles_of(values);
    CHECK(q.count == 2000);
    CHECK(q.at_ns == std::array<std::int64_t, 4>{1000, 1980, 1998, 2000});
  }

  TEST_CASE("hand: goes round where the motion closes, else stays at its end; regrips") {
    WorkspaceMap map;
    map.grip_a = Vec3(0, 0, 0.25_r);
    const std::vector<MotionSample> closed = {sample(0, 0), sample(0.01, 1), sample(0.02, 2),
                                              sample(0.03, 0)};
    const auto round = hand_routine(closed, 100, map, 1);
    const std::pair<double, double> ways[] = {{0.0, 0.0},  {0.02, 2.0}, {0.03, 0.0},
                                              {0.04, 1.0}, {0.05, 2.0}, {0.06, 0.0}};
    for (const auto& way : ways) {
      CAPTURE(way.first);
      CHECK(round(way.first).target.x0_w.x() == doctest::Approx(way.second));
      CHECK(round(way.first).target.x0_w.z() == doctest::Approx(0.25));
    }
    const auto stays = hand_routine({sample(0, 0), sample(0.01, 1)}, 100, map, 1);
    CHECK(stays(0.5).target.x0_w.x() == doctest::Approx(1));
    const auto rests = hand_routine({sample(0, 3)}, 100, map, 1);
    CHECK(rests(0.5).target.x0_w.x() == doctest::Approx(3));
    for (const double t_s : {0.0, 0.05, 1.05, 7.09}) CHECK(rests(t_s).switches == 0);
    for (const double t_s : {0.11, 0.99, 1.11}) CHECK(rests(t_s).switches == kDeadmanBit);
  }

  TEST_CASE("servo loop: a watch is told lateness and length of the ticks") {
    CoreSession session(test::scene_of(test::tetrahedron(), test::box(0.1, 0.06, 0.05)), "scene");
    ServoParameters parameters;
    parameters.limits = hal::limits_of(hal::reference_capabilities(), 1'000'000);
    ServoTick tick(session.core(), parameters, session.view().header().capacity, nullptr);
    hal::DeviceMailbox mailbox;
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

  TEST_CASE("run: counts as many ticks as asked for, from the first armed one on") {
    CoreSession session(test::scene_of(test::tetrahedron(), test::box(0.1, 0.06, 0.05)), "scene");
    ReferenceModelSettings model_settings;
    model_settings.hand = *hand_named("light");
    ReferenceModel model(model_settings, hand_routine({sample(0, 0.5)}, 1000, {}, 0.5));
    ReferenceUsb device(model, DevicePace::kRealTime);
    UsbLoopSettings settings;
    settings.address.wrapped_fd = device.plug();
    settings.ticks = 300;
    settings.servo_priority = settings.usb_priority = 0;
    settings.patience_s = 120;
    device.start();
    const UsbLoopAccount account = run_usb_loop(session, settings);
    CAPTURE(account.trouble);
    CHECK(account.ticks == 300);
    CHECK(account.late[0] + account.late[1] + account.late[2] + account.late[3] == 300);
    CHECK(account.armed_ticks > 0);
    CHECK(account.armings >= 1);
    CHECK(account.contact_ticks == 0);
    CHECK(account.link.connects == 1);
    CHECK(account.link.disconnects == 0);
    CHECK(account.lateness.count == 300);
    CHECK(account.tick.count == 300);
    CHECK(account.report_interval.count > 0);
    CHECK(account.answer.count > 0);
    for (const Quantiles* q : {&account.lateness, &account.tick, &account.report_interval,
                               &account.send_interval, &account.answer}) {
      CHECK(in_order(*q));
    }
    CHECK(account.servo_error == 0);
  }

  TEST_CASE("run: without a device nothing is counted, and why is said") {
    CoreSession session(test::scene_of(test::tetrahedron(), test::box(0.1, 0.06, 0.05)), "scene");
    UsbLoopSettings settings;
    settings.address.wrapped_fd = -1;
    settings.address.vendor_id = 0x1209;
    settings.address.product_id = 0x000f;
    settings.servo_priority = settings.usb_priority = 0;
    settings.patience_s = 0.05;
    const UsbLoopAccount account = run_usb_loop(session, settings);
    CHECK(account.ticks == 0);
    CHECK(account.armings == 0);
    CHECK_FALSE(account.trouble.empty());
    CHECK(account.tick.count == 0);
  }
}

}  // namespace haptic::sim
