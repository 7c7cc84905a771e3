// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/shared_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

namespace haptic::hal {
namespace {

constexpr std::size_t kMapPageBytes = 4096;  // the smallest there is
// linux/fcntl.h has it, and cannot be included beside fcntl.h.
constexpr int kSealFutureWrite = 0x0010;

}  // namespace

SharedMemory::SharedMemory(std::size_t byte_count, Readers readers) noexcept {
  if (byte_count == 0) return;
  int kind = MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE;
  if (readers == Readers::kByDescriptor) {
    kind = MAP_SHARED | MAP_POPULATE;
    descriptor_ = memfd_create("haptic shared memory", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (descriptor_ < 0 || ftruncate(descriptor_, static_cast<off_t>(byte_count)) != 0) return;
  }
  void* const memory = mmap(nullptr, byte_count, PROT_READ | PROT_WRITE, kind, descriptor_, 0);
  if (memory == MAP_FAILED) return;
  // After our own mapping: nobody gets another one that writes.
  if (descriptor_ >= 0 &&
      fcntl(descriptor_, F_ADD_SEALS,
            F_SEAL_SHRINK | F_SEAL_GROW | kSealFutureWrite | F_SEAL_SEAL) != 0) {
    munmap(memory, byte_count);
    return;
  }
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

SharedMemory::~SharedMemory() {
  leave();
  if (descriptor_ >= 0) close(descriptor_);
}

void SharedMemory::leave() noexcept {
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
  bytes_ = {};
}

}  // namespace haptic::hal
