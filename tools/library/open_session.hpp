// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A session as the C interface has it, on whichever device.

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

#include "rt_core/base/pose.hpp"
#include "tools/library/haptic.h"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// Owner: any thread. What reads, `stop` and the parts: from any; the others from one at a time,
/// with `mutex` or `frame_mutex`.
class OpenSession {
 public:
  virtual ~OpenSession() = default;
  OpenSession(const OpenSession&) = delete;
  OpenSession& operator=(const OpenSession&) = delete;

  /// One tick, where the device's loop is the caller's. HAPTIC_ERROR_DEVICE: the loop is the
  /// session's.
  [[nodiscard]] virtual int tick(const haptic_servo_input& /*input*/,
                                 haptic_servo_output& /*output*/) noexcept {
    return HAPTIC_ERROR_DEVICE;
  }
  [[nodiscard]] virtual int contacts(std::span<haptic_contact> /*contacts*/, std::size_t& /*count*/,
                                     Wrench& /*rest*/) noexcept {
    return HAPTIC_ERROR_DEVICE;
  }
  virtual void close() noexcept = 0;
  [[nodiscard]] virtual bool closed() const noexcept = 0;
  /// Devices, and hands that are led.
  [[nodiscard]] virtual std::size_t count() const noexcept = 0;
  /// False in a process that was forked from the session's: it has none of its threads.
  [[nodiscard]] bool is_of_this_process() const noexcept { return getpid() == process_; }

  virtual void state(std::size_t hand, haptic_state& state) const noexcept = 0;
  [[nodiscard]] virtual SessionVerdict verdict(std::size_t hand) const noexcept = 0;
  /// With `mutex`.
  [[nodiscard]] virtual std::size_t history(std::size_t hand,
                                            std::span<haptic_tick> ticks) const = 0;
  virtual void gains(haptic_gains& gains) const noexcept = 0;
  virtual void device(std::size_t hand, haptic_device_status& status) const noexcept = 0;
  /// The newest, oldest first. @return how many.
  [[nodiscard]] virtual std::size_t events(std::span<haptic_event> events) const noexcept = 0;

  // An error number each, with `mutex`. HAPTIC_ERROR_DEVICE: the hand is a person's.
  [[nodiscard]] virtual int move_hand(const haptic_hand_goal& goal, std::uint64_t& number) = 0;
  [[nodiscard]] virtual int hold(std::size_t hand, haptic_hold hold) = 0;
  // An error number each.
  [[nodiscard]] virtual int hold_part(std::uint32_t part) = 0;
  [[nodiscard]] virtual int release_part() = 0;
  /// With `frame_mutex`.
  [[nodiscard]] virtual int move_fixed(const haptic_frame& frame) = 0;
  [[nodiscard]] virtual int drive(std::uint32_t part, const haptic_frame& frame) = 0;
  /// Any thread, without waiting.
  virtual void stop() noexcept = 0;

  /// As many as there is room for. @return how many there are; 0: the scene has one moving part.
  [[nodiscard]] virtual std::size_t bodies(std::span<haptic_body> bodies) const = 0;
  /// As many as there is room for. @return how many there are.
  [[nodiscard]] virtual std::size_t driven(std::span<haptic_driven> driven) const noexcept = 0;

  mutable std::mutex mutex;  ///< of those that are for one thread at a time
  std::mutex frame_mutex;    ///< of move_fixed and drive: a long history makes no pose late

 protected:
  OpenSession() noexcept : process_(getpid()) {}

 private:
  pid_t process_;
};

}  // namespace haptic::tools
