// SPDX-License-Identifier: Apache-2.0
#include "tools/session/session_channel.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hal/drivers/sha256.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kControlBytes = CMSG_SPACE(kMostSessionDescriptors * sizeof(int));
/// Beyond it the other side is not believed: no history is as long.
constexpr off_t kMostSharedBytes = off_t{1} << 32;

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

int send_message(int socket, std::span<const std::byte> bytes,
                 std::span<const int> descriptors) noexcept {
  if (descriptors.size() > kMostSessionDescriptors) return EINVAL;
  iovec part{const_cast<std::byte*>(bytes.data()), bytes.size()};
  alignas(cmsghdr) char room[kControlBytes] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  if (!descriptors.empty()) {
    header.msg_control = room;
    header.msg_controllen = CMSG_SPACE(descriptors.size_bytes());
    cmsghdr* const control = CMSG_FIRSTHDR(&header);
    control->cmsg_level = SOL_SOCKET;
    control->cmsg_type = SCM_RIGHTS;
    control->cmsg_len = CMSG_LEN(descriptors.size_bytes());
    std::memcpy(CMSG_DATA(control), descriptors.data(), descriptors.size_bytes());
  }
  return sendmsg(socket, &header, MSG_NOSIGNAL | MSG_DONTWAIT) < 0 ? errno : 0;
}

SessionMessage take_message(int socket, std::span<std::byte> bytes) noexcept {
  SessionMessage message;
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) char room[kControlBytes] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = room;
  header.msg_controllen = sizeof room;
  message.size = recvmsg(socket, &header, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  if (message.size < 0) {
    message.size = -errno;
    // A side that was killed with bytes unread.
    if (message.size == -ECONNRESET) message.size = 0;
    return message;
  }
  for (cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr;
       control = CMSG_NXTHDR(&header, control)) {
    if (control->cmsg_level != SOL_SOCKET || control->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t came = (control->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t k = 0; k < came; ++k) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(control) + k * sizeof(int), sizeof number);
      Descriptor descriptor(number);  // one that has no room is closed
      if (message.descriptor_count < kMostSessionDescriptors)
        message.descriptors[message.descriptor_count++] = std::move(descriptor);
    }
  }
  if ((header.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) != 0) message.size = -EMSGSIZE;
  return message;
}

bool waits_for_message(int socket, int timeout_ms) noexcept {
  pollfd watched{socket, POLLIN, 0};
  return poll(&watched, 1, timeout_ms) > 0;
}

SharedView::~SharedView() {
  if (!bytes_.empty()) munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

int SharedView::map(const Descriptor& descriptor, std::size_t least_bytes) noexcept {
  struct stat found {};
  const int seals = fcntl(descriptor.get(), F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0 || fstat(descriptor.get(), &found) != 0 ||
      found.st_size < static_cast<off_t>(least_bytes) || found.st_size > kMostSharedBytes)
    return EINVAL;
  const auto size = static_cast<std::size_t>(found.st_size);
  void* const memory =
      mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, descriptor.get(), 0);
  if (memory == MAP_FAILED) return errno;
  bytes_ = {static_cast<const std::byte*>(memory), size};
  return 0;
}

void SharedView::keep_from_children() const noexcept {
  if (!bytes_.empty())
    (void)madvise(const_cast<std::byte*>(bytes_.data()), bytes_.size(), MADV_DONTFORK);
}

std::array<std::uint8_t, 32> hash_of_scene(std::span<const std::byte> scene) noexcept {
  hal::Sha256 hash;
  hash.add({reinterpret_cast<const std::uint8_t*>(scene.data()), scene.size()});
  return hash.finish();
}

}  // namespace haptic::tools
