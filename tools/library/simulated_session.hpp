// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo loop in threads of this process, on a simulated handle that a simulated hand leads
/// from goal to goal, or on two of them, one for each hand of the scene: driver, link, output
/// guard, tick and loop are those of run_device.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "hal/realtime/servo_loop.hpp"
#include "rt_core/servo_tick.hpp"
#include "rt_core/two_hand_tick.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/haptic.h"
#include "tools/library/open_session.hpp"
#include "tools/library/session_line.hpp"
#include "tools/library/session_parts.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

struct SessionSettings {
  std::int64_t period_ns = 1'000'000;
  double history_s = 0;
  int priority = 0;
  haptic_hold hold = HAPTIC_RELEASE;
  std::size_t devices = 1;  ///< as many as hands are led
};

class SimulatedSession final : public OpenSession {
 public:
  /// @param scene  opened before: it is one, with a hand for each device.
  SimulatedSession(std::span<const std::byte> scene, const SessionSettings& settings);
  ~SimulatedSession() override { close(); }

  /// HAPTIC_OK, or that the threads cannot be had.
  [[nodiscard]] int start();
  void close() noexcept override;
  [[nodiscard]] bool closed() const noexcept override {
    return closed_.load(std::memory_order_acquire);
  }
  [[nodiscard]] std::size_t count() const noexcept override { return lines_.size(); }

  void state(std::size_t hand, haptic_state& state) const noexcept override {
    lines_[hand]->notes().state(state);
  }
  [[nodiscard]] SessionVerdict verdict(std::size_t hand) const noexcept override {
    return lines_[hand]->notes().verdict();
  }
  [[nodiscard]] std::size_t history(std::size_t hand, std::span<haptic_tick> ticks) const override {
    return lines_[hand]->notes().history(ticks, opened_ns_);
  }
  void gains(haptic_gains& gains) const noexcept override;
  void device(std::size_t hand, haptic_device_status& status) const noexcept override;
  /// It has none.
  [[nodiscard]] std::size_t events(std::span<haptic_event> /*events*/) const noexcept override {
    return 0;
  }
  [[nodiscard]] int move_hand(const haptic_hand_goal& goal, std::uint64_t& number) override {
    number = lines_[goal.hand]->move_hand(goal.pose, goal.seconds);
    return HAPTIC_OK;
  }
  [[nodiscard]] int hold(std::size_t hand, haptic_hold hold) override {
    lines_[hand]->hold(hold);
    return HAPTIC_OK;
  }
  [[nodiscard]] int hold_part(std::uint32_t part) override {
    return parts_.hold_part(part, settings_.period_ns, closed_);
  }
  [[nodiscard]] int release_part() override { return parts_.release_part(); }
  [[nodiscard]] std::size_t bodies(std::span<haptic_body> bodies) const override {
    return parts_.bodies(lines_[0]->notes().held(), bodies);
  }
  [[nodiscard]] int move_fixed(const haptic_frame& frame) override;
  [[nodiscard]] int drive(std::uint32_t part, const haptic_frame& frame) override;
  [[nodiscard]] std::size_t driven(std::span<haptic_driven> driven) const noexcept override {
    return write_driven(lines_[0]->notes().held(), driven);
  }
  void stop() noexcept override;

 private:
  static void watch_first(void* self, const ServoInput& input, const ServoResult& result);
  static void watch_second(void* self, const ServoInput& input, const ServoResult& result);
  void note(std::size_t hand, const ServoInput& input, const ServoResult& result) noexcept;
  void make_loop();

  SessionSettings settings_;
  double asked_n_per_m_ = 0, asked_nm_per_rad_ = 0;  ///< stiffness of the scene as it was given
  std::string lowered_;  ///< why less is rendered; empty: it is rendered
  SceneBytes scene_;
  SceneView view_;
  SessionParts parts_;
  std::vector<std::unique_ptr<SessionLine>> lines_;  ///< by hand
  std::optional<ServoTick> tick_;
  std::optional<TwoHandTick> two_tick_;  ///< one of the two
  std::optional<hal::ServoLoop> loop_;
  std::int64_t opened_ns_ = 0;
  std::atomic<bool> stop_{false}, closed_{false};
  std::atomic<int> begun_{-1};  ///< errno of what the servo thread asked for; -1: not yet known
  std::thread servo_;
};

}  // namespace haptic::tools
