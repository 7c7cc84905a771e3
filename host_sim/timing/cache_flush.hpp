// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Puts what a tick touches out of the processor's caches, so that it can be timed as after other
/// work of the machine.

#include <cstddef>
#include <span>
#include <vector>

namespace haptic::sim {

/// Removes from the caches: on x86-64, by a line flush of each, the given memory, the program's own
/// code and constants, and 64 KiB of stack below the caller; elsewhere, by a walk over a buffer
/// twice the last-level cache, all former content. Address translations and learnt branches stay as
/// they are.
class CacheFlush {
 public:
  /// `memory` must outlive this.
  explicit CacheFlush(std::vector<std::span<const std::byte>> memory);

  /// Some tens of microseconds to a millisecond by line flush, some milliseconds by a walk.
  void run();

  /// Bytes flushed, or walked over.
  [[nodiscard]] std::size_t byte_count() const;
  [[nodiscard]] static const char* method();

 private:
  std::vector<std::span<const std::byte>> memory_;
  std::vector<unsigned char> walked_;
};

}  // namespace haptic::sim
