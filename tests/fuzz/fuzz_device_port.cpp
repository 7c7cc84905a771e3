// SPDX-License-Identifier: Apache-2.0
/// The device's end of the carrier against a host that says and writes what it likes: no command of
/// more than its room, none that is older than the port allows or than a zero, one host at a time,
/// its end told once, and nothing left open.
#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <memory>

#include "hal/clock/servo_clock.hpp"
#include "hal/local/device_port.hpp"
#include "tests/fuzz/carrier_bench.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using fuzz::ReportStream;
using fuzz::require;

constexpr std::int64_t kOldest_ns = 2'000'000;
/// First byte of a command that must not arrive, and that nothing else begins with.
constexpr std::uint8_t kVoid = 0xee;

struct Device final : PortDevice {
  void begin() override { ++begun; }
  std::ptrdiff_t control(const ControlRequest& request, std::span<const std::uint8_t> data,
                         std::span<std::uint8_t> room) override {
    require(data.size() <= kMostSocketBytes && room.size() <= kMostSocketBytes, "within a message");
    std::fill(room.begin(), room.end(), std::uint8_t{1});
    return request.request % 2 == 0 ? -1 : static_cast<std::ptrdiff_t>(room.size());
  }
  void command(std::span<const std::uint8_t> bytes) override {
    require(bytes.size() <= kMostSocketBytes, "a command of at most its room");
    if (wild) return;
    require(bytes.empty() || bytes[0] != kVoid,
            "a command that is void or too old is not passed on");
  }
  void end() override { ++ended; }
  int begun = 0, ended = 0;
  bool wild = false;  ///< any bytes may be in the half, or said over the socket
};

/// Memory that a host has kept writable in places where it should not: its seals are the least that
/// a port takes.
struct HostMemory {
  HostMemory() {
    for (int* const each : {&given.commands, &given.reports}) {
      *each = memfd_create("host", MFD_CLOEXEC | MFD_ALLOW_SEALING);
      require(ftruncate(*each, sizeof(CarrierHalf)) == 0 &&
                  fcntl(*each, F_ADD_SEALS, F_SEAL_SHRINK) == 0,
              "memory can be made");
    }
    given.wakes_device = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    given.wakes_host = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    commands = std::make_unique<fuzz::WildHalf>(given.commands);
  }
  ~HostMemory() { given.close_all(); }
  CarrierDescriptors given;
  std::unique_ptr<fuzz::WildHalf> commands;
};

struct Stage {
  Stage() : path(fuzz::carrier_path()), port(kOldest_ns) {
    require(port.listen(path) == 0, "the port listens");
  }
  std::string path;
  DevicePort port;
  Device device;
  HostMemory memory;
};

int connected(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, path.size());
  const int made = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  require(connect(made, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0,
          "a host connects");
  return made;
}

void say(int socket, std::span<const std::uint8_t> bytes, CarrierDescriptors given, int count) {
  iovec part{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
  alignas(cmsghdr) char room[CMSG_SPACE(CarrierDescriptors::kCount * sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  if (count > 0) {
    header.msg_control = room;
    header.msg_controllen = CMSG_SPACE(static_cast<std::size_t>(count) * sizeof(int));
    cmsghdr* const control = CMSG_FIRSTHDR(&header);
    control->cmsg_level = SOL_SOCKET;
    control->cmsg_type = SCM_RIGHTS;
    control->cmsg_len = CMSG_LEN(static_cast<std::size_t>(count) * sizeof(int));
    for (int k = 0; k < count; ++k)
      std::memcpy(CMSG_DATA(control) + static_cast<std::size_t>(k) * sizeof(int),
                  given.all()[static_cast<std::size_t>(k)], sizeof(int));
  }
  (void)!sendmsg(socket, &header, MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::array<std::uint8_t, 9> memory_message() {
  std::array<std::uint8_t, 9> message{'m'};
  const std::uint32_t numbers[] = {kSocketVersion, sizeof(CarrierHalf)};
  for (std::size_t k = 0; k < 8; ++k)
    message[1 + k] = static_cast<std::uint8_t>(numbers[k / 4] >> (8 * (k % 4)) & 0xffu);
  return message;
}

/// A zero by the socket, in front of a command that it makes void.
void say_zero(Stage& stage, int host, std::uint8_t older_ns) {
  const std::int64_t now_ns = monotonic_ns();
  stage.memory.commands->publish(carried(std::array{kVoid}, now_ns - older_ns));
  std::array<std::uint8_t, 10> message{'z'};
  for (std::size_t k = 0; k < 8; ++k)
    message[1 + k] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(now_ns) >> (8 * k));
  say(host, message, {}, 0);
}

/// One host from its coming to its end.
void be_host(Stage& stage, ReportStream& input) {
  const int host = connected(stage.path);
  stage.memory.commands->clear();
  stage.device.wild = false;
  stage.port.serve(stage.device);
  require(stage.port.has_host(), "a host is taken in");
  for (int step = 0; step < 64 && !input.empty(); ++step) {
    const std::uint8_t kind = input.byte() % 8;
    // A port that has sent this one away would take in another.
    if (kind == 6 && stage.port.has_host()) {
      const unsigned before = stage.port.refused();
      const int other = connected(stage.path);
      stage.port.serve(stage.device);
      require(stage.port.refused() == before + 1, "one host at a time");
      close(other);
    } else if (kind == 0) {
      say(host, memory_message(), stage.memory.given, CarrierDescriptors::kCount);
    } else if (kind == 1) {  // any message, with any of the descriptors
      const int count = input.byte() % (CarrierDescriptors::kCount + 1);
      stage.device.wild = true;
      say(host, input.report(), stage.memory.given, count);
    } else if (kind == 2) {  // too old
      const std::int64_t older_ns = kOldest_ns + 1 + 1000 * std::int64_t{input.byte()};
      stage.memory.commands->publish(carried(std::array{kVoid}, monotonic_ns() - older_ns));
    } else if (kind == 3) {
      stage.memory.commands->publish(carried(std::array{std::uint8_t{1}}, monotonic_ns()));
    } else if (kind == 4) {
      say_zero(stage, host, input.byte());
      stage.port.serve(stage.device);
    } else if (kind == 5) {
      stage.port.publish(input.bytes<8>(), input.byte());
      stage.device.wild = true;
      stage.memory.commands->publish(input, monotonic_ns());
      stage.memory.commands->scribble(input);
    } else {
      stage.port.serve(stage.device);
    }
  }
  close(host);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto stage = std::make_unique<Stage>();
  const int before = fuzz::lowest_descriptor();
  ReportStream input(std::span<const std::uint8_t>(data, size));
  be_host(*stage, input);
  // The rest in the socket is heard within bounded turns, then the host's end.
  for (int turn = 0; turn < 64 && stage->port.has_host(); ++turn) stage->port.serve(stage->device);
  require(!stage->port.has_host(), "a host that has gone is let go");
  require(stage->device.begun == stage->device.ended, "each host's end is told once");
  require(fuzz::lowest_descriptor() == before, "no descriptor is left open");
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  return {
      {"session", std::string("\0\7\3a\0\7\3b\0\7\5abcdefgh\1\4\1\7", 21)},
      {"too_old", std::string("\0\7\2\0\7\2\xff\7", 9)},
      {"zero", std::string("\0\7\3a\1\7\4\7\7\3a\1\7", 13)},
      {"control", std::string("\0\7\1\0\x09"
                              "c\xc0\1\0\0\0\0\x40\0\7\1\0\x03"
                              "c\1\2\7",
                              22)},
      {"other_host", std::string("\0\7\6\7\3a\0\7", 8)},
      {"wild", std::string("\0\7\5abcdefgh\1\7zyxwvuts\7\5abcdefgh\1\x08\xff\7", 34)},
      {"wrong_memory", std::string("\1\3\x09m\2\0\0\0\0\0\0\0\7\1\1\x09m\1\0\0\0\0\0\0\0\7", 26)}};
}
