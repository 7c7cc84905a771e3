// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Between the bridge's thread, which must never wait, and the thread on which a vendor's library
/// is called, which may: the newest sample one way, the newest order the other, and the rules by
/// which force comes and goes.

#include <poll.h>

#include <atomic>
#include <cstdint>

#include "hal/bridge/bridged_device.hpp"
#include "rt_core/exchange/newest_record.hpp"

namespace haptic::tools {

enum class VendorResult : std::uint8_t {
  kDone = 0,
  kRefused,  ///< this time: no usable pose; the force was not taken over, or the device dropped it
  kLost      ///< unplugged, or its library has given up: no more calls
};

/// The device by its library's calls, in D and SI units. Called by the library's thread alone, once
/// each in this order per turn.
class VendorHandle {
 public:
  virtual ~VendorHandle() = default;
  /// Fills `sample` but for its time; on kRefused what it has filled is thrown away.
  [[nodiscard]] virtual VendorResult sense(hal::BridgeSample& sample) noexcept = 0;
  /// Drives on: exerts `wrench_d`. Off: no force, also where it was on before.
  [[nodiscard]] virtual VendorResult exert(bool drives, const Wrench& wrench_d) noexcept = 0;
};

struct VendorOrder {
  std::int64_t written_ns = 0;
  std::uint64_t drives = 0;   ///< 1: exert the wrench
  std::uint64_t release = 0;  ///< counts the times that the force was to be taken away
  WrenchRecord wrench_d;
};

struct VendorState {
  std::uint64_t samples = 0;   ///< counts; the newest of them is `sample`
  std::uint64_t released = 0;  ///< the last release that was carried out
  std::uint32_t lost = 0;
  std::uint32_t holding = 0;  ///< ordered to drive, and does not: cut, or the order was too large
  hal::BridgeSample sample;
};

struct VendorLimits {
  std::int64_t period_ns = 1'000'000;  ///< of turns
  Real max_force_n = 0, max_torque_nm = 0;
  /// A release that the library's thread has not carried out after so long: the device is lost, and
  /// closing it is what is left. 0: it has a watchdog of its own, which cuts the force earlier.
  std::int64_t longest_release_ns = 0;
};

/// Rules of force, on the library's thread:
/// - it comes on with an order of at most kLargestStart of the device's limits, never with more;
/// - an order that is older than kOldest_ns, a turn that comes later than that after the last one,
/// a
///   call that failed, a device that dropped its force cut it off, which the sample says as a drive
///   fault, until the bridge has released it;
/// - what is not finite is exerted as nothing.
class VendorExchange {
 public:
  static constexpr std::int64_t kOldest_ns = 20'000'000;
  static constexpr Real kLargestStart = 0.05_r;
  /// Turns in a row without a usable pose, after which the device is lost.
  static constexpr unsigned kMostRefused = 50;
  /// A call that has not returned for so long: the device is lost.
  static constexpr std::int64_t kLongestSilence_ns = 3'000'000'000;

  explicit VendorExchange(const VendorLimits& limits);
  ~VendorExchange();
  VendorExchange(const VendorExchange&) = delete;
  VendorExchange& operator=(const VendorExchange&) = delete;

  /// The bridge's thread. As BridgedDevice has them; silent from two periods without a
  /// sample on, lost from kLongestSilence_ns on, or after a release that takes too long.
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) noexcept;
  [[nodiscard]] bool write(std::int64_t now_ns, const Wrench& wrench_d) noexcept;
  [[nodiscard]] bool release(std::int64_t now_ns) noexcept;
  /// A release has not been carried out within VendorLimits::longest_release_ns.
  [[nodiscard]] bool is_held(std::int64_t now_ns) noexcept;
  /// Readable once there is a sample.
  [[nodiscard]] pollfd watched() const noexcept { return {woken_, POLLIN, 0}; }
  /// From the next turn on there is no force.
  void stop() noexcept { stop_.store(true); }
  [[nodiscard]] bool has_stopped() const noexcept { return ended_.load(); }

  /// The library's thread: senses, exerts, publishes. No lock, no heap, no exception. False: the
  /// device is lost, and nothing more may be called.
  [[nodiscard]] bool turn(VendorHandle& handle) noexcept;
  [[nodiscard]] bool is_stopping() const noexcept { return stop_.load(); }

 private:
  [[nodiscard]] bool is_small(const Wrench& wrench) const noexcept;
  void decide(const VendorOrder& order, std::int64_t now_ns) noexcept;
  void publish() noexcept;

  const VendorLimits limits_;
  int woken_ = -1;
  NewestRecord<VendorOrder> orders_;
  NewestRecord<VendorState> states_;
  std::atomic<bool> stop_{false}, ended_{false};
  // The bridge's thread has these.
  NewestWriter<VendorOrder> give_order_{orders_};
  NewestReader<VendorState> look_{states_};
  VendorOrder order_;
  std::uint64_t seen_ = 0;
  std::int64_t release_ns_ = 0;  ///< when the release that is not carried out was asked for
  // The library's thread has these.
  NewestWriter<VendorState> tell_{states_};
  NewestReader<VendorOrder> hear_{orders_};
  VendorState state_;
  bool on_ = false, cut_ = false;
  unsigned refused_ = 0;
  std::int64_t last_turn_ns_ = 0;
};

}  // namespace haptic::tools
