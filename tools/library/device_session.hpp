// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A session on a device that run_device holds: started, read from memory, stopped, ended. Nothing
/// of the device and its loop is in this process.

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "hal/realtime/shared_memory.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/library/open_session.hpp"
#include "tools/session/session_channel.hpp"
#include "tools/session/session_records.hpp"

namespace haptic::tools {

struct DeviceSettings {
  std::string config;  ///< path of a configuration of run_device
  double history_s = 0;
  std::uint32_t hands = 0;  ///< 0: as the configuration has
};

/// run_device as the library finds it: the path in HAPTIC_RUN_DEVICE; the folder bin beside that of
/// the library; PATH. Empty: `text` says where it was looked for.
[[nodiscard]] std::string find_run_device(std::string& text);

class DeviceSession final : public OpenSession {
 public:
  /// `view`: of the scene.
  DeviceSession(std::span<const std::byte> scene, const SceneView& view,
                const DeviceSettings& settings);
  ~DeviceSession() override;

  /// HAPTIC_OK, or an error number and `text`.
  [[nodiscard]] int start(std::string& text);

  void close() noexcept override;
  [[nodiscard]] bool closed() const noexcept override { return closed_.load(); }
  [[nodiscard]] std::size_t count() const noexcept override { return hello_.devices; }

  void state(std::size_t hand, haptic_state& state) const noexcept override;
  [[nodiscard]] SessionVerdict verdict(std::size_t hand) const noexcept override;
  [[nodiscard]] std::size_t history(std::size_t hand, std::span<haptic_tick> ticks) const override;
  void gains(haptic_gains& gains) const noexcept override;
  void device(std::size_t hand, haptic_device_status& status) const noexcept override;
  [[nodiscard]] std::size_t events(std::span<haptic_event> events) const noexcept override;

  [[nodiscard]] int move_hand(const haptic_hand_goal& /*goal*/,
                              std::uint64_t& /*number*/) override {
    return HAPTIC_ERROR_DEVICE;
  }
  [[nodiscard]] int hold(std::size_t /*hand*/, haptic_hold /*hold*/) override {
    return HAPTIC_ERROR_DEVICE;
  }
  // The hand holds its part all through, and the others stand.
  [[nodiscard]] int hold_part(std::uint32_t /*part*/) override { return HAPTIC_ERROR_PART; }
  [[nodiscard]] int release_part() override { return HAPTIC_ERROR_PART; }
  [[nodiscard]] int move_fixed(const haptic_frame& frame) override;
  [[nodiscard]] int drive(std::uint32_t /*part*/, const haptic_frame& /*frame*/) override {
    return HAPTIC_ERROR_PART;
  }
  void stop() noexcept override;
  [[nodiscard]] std::size_t bodies(std::span<haptic_body> /*bodies*/) const override { return 0; }
  [[nodiscard]] std::size_t driven(std::span<haptic_driven> /*driven*/) const noexcept override {
    return 0;
  }

 private:
  [[nodiscard]] int spawn(const std::string& program, int socket);
  [[nodiscard]] int shake_hands(const std::string& program, std::string& text);
  [[nodiscard]] int take_hello(SessionMessage& message, std::string& text);
  [[nodiscard]] int failure_of(const std::string& program, std::string& text);
  [[nodiscard]] SessionStatus status() const noexcept;
  [[nodiscard]] SessionTick tick(std::size_t process, std::size_t hand) const noexcept;
  void live() noexcept;
  [[nodiscard]] bool waits_for_end(int timeout_ms) noexcept;
  void kill_program() noexcept;
  void end_unwatched() noexcept;

  DeviceSettings settings_;
  std::array<std::uint8_t, 32> scene_hash_;
  double asked_n_per_m_ = 0, asked_nm_per_rad_ = 0;  ///< stiffness of the scene
  std::int64_t opened_ns_ = 0;
  hal::SharedMemory down_;
  SessionDown* to_program_ = nullptr;
  std::unique_ptr<NewestWriter<FrameRecord>> frame_writer_;
  FrameRecord frame_;
  Descriptor socket_, program_, said_;  ///< program_: a pidfd; said_: its standard error
  int pid_ = -1;
  SessionHello hello_;
  SharedView up_;
  std::array<SharedView, kSessionProcesses> ticks_;
  std::atomic<bool> closed_{false}, has_ended_{false}, was_killed_{false};
  std::atomic<int> exit_status_{-1};  ///< of waitid; -1: not known
  std::atomic<int> lives_{0};         ///< 1: the thread is there; below: it cannot be
  mutable std::mutex end_mutex_;
  std::condition_variable end_;
  std::thread thread_;
};

}  // namespace haptic::tools
