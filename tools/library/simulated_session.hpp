// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo loop in threads of this process, on a simulated handle that a simulated hand leads
/// from goal to goal, or on two of them, one for each hand of the scene: driver, link, output
/// guard, tick and loop are those of run_device.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "hal/realtime/servo_loop.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "rt_core/two_hand_tick.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/haptic.h"
#include "tools/library/session_line.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

struct SessionSettings {
  std::int64_t period_ns = 1'000'000;
  double history_s = 0;
  int priority = 0;
  haptic_hold hold = HAPTIC_RELEASE;
  std::size_t devices = 1;  ///< as many as hands are led
};

/// Owner: any thread; `state` from any, the others from one at a time but where they say so.
class SimulatedSession {
 public:
  /// @param scene  opened before: it is one, with a hand for each device.
  SimulatedSession(std::span<const std::byte> scene, const SessionSettings& settings);
  ~SimulatedSession() { close(); }
  SimulatedSession(const SimulatedSession&) = delete;
  SimulatedSession& operator=(const SimulatedSession&) = delete;

  /// HAPTIC_OK, or that the threads cannot be had.
  [[nodiscard]] int start();
  void close() noexcept;
  [[nodiscard]] bool closed() const noexcept { return closed_.load(std::memory_order_acquire); }

  /// Devices, and hands that are led.
  [[nodiscard]] std::size_t count() const noexcept { return lines_.size(); }
  /// One of them.
  [[nodiscard]] SessionLine& line(std::size_t hand) noexcept { return *lines_[hand]; }
  [[nodiscard]] const SessionLine& line(std::size_t hand) const noexcept { return *lines_[hand]; }

  [[nodiscard]] std::size_t history(std::size_t hand, std::span<haptic_tick> ticks) const {
    return lines_[hand]->history(ticks, opened_ns_);
  }
  /// Any thread, without waiting.
  void gains(haptic_gains& gains) const noexcept;
  /// Lets go of what is held and waits until the hand is empty, 2 s at most; the next tick takes
  /// `part`. HAPTIC_OK; HAPTIC_ERROR_PART; HAPTIC_ERROR_BUSY: it has not let go. Any thread.
  [[nodiscard]] int hold_part(std::uint32_t part);
  /// Any thread.
  [[nodiscard]] int release_part();
  /// As many as there is room for. @return how many there are; 0: the scene has one moving part.
  /// Any thread.
  [[nodiscard]] std::size_t bodies(std::span<haptic_body> bodies) const;
  /// The fixed parts are there; a pose that is none takes the force away.
  void move_fixed(const haptic_frame& frame) noexcept;
  /// The driven part is there. False: no such part is driven.
  [[nodiscard]] bool drive(std::uint32_t part, const haptic_frame& frame) noexcept;
  /// As many as there is room for. @return how many there are. Any thread.
  [[nodiscard]] std::size_t driven(std::span<haptic_driven> driven) const noexcept;
  /// Any thread.
  void stop() noexcept;

  mutable std::mutex mutex;  ///< of those that are for one thread at a time
  std::mutex frame_mutex;    ///< of move_fixed and drive: a long history makes no pose late

 private:
  [[nodiscard]] int go_on_to(std::uint32_t part);
  static void watch_first(void* self, const ServoInput& input, const ServoResult& result);
  static void watch_second(void* self, const ServoInput& input, const ServoResult& result);
  void note(std::size_t hand, const ServoInput& input, const ServoResult& result) noexcept;
  void make_loop();

  SessionSettings settings_;
  double asked_n_per_m_ = 0, asked_nm_per_rad_ = 0;  ///< stiffness of the scene as it was given
  std::string lowered_;  ///< why less is rendered; empty: it is rendered
  SceneBytes scene_, core_memory_;
  SceneView view_;
  std::unique_ptr<HeldParts> parts_;  ///< null: the scene has one moving part
  HapticCore* core_ = nullptr;        ///< null: the scene has parts
  mutable std::mutex part_mutex_;     ///< of their hand, between ticks
  FrameRecord frame_;
  NewestRecord<FrameRecord> frames_;
  NewestWriter<FrameRecord> frame_writer_{frames_};
  /// Stream of a driven part, by their order.
  struct DrivenStream {
    FrameRecord last;
    std::optional<NewestWriter<FrameRecord>> writer;
  };
  std::array<NewestRecord<FrameRecord>, kMostDriven> driven_;
  std::array<DrivenStream, kMostDriven> driven_streams_;
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
