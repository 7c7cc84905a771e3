// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Newest value from one thread to others, without waiting on either side. The memory between them
/// is written by one side alone, so that the readers may have it mapped read-only, and a reader
/// trusts none of it: the number that it finds there only chooses one of the slots, and what it
/// copies was whole or is thrown away. Values in between are lost, which is right for state and
/// force. Works across processes: no pointers, address-free atomics.

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt_core/exchange/stamped_record.hpp"

namespace haptic {

/// What is shared. Zeroed memory is one without a value. `Atomic`: another than std::atomic only
/// where every order of its operations is explored.
template <class T, template <class> class Atomic = std::atomic, std::size_t slots = 4>
struct NewestRecord {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(RecordWord) == 0);
  static_assert(std::has_single_bit(slots));
  using Record = StampedRecord<sizeof(T) / sizeof(RecordWord), Atomic>;
  using Words = typename Record::Words;
  struct alignas(64) Slot {
    Record record;
  };
  std::array<Slot, slots> ring{};
  alignas(64) Atomic<RecordWord> newest{Record::kNoStamp};

  [[nodiscard]] static constexpr std::size_t slot_of(RecordWord stamp) noexcept {
    return static_cast<std::size_t>(stamp % slots);
  }
};

/// Owner: the one thread that writes. Its count is its own: what happens to the memory does not
/// lead it astray.
template <class T, template <class> class Atomic = std::atomic, std::size_t slots = 4>
class NewestWriter {
  using Memory = NewestRecord<T, Atomic, slots>;

 public:
  explicit NewestWriter(Memory& memory) noexcept : memory_(&memory) {}

  /// Wait-free: one copy.
  void publish(const T& value) noexcept {
    if (++written_ == Memory::Record::kNoStamp) ++written_;
    memory_->ring[Memory::slot_of(written_)].record.write(
        written_, std::bit_cast<typename Memory::Words>(value));
    // Release: who sees the number finds the record.
    memory_->newest.store(written_, std::memory_order_release);
  }

 private:
  Memory* memory_;
  RecordWord written_ = Memory::Record::kNoStamp;
};

/// Owner: one thread; others have readers of their own. Never writes to the memory. Any bytes in it
/// give some value, or that of before; nothing outside it is touched.
template <class T, template <class> class Atomic = std::atomic, std::size_t slots = 4>
class NewestReader {
  using Memory = NewestRecord<T, Atomic, slots>;

 public:
  explicit NewestReader(const Memory& memory) noexcept : memory_(&memory) {}

  /// The newest value, a copy that is this reader's own; `is_new` says whether it is another than
  /// last time. Before the first: a value-initialised T. A reader that the writer laps kTries times
  /// within this call keeps the value that it has. Bounded: kTries copies.
  const T& newest(bool* is_new = nullptr) noexcept {
    bool fresh = false;
    for (unsigned k = 0; k < kTries && !fresh; ++k) {
      // Acquire: the record of this number is there.
      const RecordWord stamp = memory_->newest.load(std::memory_order_acquire);
      if (stamp == seen_) break;
      typename Memory::Words words;
      fresh = memory_->ring[Memory::slot_of(stamp)].record.copy(stamp, words);
      if (!fresh) continue;
      seen_ = stamp;
      value_ = std::bit_cast<T>(words);
    }
    if (is_new != nullptr) *is_new = fresh;
    return value_;
  }

 private:
  static constexpr unsigned kTries = 4;
  const Memory* memory_;
  RecordWord seen_ = Memory::Record::kNoStamp;
  T value_{};
};

}  // namespace haptic
