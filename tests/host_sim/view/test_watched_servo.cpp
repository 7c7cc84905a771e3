// SPDX-License-Identifier: Apache-2.0
// A servo tick whose flight recorder is watched by eight clients, of which one stands still: the
// same bits, and, as tests/host_sim/view/check_watched_servo counts them, the same instructions.
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/servo_tick.hpp"
#include "tests/host_sim/view/live_clients.hpp"
#include "tools/live/live_trace.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

constexpr std::size_t kTicks = 2000, kRecords = 4096;
constexpr std::int64_t kPeriod_ns = 1'000'000;
/// From one tick to the next at the least, so that clients come to their turns.
constexpr auto kPause = std::chrono::microseconds(300);

/// What a drive has made: hash of the core's state and command of each tick.
struct DriveOutput {
  std::uint64_t hash = 0;
  Wrench command_d;
  bool operator==(const DriveOutput& other) const {
    return hash == other.hash && command_d.force_w == other.command_d.force_w &&
           command_d.torque_w == other.command_d.torque_w;
  }
};

/// The deadman held, down onto the box, along it and up again.
haptic::DeviceState state_of(std::size_t k) {
  const double t = static_cast<double>(k) / static_cast<double>(kTicks);
  haptic::DeviceState state;
  state.sequence = k + 1;
  state.stamp_ns = 1'000'000'000 + static_cast<std::int64_t>(k) * kPeriod_ns;
  state.link = LinkState::kReady;
  state.switches = SwitchMap{}.deadman;
  state.pose_dh.p_m[0] = static_cast<Real>(0.01 * std::sin(9 * t));
  state.pose_dh.p_m[2] = static_cast<Real>(0.12 - 0.06 * std::sin(3.14159 * t));
  return state;
}

/// Ticks of a servo over a recorder that others may read.
class Drive {
 public:
  Drive()
      : bytes_(scene_of(tetrahedron(), box(0.1, 0.06, 0.05))),
        session_(bytes_, "sample", GoalContact::kLeftOut),
        memory_(FlightRecorder::bytes_for(kRecords)),
        recorder_(memory_.span()) {
    const hal::DeviceCapabilities device = hal::reference_capabilities();
    parameters_.limits = hal::limits_of(device, kPeriod_ns);
    const double* grip = session_.view().bodies()[0].reference_m;
    for (int k = 0; k < 3; ++k) parameters_.map.grip_a[k] = static_cast<Real>(grip[k]);
    tick_.emplace(session_.core(), parameters_, session_.view().header().capacity, &recorder_);
  }

  std::vector<DriveOutput> run() {
    std::vector<DriveOutput> out(kTicks);
    for (std::size_t k = 0; k < kTicks; ++k) {
      ServoInput input;
      input.state = state_of(k);
      input.now_ns = input.state.stamp_ns + kPeriod_ns / 2;
      const ServoResult result = tick_->step(input);
      out[k] = {result.rendered.state_hash, wrench_of(result.command.wrench_d)};
      touched_ += result.rendered.situation != ContactSituation::kNone ? 1u : 0u;
      std::this_thread::sleep_for(kPause);
    }
    return out;
  }

  [[nodiscard]] std::span<const std::byte> memory() const { return memory_.span(); }
  [[nodiscard]] const WorkspaceMap& map() const { return parameters_.map; }
  [[nodiscard]] std::size_t touched() const { return touched_; }

 private:
  std::vector<std::byte> bytes_;
  CoreSession session_;
  tools::SceneBytes memory_;
  FlightRecorder recorder_;
  ServoParameters parameters_;
  std::optional<ServoTick> tick_;
  std::size_t touched_ = 0;
};

/// Six pages that ask without a pause, a viewer, and one that asks for everything and never reads.
class Watchers {
 public:
  explicit Watchers(const ServedBoard& served)
      : served_(served), stalled_(served, "foxglove.websocket.v1") {
    std::string all = R"({"op":"subscribe","subscriptions":[)";
    for (int k = 0; k < 60; ++k)
      all += std::string(k == 0 ? "" : ",") + R"({"id":)" + std::to_string(k) + R"(,"channelId":)" +
             std::to_string(1 + k % 8) + "}";
    stalled_.send(all + "]}", true);
    for (std::size_t k = 0; k < 6; ++k) {
      threads_.emplace_back([this] {
        TestClient page(served_, "haptic.live.v1");
        std::uint64_t next = 0;
        while (!over_) {
          page.ask(next);
          const TestChunk chunk = chunk_of(page.read());
          next = chunk.head.first + chunk.ticks.size();
          ticks_ += chunk.ticks.size();
        }
      });
    }
    threads_.emplace_back([this] {
      TestClient viewer(served_, "foxglove.sdk.v1");
      viewer.send(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":5}]})", true);
      while (!over_) messages_ += viewer.read().empty() ? 0u : 1u;
    });
  }
  ~Watchers() {
    for (std::thread& thread : threads_) thread.join();
  }

  /// Each ends with its next message, or with the server.
  void end() { over_ = true; }
  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] std::uint64_t messages() const { return messages_; }

 private:
  const ServedBoard& served_;
  std::atomic<bool> over_{false};
  std::atomic<std::uint64_t> ticks_{0}, messages_{0};
  TestClient stalled_;
  std::vector<std::thread> threads_;
};

std::vector<DriveOutput> run_alone() { return Drive().run(); }

std::vector<DriveOutput> run_watched() {
  Drive drive;
  std::optional<TraceFollower> follower;
  std::unique_ptr<Watchers> watchers;  // ends after the server
  ServedBoard served(false, {}, [&](LiveBoard& board) {
    if (!follower) follower.emplace(std::vector{drive.memory()}, drive.map(), board);
    follower->look();
  });
  watchers = std::make_unique<Watchers>(served);
  std::vector<DriveOutput> out = drive.run();
  CHECK(drive.touched() > kTicks / 4);
  watchers->end();
  CHECK(served.server->counts().clients == 8);
  // They were not told nothing.
  CHECK(watchers->ticks() > kTicks);
  CHECK(watchers->messages() > 10);
  return out;
}

}  // namespace

TEST_SUITE("host_sim.watched_servo") {
  TEST_CASE("eight clients, one of which stands still: every hash and command as without them") {
    const std::vector<DriveOutput> alone = run_alone();
    CHECK(alone.front().hash != alone.back().hash);
    CHECK((alone == run_watched()));
  }

  // For check_watched_servo, which counts the instructions of the ticks of each.
  TEST_CASE("count: alone" * doctest::skip()) { CHECK(run_alone().size() == kTicks); }
  TEST_CASE("count: watched" * doctest::skip()) { CHECK(run_watched().size() == kTicks); }
}
