// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/descriptor_answer.hpp"

#include <array>
#include <atomic>
#include <mutex>
#include <utility>

namespace haptic::sim {
namespace {

struct Slot {
  std::atomic<int> descriptor{-1};
  std::shared_ptr<DescriptorAnswer> answer;
};

// read and ioctl of the whole program pass here, before main and after it too: all of this is
// initialised at compile time, and a descriptor nobody answers never reaches lock or pointer.
constinit std::array<Slot, kMaxAnsweredDescriptors> slots;
constinit std::atomic<int> answered = 0;
constinit std::mutex slots_lock;

Slot* slot_of(int descriptor) {
  for (Slot& slot : slots) {
    if (slot.descriptor.load(std::memory_order_acquire) == descriptor) return &slot;
  }
  return nullptr;
}

}  // namespace

bool begin_answers(int descriptor, std::shared_ptr<DescriptorAnswer> answer) {
  const std::lock_guard lock(slots_lock);
  Slot* slot = slot_of(-1);
  if (slot == nullptr) return false;
  slot->answer = std::move(answer);
  slot->descriptor.store(descriptor, std::memory_order_release);
  answered.fetch_add(1, std::memory_order_release);
  return true;
}

void end_answers(int descriptor) {
  std::shared_ptr<DescriptorAnswer> last;  // destroyed after the lock is released
  const std::lock_guard lock(slots_lock);
  Slot* slot = slot_of(descriptor);
  if (slot == nullptr) return;
  slot->descriptor.store(-1, std::memory_order_release);
  last = std::move(slot->answer);
  answered.fetch_sub(1, std::memory_order_release);
}

std::shared_ptr<DescriptorAnswer> answer_of(int descriptor) {
  if (descriptor < 0 || answered.load(std::memory_order_acquire) == 0) return nullptr;
  if (slot_of(descriptor) == nullptr) return nullptr;
  const std::lock_guard lock(slots_lock);
  const Slot* slot = slot_of(descriptor);  // again: it may have ended meanwhile
  return slot == nullptr ? nullptr : slot->answer;
}

}  // namespace haptic::sim
