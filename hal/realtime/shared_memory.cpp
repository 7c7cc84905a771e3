// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/shared_memory.hpp"

#include <sys/mman.h>

namespace haptic::hal {

SharedMemory::SharedMemory(std::size_t byte_count) noexcept {
  if (byte_count == 0) return;
  void* const memory = mmap(nullptr, byte_count, PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) return;
  bytes_ = {static_cast<std::byte*>(memory), byte_count};
  locked_ = mlock(memory, byte_count) == 0;
}

SharedMemory::~SharedMemory() {
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
}

}  // namespace haptic::hal
