// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Newest value from one thread to another, without waiting on either side: a triple buffer. The
/// writer fills a slot that nobody reads and swaps it with the middle one; the reader swaps the
/// middle one for its own when it is new. Values in between are lost, which is right for state and
/// force. Works across processes in shared memory: no pointers, address-free atomics.

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace haptic {

/// One writer thread, one reader thread. Index word: bits 0-1 the middle slot, bit 2 "newer than
/// what the reader has". `Atomic` is the type of the index word: another than std::atomic only
/// where every order of its operations is explored, and there the value may watch its own copies.
template <class T, template <class> class Atomic = std::atomic>
class LatestValue {
  using Index = Atomic<std::uint32_t>;
  static_assert(std::is_trivially_copyable_v<T> ||
                    !std::is_same_v<Index, std::atomic<std::uint32_t>>,
                "copied while nobody else looks at it");
  static_assert(Index::is_always_lock_free);

 public:
  /// Writer. Wait-free: one copy, one exchange.
  void publish(const T& value) noexcept {
    slots_[write_].value = value;
    // Release: the copy above is seen by whoever takes this slot. Acquire: the slot taken back was
    // let go by the reader before.
    write_ = middle_.exchange(write_ | kNew, std::memory_order_acq_rel) & kSlotBits;
  }

  /// Reader: the newest value, which stays the reader's own until the next call; `is_new` says
  /// whether it is another than last time. Before the first publish: a value-initialised T.
  const T& newest(bool* is_new = nullptr) noexcept {
    // Relaxed: only whether to swap is taken from it; what a late answer misses, the next call
    // sees.
    const bool fresh = (middle_.load(std::memory_order_relaxed) & kNew) != 0;
    // Acquire: the writer's copy is seen. Release: our reads of the slot let go are over before the
    // writer gets it back.
    if (fresh) read_ = middle_.exchange(read_, std::memory_order_acq_rel) & kSlotBits;
    if (is_new != nullptr) *is_new = fresh;
    return slots_[read_].value;
  }

 private:
  static constexpr std::uint32_t kSlotBits = 3, kNew = 4;
  struct alignas(64) Slot {
    T value{};
  };
  std::array<Slot, 3> slots_{};
  alignas(64) Index middle_{1};
  alignas(64) std::uint32_t write_ = 0;  ///< writer's own
  alignas(64) std::uint32_t read_ = 2;   ///< reader's own
};

}  // namespace haptic
