// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/serial/serial_port.hpp"

#include <asm/termbits.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <vector>

namespace haptic::tools {
namespace {

/// So many ports are named in a message.
constexpr std::size_t kMostNamed = 8;

std::string named_ports(const SerialSystem& system) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator at(system.root + "/dev/serial/by-id", error), end;
       !error && at != end && names.size() < kMostNamed; at.increment(error)) {
    names.push_back(at->path().string());
  }
  if (names.empty()) return "no serial port is plugged in";
  std::ranges::sort(names);
  std::string text = "there is";
  for (const std::string& name : names) text += " " + name;
  return text;
}

std::string refusal(const std::string& path, int error, const SerialSystem& system) {
  const std::string at = "port '" + path + "': ";
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
    case ENOTDIR:
      return at + "no such port; plug the adapter in, or correct the path: " + named_ports(system);
    case EACCES:
    case EPERM:
      return at + "this user may not open it; sudo usermod -aG dialout $USER, then log in again";
    case EBUSY:
    case EWOULDBLOCK:
      return at + "another program holds it; end that program";
    default:
      return at + std::strerror(error) + "; unplug the adapter and plug it in again";
  }
}

std::string no_serial_port(const std::string& path, const SerialSystem& system) {
  return "port '" + path +
         "': this is no serial port; name one by its identity: " + named_ports(system);
}

/// Raw, 8N1, at `baud`. False: an errno says why.
bool set_line(int fd, std::uint32_t baud) {
  termios2 line{};
  if (::ioctl(fd, TCGETS2, &line) != 0) return false;
  line.c_iflag = IGNBRK | IGNPAR;
  line.c_oflag = 0;
  line.c_lflag = 0;
  line.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | (static_cast<tcflag_t>(BOTHER) << IBSHIFT);
  line.c_ispeed = line.c_ospeed = baud;
  std::memset(line.c_cc, 0, sizeof line.c_cc);  // a read never waits for a count or a time
  return ::ioctl(fd, TCSETS2, &line) == 0;
}

/// The rate that the adapter has now; 0: it does not say.
std::uint32_t rate_of(int fd) {
  termios2 line{};
  return ::ioctl(fd, TCGETS2, &line) == 0 ? line.c_ospeed : 0;
}

/// The driver hands bytes on at once, an FTDI adapter sets its latency timer to 1 ms. Drivers that
/// have no such flag lose nothing.
void ask_for_low_latency(int fd) {
  serial_struct settings{};
  if (::ioctl(fd, TIOCGSERIAL, &settings) != 0) return;
  settings.flags |= static_cast<int>(ASYNC_LOW_LATENCY);
  static_cast<void>(::ioctl(fd, TIOCSSERIAL, &settings));
}

}  // namespace

bool SerialPort::open(const std::string& path, std::uint32_t baud, std::string& why,
                      const SerialSystem& system) {
  close();
  return hal::through(tap_.get(), hal::TapKind::kConnect, {}, {},
                      [&] { return open_port(path, baud, why, system) ? 1 : 0; }) == 1;
}

bool SerialPort::open_port(const std::string& path, std::uint32_t baud, std::string& why,
                           const SerialSystem& system) {
  struct stat kind {};
  if (::stat(path.c_str(), &kind) != 0) return why = refusal(path, errno, system), false;
  if (!S_ISCHR(kind.st_mode)) return why = no_serial_port(path, system), false;
  const int fd = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return why = refusal(path, errno, system), false;
  fd_ = fd;
  const auto refuse = [&](std::string text) {
    why = std::move(text);
    close();
    return false;
  };
  if (::isatty(fd) == 0) return refuse(no_serial_port(path, system));
  // TIOCEXCL stops who comes later and is not root, the lock who looks for it before (pyserial).
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return refuse(refusal(path, errno, system));
  if (::ioctl(fd, TIOCEXCL) != 0) return refuse(refusal(path, errno, system));
  if (!set_line(fd, baud)) return refuse(refusal(path, errno, system));
  const std::uint32_t rate = rate_of(fd);
  // A receiver follows a rate that is off by 2 %.
  if (rate < baud - baud / 50 || rate > baud + baud / 50) {
    return refuse("port '" + path + "': the adapter makes " + std::to_string(rate) + " baud of " +
                  std::to_string(baud) + "; set `baud` and the servos to a rate that it has");
  }
  ask_for_low_latency(fd);
  drop_input();
  return true;
}

void SerialPort::close() noexcept {
  if (fd_ >= 0) {
    static_cast<void>(::ioctl(fd_, TIOCNXCL));
    ::close(fd_);
  }
  fd_ = -1;
  lost_ = false;
}

std::size_t SerialPort::read(std::span<std::uint8_t> bytes) noexcept {
  if (!is_usable() || bytes.empty()) return 0;
  const std::int64_t count =
      hal::through(tap_.get(), hal::TapKind::kReceived, {}, std::as_writable_bytes(bytes),
                   [&] { return read_port(bytes); });
  lost_ = count < 0;
  return static_cast<std::size_t>(std::max<std::int64_t>(count, 0));
}

/// Below 0: the port is lost.
std::int64_t SerialPort::read_port(std::span<std::uint8_t> bytes) noexcept {
  const ssize_t count = ::read(fd_, bytes.data(), bytes.size());
  if (count > 0) return count;
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
  if (count == 0) {
    // With VMIN 0 an idle port reads nothing too; one that was hung up says so to poll.
    pollfd at{fd_, POLLIN, 0};
    if (::poll(&at, 1, 0) >= 0 && (at.revents & (POLLHUP | POLLERR | POLLNVAL)) == 0) return 0;
  }
  return -1;
}

bool SerialPort::write(std::span<const std::uint8_t> bytes) noexcept {
  if (!is_usable()) return false;
  const std::int64_t count = hal::through(tap_.get(), hal::TapKind::kSent, std::as_bytes(bytes), {},
                                          [&] { return write_port(bytes); });
  lost_ = count < 0;
  return count >= 0 && static_cast<std::size_t>(count) == bytes.size();
}

/// Below 0: the port is lost.
std::int64_t SerialPort::write_port(std::span<const std::uint8_t> bytes) noexcept {
  const ssize_t count = ::write(fd_, bytes.data(), bytes.size());
  return count < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : count;
}

void SerialPort::drop_input() noexcept {
  if (fd_ >= 0 && !lost_) static_cast<void>(::ioctl(fd_, TCFLSH, TCIFLUSH));
}

void SerialPort::wait(std::int64_t timeout_ns) noexcept {
  if (fd_ < 0 || timeout_ns <= 0) return;
  pollfd at{fd_, POLLIN, 0};
  const timespec limit{static_cast<time_t>(timeout_ns / 1'000'000'000),
                       static_cast<long>(timeout_ns % 1'000'000'000)};
  static_cast<void>(::ppoll(&at, 1, &limit, nullptr));
}

std::int64_t SerialPort::now_ns() const noexcept {
  return hal::through(tap_.get(), hal::TapKind::kClock, {}, {}, monotonic_ns);
}

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace haptic::tools
