// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Memory that outlives the process which writes it: anonymous, shared with children, faulted in
/// and, where allowed, locked. The mailbox and the flight recorder lie in it.

#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

class SharedMemory {
 public:
  enum class Readers : std::uint8_t {
    kChildren = 0,
    /// A program that is handed descriptor() too: it can map the bytes read-only, and nobody can
    /// change their number (memfd seals).
    kByDescriptor
  };
  /// Page-aligned, zeroed, faulted in. `bytes()` is empty when the system has none left.
  explicit SharedMemory(std::size_t byte_count, Readers readers = Readers::kChildren) noexcept;
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// -1 unless Readers::kByDescriptor; closed with this object.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// Read-only for this process from now on; others are not affected. @return 0 or an errno.
  [[nodiscard]] int protect() noexcept;
  /// Unmapped in this process; others are not affected. `bytes()` is empty then.
  void leave() noexcept;
  /// In a process forked since: maps every page, which fork leaves to the first touch, and locks
  /// them, which fork does not hand on. False where the limit does not allow the lock.
  bool enter() noexcept;
  /// False where the limit of locked memory does not allow it: then it may be paged out.
  [[nodiscard]] bool locked() const noexcept { return locked_; }

 private:
  std::span<std::byte> bytes_;
  int descriptor_ = -1;
  bool locked_ = false;
};

}  // namespace haptic::hal
