// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Memory between the process that holds a device and the one that serves it: two halves, each
/// written by one side alone and read-only to the other, with the newest report in one and the
/// newest command in the other. Nothing queues, so nothing old is ever delivered, and neither side
/// waits for the other.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/drivers/driver.hpp"
#include "rt_core/exchange/newest_record.hpp"

namespace haptic::hal {

/// Bytes of a device's protocol, and when they were made.
struct CarriedBytes {
  std::int64_t stamp_ns = 0;  ///< of CLOCK_MONOTONIC: of a report when it was sampled
  std::uint32_t size = 0;     ///< of `bytes`; a reader takes more for none
  std::uint32_t unused = 0;   ///< no byte is left undefined
  std::array<std::uint8_t, kMaxReportBytes> bytes{};

  /// The bytes; none where their count cannot be.
  [[nodiscard]] std::span<const std::uint8_t> used() const noexcept {
    return std::span(bytes).first(size <= bytes.size() ? size : 0);
  }
};

[[nodiscard]] CarriedBytes carried(std::span<const std::uint8_t> bytes,
                                   std::int64_t stamp_ns) noexcept;

/// One direction.
using CarrierHalf = NewestRecord<CarriedBytes>;

/// Descriptors of the two halves and of what wakes each side, as they travel over a socket.
struct CarrierDescriptors {
  int commands = -1, reports = -1;         ///< memory, each of one CarrierHalf
  int wakes_device = -1, wakes_host = -1;  ///< eventfds
  static constexpr std::size_t kCount = 4;
  [[nodiscard]] std::array<int*, kCount> all() noexcept {
    return {&commands, &reports, &wakes_device, &wakes_host};
  }
  /// Closes those that are open.
  void close_all() noexcept;
};

/// One side's view of the memory; owner: one thread. The side that asks makes it, so that the other
/// one can neither shrink it nor write the half that is not its own (memfd seals).
class CarrierMemory {
 public:
  CarrierMemory() = default;
  ~CarrierMemory() { close(); }
  CarrierMemory(const CarrierMemory&) = delete;
  CarrierMemory& operator=(const CarrierMemory&) = delete;

  /// Makes both halves, empty, and the eventfds. @return 0 or an errno; then nothing is open.
  [[nodiscard]] int make() noexcept;
  /// Maps what the host has made; takes the descriptors over in any case.
  /// @return 0 or an errno; EINVAL: they are no such memory, or the host could still shrink it.
  [[nodiscard]] int take(CarrierDescriptors descriptors) noexcept;
  void close() noexcept;

  [[nodiscard]] bool is_open() const noexcept { return commands_ != nullptr; }
  [[nodiscard]] const CarrierDescriptors& descriptors() const noexcept { return descriptors_; }

  /// Into the own half; wakes the other side: one system call, which never blocks.
  void publish(const CarriedBytes& bytes) noexcept;
  /// The newest of the other side's half, any bytes may be in it; null: nothing since the
  /// last call.
  [[nodiscard]] const CarriedBytes* newest() noexcept;
  /// Readable once the other side has published; take_wake quiets it. Negative: not open.
  [[nodiscard]] int wakes_us() const noexcept;

 private:
  [[nodiscard]] int map() noexcept;

  CarrierDescriptors descriptors_;
  bool is_host_ = false;
  CarrierHalf *commands_ = nullptr, *reports_ = nullptr;  ///< one of them read-only
  std::optional<NewestWriter<CarriedBytes>> writer_;
  std::optional<NewestReader<CarriedBytes>> reader_;
};

/// Takes the count of an eventfd, so that it wakes nobody until it is raised again.
void take_wake(int event) noexcept;

}  // namespace haptic::hal
