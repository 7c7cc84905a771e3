// SPDX-License-Identifier: Apache-2.0
#pragma once
/// System calls on chosen descriptors of this process, answered by an object instead of the kernel.
/// Takes effect in programs that link the object library haptic_usbfs, whose ioctl, read and lseek
/// look here first; in others nothing ever asks.

#include <cstddef>
#include <memory>
#include <span>

namespace haptic::sim {

/// Results are those of the system calls themselves: not negative, or a negative errno. Called from
/// any thread.
class DescriptorAnswer {
 public:
  virtual ~DescriptorAnswer() = default;
  virtual long on_ioctl(unsigned long request, void* argument) = 0;
  virtual long on_read(std::span<std::byte> bytes) = 0;
  virtual long on_seek(long offset, int whence) = 0;
};

/// Descriptors that can be answered at one time.
inline constexpr std::size_t kMaxAnsweredDescriptors = 32;

/// From now on `answer` speaks for `descriptor`. Returns false when kMaxAnsweredDescriptors are
/// already answered.
[[nodiscard]] bool begin_answers(int descriptor, std::shared_ptr<DescriptorAnswer> answer);
/// The kernel speaks for it again; a call under way keeps its object alive.
void end_answers(int descriptor);
/// Null: the kernel's. Cost for descriptors of the kernel: kMaxAnsweredDescriptors loads at most,
/// one while nothing is answered.
[[nodiscard]] std::shared_ptr<DescriptorAnswer> answer_of(int descriptor);

}  // namespace haptic::sim
