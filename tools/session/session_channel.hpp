// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The socket between a program with a session and its run_device, and memory that came over it.

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace haptic::tools {

/// Closed with this object.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const noexcept { return number_; }
  [[nodiscard]] bool is_open() const noexcept { return number_ >= 0; }

 private:
  int number_ = -1;
};

inline constexpr std::size_t kMostSessionDescriptors = 8;

/// A message and what came with it.
struct SessionMessage {
  ssize_t size =
      0;  ///< 0: the other side has gone; negative: nothing is there; whole messages only
  std::array<Descriptor, kMostSessionDescriptors> descriptors;
  std::size_t descriptor_count = 0;
};

/// Sends one message. @return 0 or an errno; EAGAIN: the other side reads none.
[[nodiscard]] int send_message(int socket, std::span<const std::byte> bytes,
                               std::span<const int> descriptors = {}) noexcept;
/// Takes one message, without waiting; one that is longer than `bytes` has a size of -EMSGSIZE.
[[nodiscard]] SessionMessage take_message(int socket, std::span<std::byte> bytes) noexcept;
/// Waits for a message, or the end of the other side.
[[nodiscard]] bool waits_for_message(int socket, int timeout_ms) noexcept;

/// Memory of the other side, read-only; owner: one side.
class SharedView {
 public:
  SharedView() = default;
  ~SharedView();
  SharedView(const SharedView&) = delete;
  SharedView& operator=(const SharedView&) = delete;

  /// Maps it. @return 0 or an errno; EINVAL: it is no memory of at least `least_bytes`, or the
  /// other side could still shrink it.
  [[nodiscard]] int map(const Descriptor& descriptor, std::size_t least_bytes) noexcept;
  /// A process that is forked from this one does not have it.
  void keep_from_children() const noexcept;
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
};

/// The hash by which both sides know a scene, 32 bytes.
[[nodiscard]] std::array<std::uint8_t, 32> hash_of_scene(std::span<const std::byte> scene) noexcept;

}  // namespace haptic::tools
