// SPDX-License-Identifier: Apache-2.0
#include "rt_core/exchange/step_trace.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <new>

#include "rt_core/exchange/stamped_record.hpp"

namespace haptic {

namespace {

constexpr std::size_t kAlignment = 64;  // a cache line: two records never share one
constexpr std::size_t kTraceWords = sizeof(StepTrace) / sizeof(RecordWord);
constexpr RecordWord kMaxStamp = std::numeric_limits<RecordWord>::max();

struct alignas(kAlignment) Slot {
  StampedRecord<kTraceWords> record;
};
using Words = StampedRecord<kTraceWords>::Words;
static_assert(sizeof(Words) == sizeof(StepTrace));

// At the begin of the memory: what a reader of another program needs to know before it believes any
// of it. Record n, counted from 1, has stamp n and lies in slot (n - 1) % capacity.
struct alignas(kAlignment) Header {
  std::atomic<RecordWord> magic;  // written last
  std::atomic<RecordWord> slot_bytes;
  std::atomic<RecordWord> trace_bytes;
  std::atomic<RecordWord> capacity;
};
static_assert(sizeof(Header) == kAlignment);

constexpr RecordWord kMagic = 0x31544C46;  // "FLT1"; the number changes with the meaning of a field

std::size_t records_in(std::size_t bytes) noexcept {
  return bytes < sizeof(Header) ? 0 : (bytes - sizeof(Header)) / sizeof(Slot);
}

bool is_aligned(const std::byte* memory) noexcept {
  return std::bit_cast<std::uintptr_t>(memory) % kAlignment == 0;
}

Slot* slots_of(std::byte* memory) noexcept {
  return std::launder(reinterpret_cast<Slot*>(memory + sizeof(Header)));
}
const Slot* slots_of(const std::byte* memory) noexcept {
  return std::launder(reinterpret_cast<const Slot*>(memory + sizeof(Header)));
}

// The number of slots that the header vouches for and `memory` can hold; 0: not a recorder's
// memory. Acquire: who sees the magic sees the rest of the header, and slots that were emptied.
std::size_t readable_slots(std::span<const std::byte> memory) noexcept {
  if (memory.size() < sizeof(Header) || !is_aligned(memory.data())) return 0;
  const Header& header = *std::launder(reinterpret_cast<const Header*>(memory.data()));
  if (header.magic.load(std::memory_order_acquire) != kMagic) return 0;
  if (header.slot_bytes.load(std::memory_order_relaxed) != sizeof(Slot)) return 0;
  if (header.trace_bytes.load(std::memory_order_relaxed) != sizeof(StepTrace)) return 0;
  const RecordWord stated = header.capacity.load(std::memory_order_relaxed);
  return stated <= records_in(memory.size()) ? static_cast<std::size_t>(stated) : 0;
}

// The stamp of the newest record; kNoStamp: there is none. A stamp that can not stand in its slot
// was not written by a recorder.
RecordWord newest_stamp(const Slot* slots, std::size_t count) noexcept {
  RecordWord newest = StampedRecord<kTraceWords>::kNoStamp;
  for (std::size_t i = 0; i < count; ++i) {
    const RecordWord stamp = slots[i].record.stamp();
    if (stamp > newest && (stamp - 1) % count == i) newest = stamp;
  }
  return newest;
}

}  // namespace

std::size_t FlightRecorder::bytes_for(std::size_t records) noexcept {
  return sizeof(Header) + records * sizeof(Slot);
}

FlightRecorder::FlightRecorder(std::span<std::byte> memory) noexcept {
  if (memory.size() < sizeof(Header) || !is_aligned(memory.data())) return;
  memory_ = memory.data();
  capacity_ = records_in(memory.size());
  Header* header = ::new (static_cast<void*>(memory_)) Header{};  // placement, no heap
  for (std::size_t i = 0; i < capacity_; ++i) {
    ::new (static_cast<void*>(memory_ + bytes_for(i))) Slot{};  // placement, no heap
  }
  header->slot_bytes.store(sizeof(Slot), std::memory_order_relaxed);
  header->trace_bytes.store(sizeof(StepTrace), std::memory_order_relaxed);
  header->capacity.store(capacity_, std::memory_order_relaxed);
  // Release: as readable_slots acquires it.
  header->magic.store(kMagic, std::memory_order_release);
}

void FlightRecorder::write(const StepTrace& record) noexcept {
  // Stamps are not used twice: with words of 32 bits the recorder ends after 2^32 - 1 records.
  if (capacity_ == 0 || written_ == kMaxStamp) return;
  Slot& slot = slots_of(memory_)[written_ % capacity_];
  ++written_;
  slot.record.write(static_cast<RecordWord>(written_), std::bit_cast<Words>(record));
}

std::size_t FlightRecorder::capacity() const noexcept { return capacity_; }

std::size_t FlightRecorder::copy_newest(std::span<const std::byte> memory,
                                        std::span<StepTrace> out) noexcept {
  const std::size_t count = readable_slots(memory);
  if (count == 0) return 0;
  const Slot* slots = slots_of(memory.data());
  const RecordWord newest = newest_stamp(slots, count);
  const RecordWord wanted = std::min<RecordWord>(newest, std::min(count, out.size()));
  std::size_t copied = 0;
  // Records written from here on are newer than `newest` and, where it overwrites, left out.
  for (RecordWord left = wanted; left > 0; --left) {
    const RecordWord stamp = newest - (left - 1);
    Words words;
    if (!slots[(stamp - 1) % count].record.copy(stamp, words)) continue;
    out[copied] = std::bit_cast<StepTrace>(words);
    ++copied;
  }
  return copied;
}

}  // namespace haptic
