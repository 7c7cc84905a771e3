// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One record that its writer overwrites whenever it likes and anyone may copy: a sequence lock
/// without the loop. The words are atomics, so that a copy that meets the writer is no data race,
/// only a copy that is thrown away.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace haptic {

/// The widest word that every target of the core reads and writes in one piece.
using RecordWord = std::conditional_t<std::atomic<std::uint64_t>::is_always_lock_free,
                                      std::uint64_t, std::uint32_t>;

/// One writer thread, any readers, also in other processes; what a writer killed half way leaves
/// behind is no record. `Atomic`: as for NewestRecord.
///
/// Fences would do with less on weakly ordered machines, but TSan does not understand them, and on
/// x86 a release store or acquire load of a word is the plain instruction.
template <std::size_t word_count, template <class> class Atomic = std::atomic>
class StampedRecord {
  static_assert(Atomic<RecordWord>::is_always_lock_free);

 public:
  using Words = std::array<RecordWord, word_count>;
  static constexpr RecordWord kNoStamp = 0;  ///< never written, or being written

  /// Forgets the record. Writer only.
  void clear() noexcept { stamp_.store(kNoStamp, std::memory_order_relaxed); }

  /// Writer. `stamp` is not kNoStamp and not one that this record has had before. Wait-free.
  void write(RecordWord stamp, const Words& words) noexcept {
    // Relaxed: each word below carries it along.
    stamp_.store(kNoStamp, std::memory_order_relaxed);
    // Release: who copies one of the new words finds the old stamp gone when it looks again.
    for (std::size_t i = 0; i < word_count; ++i)
      words_[i].store(words[i], std::memory_order_release);
    // Release: who sees the stamp sees all words.
    stamp_.store(stamp, std::memory_order_release);
  }

  /// Any thread: the stamp at this moment, kNoStamp if there is no record.
  [[nodiscard]] RecordWord stamp() const noexcept {
    // Acquire: the words copied after this are at least those of the stamp.
    return stamp_.load(std::memory_order_acquire);
  }

  /// Any thread: copies the record stamped `stamp`. False, and `words` means nothing: it is no
  /// longer or not yet there. Wait-free.
  [[nodiscard]] bool copy(RecordWord stamp, Words& words) const noexcept {
    if (stamp == kNoStamp || this->stamp() != stamp) return false;
    // Acquire: a word of a later record brings that record's kNoStamp with it.
    for (std::size_t i = 0; i < word_count; ++i)
      words[i] = words_[i].load(std::memory_order_acquire);
    // Relaxed: the loads above have already ordered it behind all that they saw.
    return stamp_.load(std::memory_order_relaxed) == stamp;
  }

 private:
  Atomic<RecordWord> stamp_{kNoStamp};
  std::array<Atomic<RecordWord>, word_count> words_{};
};

}  // namespace haptic
