// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device that is no USB packet device, as a bridge sees it: a service, a daemon, a vendor's
/// library, servos on a serial bus. What is particular to it is behind these five functions;
/// period, watchdog, cut, sequence, the host and its end are those of bridge_service.hpp.

#include <poll.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "hal/bridge/device_tap.hpp"
#include "hal/device.hpp"

namespace haptic::hal {

/// A device that is open.
struct BridgeFacts {
  /// Stiffness, force and rates feed the gate of the session; 0 where the device does not say. The
  /// report period is the one at which `read` has something new. The watchdog is the bridge's.
  /// Name, serial number and latency go to the host, as does the largest gap of a gripper.
  DeviceCapabilities capabilities;
  std::string name;   ///< "Inverse3, serial 04a1, service 3.5.1": for people
  std::string words;  ///< what its owner has to know; may be empty
  std::string needs;  ///< of the words: what its owner has to do before it can be used
  /// Where BridgeRead::kSame means that nothing moves, so that the sample before is true now; else
  /// it keeps its time.
  bool rests_in_silence = false;
};

/// A state of the device.
struct BridgeSample {
  std::int64_t sampled_ns = 0;  ///< of CLOCK_MONOTONIC: when the device measured it, or it came
  PoseRecord pose_dh;           ///< handle point and handle axes in D
  TwistRecord twist_d;          ///< where twist_valid
  bool twist_valid = false;
  bool calibrated = false;  ///< the pose is absolute and true
  bool emergency_stop = false;
  std::uint32_t switches = 0;  ///< bit set = pressed
  Real gap_m = -1;             ///< of the gripper; below 0: none is measured now
  std::uint32_t faults = 0;    ///< DeviceFault, lower half: overheated, drive fault
};

enum class BridgeRead : std::uint8_t {
  kNew = 0,  ///< `sample` is new
  kSame,     ///< nothing new, which for this device says nothing: the sample before stands
  kSilent,   ///< nothing new, though there should be: no report goes to the host
  kLost      ///< unplugged, the service has ended: `close` and, after a while, `open`
};

/// Owner: the bridge's thread, which makes every call. `open` and `close` may take a while, the
/// others return within a fraction of the period: what can block belongs on a thread of the
/// device's own, behind a newest value.
class BridgedDevice {
 public:
  virtual ~BridgedDevice() = default;

  /// Looks for the device once, without waiting for it to come. @return true: open; else `why`
  /// says what is missing and what helps, in a sentence.
  [[nodiscard]] virtual bool open(std::string& why) = 0;
  /// Constant while it is open.
  [[nodiscard]] virtual const BridgeFacts& facts() const = 0;
  /// Takes in what has come; never waits.
  [[nodiscard]] virtual BridgeRead read(std::int64_t now_ns, BridgeSample& sample) = 0;
  /// Hands over the wrench that the device exerts from now on: within its capabilities, shortened
  /// already. Called with each command as it comes, and every period while the drives are on.
  /// False: it could not be handed over.
  [[nodiscard]] virtual bool write(std::int64_t now_ns, const Wrench& wrench_d) = 0;
  /// Force off, now: the session's end, the watchdog, a lost host. Called again every period until
  /// it has been handed over. False: not yet.
  [[nodiscard]] virtual bool release(std::int64_t now_ns) = 0;
  /// After `release`, or a loss. Also of a device that is not open.
  virtual void close() noexcept = 0;

  /// For poll(2): wakes the bridge before its period is over, so that `read` is called at once.
  /// A negative descriptor: none.
  [[nodiscard]] virtual pollfd watched() const noexcept { return {-1, 0, 0}; }
  /// True: once it has been open, the process may give up to start programs, to change files, to
  /// reach other processes. A device whose library is closed code says false.
  [[nodiscard]] virtual bool can_be_confined() const noexcept { return true; }

  /// All that it says to its device and hears of it goes through `tap` from the next `open` on.
  void set_tap(std::shared_ptr<DeviceTap> tap) noexcept { tap_ = std::move(tap); }

 protected:
  /// Null: nobody listens. Shared with threads that may outlive this.
  [[nodiscard]] const std::shared_ptr<DeviceTap>& tap() const noexcept { return tap_; }

 private:
  std::shared_ptr<DeviceTap> tap_;
};

}  // namespace haptic::hal
