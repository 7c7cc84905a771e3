// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every value from one thread to another, in order, without waiting on either side: a ring of
/// fixed capacity. When it is full the new value is dropped and counted, so that a reader that is
/// late costs the writer nothing; right for traces and events, where each item counts. Works across
/// processes in shared memory: no pointers, address-free atomics.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace haptic {

/// One producer thread, one consumer thread; the two may change only at a point that both threads
/// have synchronised by other means. Positions count pushes and pops and wrap; their difference is
/// the fill. `Atomic`: as for NewestRecord.
template <class T, std::size_t capacity_count, template <class> class Atomic = std::atomic>
class SpscRing {
  using Position = Atomic<std::uint32_t>;
  static_assert(capacity_count > 0 && (capacity_count & (capacity_count - 1)) == 0 &&
                    capacity_count <= (std::size_t{1} << 31U),
                "a power of two: positions wrap at 2^32 without a seam");
  static_assert(std::is_trivially_copyable_v<T> ||
                    !std::is_same_v<Position, std::atomic<std::uint32_t>>,
                "copied while nobody else looks at it");
  static_assert(Position::is_always_lock_free);

 public:
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return capacity_count; }

  /// Producer. False: full, `value` is dropped and counted. Wait-free: one copy, at most two atomic
  /// operations.
  bool push(const T& value) noexcept {
    if (pushed_ - popped_seen_ == kCapacity) {
      // Acquire: the consumer's copies out of the slots it has let go are over before we write
      // there.
      popped_seen_ = tail_.load(std::memory_order_acquire);
      if (pushed_ - popped_seen_ >= kCapacity) {
        if (drops_ != std::numeric_limits<std::uint32_t>::max()) ++drops_;
        // Relaxed: a number by itself. The release of the next push takes it along.
        dropped_.store(drops_, std::memory_order_relaxed);
        return false;
      }
    }
    slots_[pushed_ & kMask] = value;
    ++pushed_;
    // Release: who sees this position sees the copy above it.
    head_.store(pushed_, std::memory_order_release);
    return true;
  }

  /// Consumer. False: empty, `value` unchanged. Wait-free: one copy, at most two atomic operations.
  bool pop(T& value) noexcept {
    if (pushed_seen_ == popped_) {
      // Acquire: the producer's copies into the slots below this position are seen.
      pushed_seen_ = head_.load(std::memory_order_acquire);
      if (pushed_seen_ == popped_) return false;
    }
    value = slots_[popped_ & kMask];
    ++popped_;
    // Release: the copy above is over before the producer, who acquires this position, writes
    // there.
    tail_.store(popped_, std::memory_order_release);
    return true;
  }

  /// Consumer: how many values were dropped since the ring was made; stays at 2^32 - 1. A drop that
  /// came before a value is counted by the time the value is popped.
  [[nodiscard]] std::uint32_t dropped() const noexcept {
    // Relaxed: the acquire in pop has already ordered it behind the values popped.
    return dropped_.load(std::memory_order_relaxed);
  }

 private:
  static constexpr std::uint32_t kCapacity = static_cast<std::uint32_t>(capacity_count);
  static constexpr std::uint32_t kMask = kCapacity - 1;

  std::array<T, capacity_count> slots_{};
  alignas(64) Position head_{0};          ///< pushes; written by the producer
  Position dropped_{0};                   ///< written by the producer
  alignas(64) Position tail_{0};          ///< pops; written by the consumer
  alignas(64) std::uint32_t pushed_ = 0;  ///< producer's own
  std::uint32_t popped_seen_ = 0, drops_ = 0;
  alignas(64) std::uint32_t popped_ = 0;  ///< consumer's own
  std::uint32_t pushed_seen_ = 0;
};

}  // namespace haptic
