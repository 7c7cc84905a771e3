// SPDX-License-Identifier: Apache-2.0
#include "hal/local/carrier_memory.hpp"

#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace haptic::hal {
namespace {

// linux/fcntl.h has it, and cannot be included beside fcntl.h.
#ifdef F_SEAL_FUTURE_WRITE
constexpr int kSealFutureWrite = F_SEAL_FUTURE_WRITE;
#else
constexpr int kSealFutureWrite = 0x0010;
#endif
constexpr int kSealSize = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

/// A memory file of one half's size that may still be sealed; negative: errno says why not.
int make_half(const char* name) noexcept {
  const int descriptor = memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (descriptor < 0 || ftruncate(descriptor, sizeof(CarrierHalf)) == 0) return descriptor;
  const int error = errno;
  close(descriptor);
  errno = error;
  return -1;
}

CarrierHalf* map_half(int descriptor, bool writes) noexcept {
  void* const found =
      mmap(nullptr, sizeof(CarrierHalf), writes ? PROT_READ | PROT_WRITE : PROT_READ,
           MAP_SHARED | MAP_POPULATE, descriptor, 0);
  if (found == MAP_FAILED) return nullptr;
  (void)mlock(found, sizeof(CarrierHalf));  // refused by the limit: it may be paged out
  return static_cast<CarrierHalf*>(found);
}

void unmap_half(CarrierHalf*& half) noexcept {
  if (half != nullptr) munmap(half, sizeof(CarrierHalf));
  half = nullptr;
}

/// True for a memory file of the right size that nobody can shrink.
bool is_whole(int descriptor) noexcept {
  struct stat found {};
  const int seals = fcntl(descriptor, F_GET_SEALS);
  return seals >= 0 && (seals & F_SEAL_SHRINK) != 0 && fstat(descriptor, &found) == 0 &&
         found.st_size >= static_cast<off_t>(sizeof(CarrierHalf));
}

void wake(int event) noexcept {
  constexpr std::uint64_t kOne = 1;
  (void)!write(event, &kOne, sizeof kOne);  // full: it is awake
}

}  // namespace

CarriedBytes carried(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) noexcept {
  CarriedBytes made;
  made.stamp_ns = stamp_ns;
  made.size = static_cast<std::uint32_t>(std::min(bytes.size(), made.bytes.size()));
  std::copy_n(bytes.begin(), made.size, made.bytes.begin());
  return made;
}

void CarrierDescriptors::close_all() noexcept {
  for (int* const descriptor : all()) {
    if (*descriptor >= 0) ::close(*descriptor);
    *descriptor = -1;
  }
}

int CarrierMemory::make() noexcept {
  close();
  is_host_ = true;
  const auto fail = [this] {
    const int error = errno;
    close();
    return error;
  };
  CarrierDescriptors& d = descriptors_;
  if ((d.commands = make_half("haptic commands")) < 0) return fail();
  if ((d.reports = make_half("haptic reports")) < 0) return fail();
  if ((d.wakes_device = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) < 0) return fail();
  if ((d.wakes_host = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) < 0) return fail();
  if (map() != 0) return fail();
  // After our own mapping: nobody gets another one that writes.
  if (fcntl(d.commands, F_ADD_SEALS, kSealSize | kSealFutureWrite) != 0) return fail();
  if (fcntl(d.reports, F_ADD_SEALS, kSealSize) != 0) return fail();
  return 0;
}

int CarrierMemory::take(CarrierDescriptors descriptors) noexcept {
  close();
  is_host_ = false;
  descriptors_ = descriptors;
  const bool whole = is_whole(descriptors.commands) && is_whole(descriptors.reports);
  const int error = whole ? map() : EINVAL;
  if (error != 0) close();
  return error;
}

/// @return 0 or errno, which is set.
int CarrierMemory::map() noexcept {
  commands_ = map_half(descriptors_.commands, is_host_);
  if (commands_ == nullptr) return errno;
  reports_ = map_half(descriptors_.reports, !is_host_);
  if (reports_ == nullptr) return errno;
  writer_.emplace(is_host_ ? *commands_ : *reports_);
  reader_.emplace(is_host_ ? *reports_ : *commands_);
  return 0;
}

void CarrierMemory::close() noexcept {
  writer_.reset();
  reader_.reset();
  unmap_half(commands_);
  unmap_half(reports_);
  descriptors_.close_all();
}

void CarrierMemory::publish(const CarriedBytes& bytes) noexcept {
  if (!writer_) return;
  writer_->publish(bytes);
  wake(is_host_ ? descriptors_.wakes_device : descriptors_.wakes_host);
}

const CarriedBytes* CarrierMemory::newest() noexcept {
  if (!reader_) return nullptr;
  bool is_new = false;
  const CarriedBytes& found = reader_->newest(&is_new);
  return is_new ? &found : nullptr;
}

int CarrierMemory::wakes_us() const noexcept {
  return is_host_ ? descriptors_.wakes_host : descriptors_.wakes_device;
}

void take_wake(int event) noexcept {
  std::uint64_t count = 0;
  (void)!read(event, &count, sizeof count);
}

}  // namespace haptic::hal
