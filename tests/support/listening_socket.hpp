// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A stream socket of a path of its own, at which somebody listens and never accepts.

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <string>

namespace haptic::test {

class ListeningSocket {
 public:
  ListeningSocket() : path_("/tmp/listening-" + std::to_string(getpid()) + ".sock") {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(path_.begin(), path_.end(), address.sun_path);
    fd_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    (void)unlink(path_.c_str());
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        listen(fd_, 4) != 0)
      stop();
  }
  ~ListeningSocket() {
    stop();
    (void)unlink(path_.c_str());
  }
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  /// As if its process were killed: the file stays.
  void stop() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }

 private:
  std::string path_;
  int fd_ = -1;
};

}  // namespace haptic::test
