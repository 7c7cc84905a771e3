// SPDX-License-Identifier: Apache-2.0
// ioctl, read and lseek of the whole program. Descriptors that somebody in this process answers go
// there, all others to the kernel. A program that links this (object library haptic_usbfs) must
// export its symbols (CMake ENABLE_EXPORTS): then the shared libusb resolves to these.
//
// sys/ioctl.h and unistd.h stay out: the first declares ioctl with another exception
// specification, the second has inline forms of read under _FORTIFY_SOURCE.
#undef _FORTIFY_SOURCE
#include <sys/syscall.h>
#include <sys/types.h>

#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <span>

#include "host_sim/device/descriptor_answer.hpp"

extern "C" {
long syscall(long number, ...) noexcept;
int ioctl(int descriptor, unsigned long request, ...) noexcept;
ssize_t read(int descriptor, void* bytes, size_t count);
off_t lseek(int descriptor, off_t offset, int whence) noexcept;
}

static_assert(sizeof(off_t) == sizeof(long), "the prototypes are those of a 64-bit glibc");

namespace {

// As a system call's wrapper does: -1 and errno for a negative result.
long settled(long result) {
  if (result >= 0) return result;
  errno = static_cast<int>(-result);
  return -1;
}

}  // namespace

int ioctl(int descriptor, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* argument = va_arg(list, void*);
  va_end(list);
  if (const auto answer = haptic::sim::answer_of(descriptor))
    return static_cast<int>(settled(answer->on_ioctl(request, argument)));
  return static_cast<int>(syscall(SYS_ioctl, descriptor, request, argument));
}

ssize_t read(int descriptor, void* bytes, size_t count) {
  if (const auto answer = haptic::sim::answer_of(descriptor))
    return settled(answer->on_read({static_cast<std::byte*>(bytes), count}));
  return syscall(SYS_read, descriptor, bytes, count);
}

off_t lseek(int descriptor, off_t offset, int whence) noexcept {
  if (const auto answer = haptic::sim::answer_of(descriptor))
    return settled(answer->on_seek(offset, whence));
  return syscall(SYS_lseek, descriptor, offset, whence);
}
