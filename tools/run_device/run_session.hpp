// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A run for a program with a session (tools/session): what that asks for, what it is told, and the
/// end of it.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "hal/realtime/device_guardian.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/run_device/device_config.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/session/session_channel.hpp"
#include "tools/session/session_records.hpp"

namespace haptic::tools {

/// The newest tick of a device, made of the servo's ticks. Owner: the servo thread.
class SessionTaker {
 public:
  /// `parameters`: of the tick, its grip point and start from the scene.
  explicit SessionTaker(const ServoParameters& parameters) noexcept
      : map_(parameters.map), start_(parameters.start), switches_(parameters.switches) {}
  /// Takes one tick, in order. Cost: constant.
  void take(const ServoInput& input, const ServoResult& result,
            const SessionVerdict& verdict) noexcept;
  [[nodiscard]] SessionTick& tick() noexcept { return tick_; }

 private:
  WorkspaceMap map_;  ///< of the last begin
  StartPlace start_;
  SwitchMap switches_;
  SessionTick tick_;
};

/// Owner: the thread that runs the session, but where it says so.
class RunSession {
 public:
  enum class Call : std::uint8_t {
    kNone = 0,
    kStop,   ///< of the force
    kClose,  ///< of the run
    kGone,   ///< the program has ended
    kWrong   ///< it says what no session says
  };

  /// Takes the request from `socket`, which is this object's from now on. @throws InputError: it is
  /// none, or of another version.
  explicit RunSession(int socket);
  ~RunSession();
  RunSession(const RunSession&) = delete;
  RunSession& operator=(const RunSession&) = delete;

  /// As the session wants it. @throws InputError: it is of another scene, or of other hands.
  void fit(DeviceConfig& config) const;

  /// In a servo process: what only the process that holds the devices writes is let go of.
  void leave() noexcept { up_.leave(); }

  // Once the processes are forked.
  /// Answers the request. @throws OsError
  void begin(const hal::DeviceGuardian& guardian, const DeviceConfig& config,
             const SceneBytes& scene);
  /// Where the program's end is heard first: `gone` is called on a thread of this object, at the
  /// priority given where that is granted.
  void listen(std::function<void()> gone, int priority);
  /// `gone` is not called any more.
  void end_listening() noexcept;
  /// For DeviceGuardian::listen: readable when `take` has something.
  [[nodiscard]] int descriptor() const noexcept { return all_.get(); }
  /// The newest word of the program; at most kMostCalls messages are looked at.
  [[nodiscard]] Call take() noexcept;
  /// The devices are held.
  void tell_begun() noexcept;
  [[nodiscard]] bool has_begun() const noexcept { return has_begun_; }
  [[nodiscard]] SessionStatus& status() noexcept { return status_; }
  void publish() noexcept { status_writer_->publish(status_); }
  void tell(const RunEvent& event) noexcept;

 private:
  static constexpr int kMostCalls = 16, kMostRequest_ms = 5000;
  [[nodiscard]] bool is_alive() const noexcept;
  void wait_for_end() noexcept;

  Descriptor socket_, program_, gone_, all_;  ///< all_: epoll of the others
  SessionAsk ask_;
  SharedView down_;
  hal::SharedMemory up_;
  std::unique_ptr<NewestWriter<SessionStatus>> status_writer_;
  std::unique_ptr<EventWriter> events_;
  SessionStatus status_;
  bool has_begun_ = false;
  std::function<void()> when_gone_;
  std::atomic<bool> done_{false};
  std::thread listener_;
};

}  // namespace haptic::tools
