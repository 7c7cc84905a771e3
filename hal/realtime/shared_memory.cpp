// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/shared_memory.hpp"

#include <sys/mman.h>

#include <cerrno>

namespace haptic::hal {
namespace {

constexpr std::size_t kMapPageBytes = 4096;  // the smallest there is

}  // namespace

SharedMemory::SharedMemory(std::size_t byte_count) noexcept {
  if (byte_count == 0) return;
  void* const memory = mmap(nullptr, byte_count, PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) return;
  bytes_ = {static_cast<std::byte*>(memory), byte_count};
  locked_ = mlock(memory, byte_count) == 0;
}

int SharedMemory::protect() noexcept {
  if (bytes_.empty()) return EINVAL;
  return mprotect(bytes_.data(), bytes_.size(), PROT_READ) == 0 ? 0 : errno;
}

bool SharedMemory::enter() noexcept {
  locked_ = !bytes_.empty() && mlock(bytes_.data(), bytes_.size()) == 0;
  // A refused lock maps nothing.
  const volatile std::byte* const bytes = bytes_.data();
  for (std::size_t at = 0; at < bytes_.size(); at += kMapPageBytes) {
    [[maybe_unused]] const std::byte touched = bytes[at];
  }
  return locked_;
}

SharedMemory::~SharedMemory() { leave(); }

void SharedMemory::leave() noexcept {
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
  bytes_ = {};
}

}  // namespace haptic::hal
