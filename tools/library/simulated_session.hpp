// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo loop in threads of this process, on a simulated handle that a simulated hand leads
/// from goal to goal: driver, link, output guard, tick and loop are those of run_device.

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

#include "hal/drivers/reference_driver.hpp"
#include "hal/local/local_link.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/usb_thread.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/haptic.h"
#include "tools/run_device/simulated_peer.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// Order of the owner to the hand: handle poses in D.
struct HandOrder {
  std::uint64_t number = 0;  ///< of the goal; 0: none yet
  double pose_dh[7] = {0, 0, 0, 0, 0, 0, 1};
  double seconds = 0;
  std::uint64_t hold = HAPTIC_RELEASE;  ///< haptic_hold
};

/// Goes from where its last goal has led it to the next, without a jerk; orders and reached goals
/// cross threads without waiting.
class GuidedHand final : public SimulatedHand {
 public:
  HandWish wish(double t_s) noexcept override;                             ///< link's thread
  void order(const HandOrder& order) noexcept { writer_.publish(order); }  ///< one thread at a time
  [[nodiscard]] std::uint64_t reached() const noexcept {                   ///< any thread
    return reached_.load(std::memory_order_acquire);
  }
  /// Servo thread, after each tick.
  void note_fault(bool faulted) noexcept { faulted_.store(faulted, std::memory_order_relaxed); }
  /// Any thread: does not press until `allow_presses`; what is held stays held.
  void stop_presses() noexcept { stopped_.store(true, std::memory_order_relaxed); }
  void allow_presses() noexcept { stopped_.store(false, std::memory_order_relaxed); }
  [[nodiscard]] bool holds() const noexcept { return holds_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool presses(std::uint64_t hold, double t_s) noexcept;

  NewestRecord<HandOrder> orders_;
  NewestWriter<HandOrder> writer_{orders_};
  NewestReader<HandOrder> reader_{orders_};
  HandWish from_, now_;
  double from_s_ = 0;
  std::uint64_t number_ = 0;
  std::atomic<std::uint64_t> reached_{0};
  double pressed_s_ = 0, released_s_ = 0;  ///< since when, as the switch is
  std::atomic<bool> holds_{false}, faulted_{false}, stopped_{false};
};

struct SessionSettings {
  std::int64_t period_ns = 1'000'000;
  double history_s = 0;
  int priority = 0;
  haptic_hold hold = HAPTIC_RELEASE;
};

/// Owner: any thread; `state` from any, the others from one at a time but where they say so.
class SimulatedSession {
 public:
  /// @param scene  opened before: it is one.
  SimulatedSession(std::span<const std::byte> scene, const SessionSettings& settings);
  ~SimulatedSession() { close(); }
  SimulatedSession(const SimulatedSession&) = delete;
  SimulatedSession& operator=(const SimulatedSession&) = delete;

  /// HAPTIC_OK, or that the threads cannot be had.
  [[nodiscard]] int start();
  void close() noexcept;
  [[nodiscard]] bool closed() const noexcept { return closed_.load(std::memory_order_acquire); }

  /// Any thread, without waiting.
  void state(haptic_state& state) const noexcept;
  void gains(haptic_gains& gains) const noexcept;
  [[nodiscard]] SessionVerdict verdict() const noexcept;
  [[nodiscard]] std::size_t history(std::span<haptic_tick> ticks) const;
  /// `pose`: of A in W. @return the number of the goal.
  std::uint64_t move_hand(const double* pose, double seconds) noexcept;
  void hold(haptic_hold hold) noexcept;
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
  /// As the servo thread leaves it after a tick.
  struct NewestTick {
    haptic_state state;
    SessionVerdict verdict;
    HeldNow held;
  };
  static_assert(sizeof(NewestTick) % sizeof(RecordWord) == 0);

  [[nodiscard]] int go_on_to(std::uint32_t part);
  static void watch(void* self, const ServoInput& input, const ServoResult& result);
  void note(const ServoInput& input, const ServoResult& result) noexcept;

  SessionSettings settings_;
  double asked_n_per_m_ = 0, asked_nm_per_rad_ = 0;  ///< stiffness of the scene as it was given
  std::string lowered_;  ///< why less is rendered; empty: it is rendered
  SceneBytes scene_, core_memory_, history_memory_;
  SceneView view_;
  std::unique_ptr<HeldParts> parts_;  ///< null: the scene has one moving part
  HapticCore* core_ = nullptr;        ///< null: the scene has parts
  mutable std::mutex part_mutex_;     ///< of their hand, between ticks
  hal::ReferenceDriver driver_;
  ServoParameters parameters_;
  hal::MailboxMemory mailbox_;
  GuidedHand hand_;
  HandOrder order_;
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
  SimulatedPeer peer_;
  hal::LocalLink link_;
  hal::UsbThread link_thread_;
  FlightRecorder recorder_;
  ServoTick tick_;
  hal::ServoLoop loop_;
  SessionJudge judge_;  ///< servo thread
  NewestRecord<NewestTick> newest_;
  NewestWriter<NewestTick> newest_writer_{newest_};
  std::int64_t opened_ns_ = 0;
  std::atomic<bool> stop_{false}, closed_{false};
  std::atomic<int> begun_{-1};  ///< errno of what the servo thread asked for; -1: not yet known
  std::thread servo_;
};

}  // namespace haptic::tools
