// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One device as the thread that holds it sees it, over any connection: a bus (usb/usb_link.hpp)
/// or the same process (local/local_link.hpp).

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/device.hpp"
#include "hal/device_mailbox.hpp"

namespace haptic::hal {

// Counters of a link: counted on the USB thread, read from any.

/// Since the link was made, for reports.
struct LinkCounters {
  std::uint64_t reports = 0, states = 0, bad_length = 0, bad_check = 0, bad_number = 0,
                not_advancing = 0, sent = 0, send_busy = 0, send_failed = 0, in_failed = 0,
                answers_late = 0, connects = 0, disconnects = 0, guard_held = 0;
};

/// Each counter has one writer; readers see each of them whole, not all of one moment.
inline void count_one(std::uint64_t& counter) noexcept {
  std::atomic_ref<std::uint64_t>(counter).fetch_add(1, std::memory_order_relaxed);
}

[[nodiscard]] LinkCounters snapshot(LinkCounters& live) noexcept;

/// Norms of a wrench.
struct HeldWrench {
  double force_n = 0, torque_nm = 0;
};

class LinkObserver;

/// Called on the link's thread: after a connection, before its first reports are served, and when
/// they have ended, before the device is put away. From then on, and before, a link does what may
/// take long: it finds, opens, claims, reads names, sends firmware, closes.
struct FlowWatch {
  void (*called)(void* context, bool flows) noexcept = nullptr;
  void* context = nullptr;
  bool flows = false;

  void tell(bool now) noexcept {
    if (now == flows) return;
    flows = now;
    if (called != nullptr) called(context, now);
  }
};

/// Owner: the link's thread, which calls `poll` and `close`; what may be called from any thread
/// says so.
class DeviceLink {
 public:
  virtual ~DeviceLink() = default;

  /// Before the first poll; null: none.
  virtual void observe(LinkObserver* observer) noexcept = 0;
  /// As `observe`.
  void watch_flow(void (*called)(void* context, bool flows) noexcept, void* context) noexcept {
    flow_watch_.called = called;
    flow_watch_.context = context;
  }

  /// One turn: tries to connect where there is no device, else takes reports and sends commands,
  /// waiting at most `timeout_ns`. Call it again at once, with at most half a period. Never throws;
  /// the status is the link's condition, kOk while reports can flow.
  virtual HalStatus poll(std::int64_t timeout_ns) noexcept = 0;

  /// Orderly end: ramp to zero and its delivery (bounded: 0.3 s), then the device is closed. A poll
  /// after it opens again.
  virtual void close() noexcept = 0;

  /// From any thread: makes poll return soon; until `close` nothing is opened any more.
  virtual void cancel() noexcept = 0;
  /// From any thread: the servo process ended; ramp to zero, latch kLinkServoLost.
  virtual void servo_lost() noexcept = 0;
  /// From any thread: ramp to zero at once, latch kLinkStopCalled until the operator has let go and
  /// armed again. Without a device: when one is there.
  virtual void emergency_stop() noexcept = 0;
  /// From any thread: another servo process has taken over and has its own mailbox, since what a
  /// killed one left half done in its own cannot be known. `mailbox` outlives the link, and so does
  /// the one before.
  virtual void use_mailbox(const DeviceMailbox& mailbox) noexcept = 0;

  // From any thread.
  [[nodiscard]] virtual LinkState state() const noexcept = 0;
  /// The largest wrench that the device may have now: of the command that it accepted last, or of
  /// one sent since.
  [[nodiscard]] virtual HeldWrench held() const noexcept = 0;
  /// Gap of the device's gripper by its last report; empty: it measures none, or is not there.
  [[nodiscard]] virtual std::optional<double> gap_m() const noexcept { return std::nullopt; }
  [[nodiscard]] virtual LinkCounters counters() const noexcept = 0;
  /// Text of the last trouble and what to do, for people; not for the loop.
  [[nodiscard]] virtual std::string trouble() const = 0;

 protected:
  FlowWatch flow_watch_;
};

}  // namespace haptic::hal
