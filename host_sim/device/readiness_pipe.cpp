// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/readiness_pipe.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace haptic::sim {

ReadinessPipe::ReadinessPipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0)
    throw std::system_error(errno, std::generic_category(), "pipe2");
  read_end_ = ends[0];
  write_end_ = ends[1];
  constexpr int kPageBytes = 4096;
  const int room = fcntl(write_end_, F_SETPIPE_SZ, kPageBytes);
  if (room < 0) {
    const int refusal = errno;
    close(read_end_);
    close(write_end_);
    throw std::system_error(refusal, std::generic_category(), "F_SETPIPE_SZ");
  }
  page_.resize(static_cast<std::size_t>(room));
  show_ready(false);
}

ReadinessPipe::~ReadinessPipe() {
  hang_up();
  close(write_end_);
}

void ReadinessPipe::show_ready(bool ready) {
  if (ready == ready_ || read_end_ < 0) return;
  ready_ = ready;
  // The pipe is either full or empty, so one call moves the whole page; there is no other user.
  const ssize_t moved = ready ? read(read_end_, page_.data(), page_.size())
                              : write(write_end_, page_.data(), page_.size());
  if (moved != static_cast<ssize_t>(page_.size()))
    throw std::system_error(moved < 0 ? errno : EIO, std::generic_category(), "readiness pipe");
}

void ReadinessPipe::hang_up() {
  if (read_end_ >= 0) close(read_end_);
  read_end_ = -1;
}

}  // namespace haptic::sim
