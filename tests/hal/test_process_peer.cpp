// SPDX-License-Identifier: Apache-2.0
// A device behind a socket and shared memory: the newest of each side alone, nothing old, zero
// before all else, and a device that writes what it likes.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/device_port.hpp"
#include "hal/local/local_link.hpp"
#include "hal/local/process_peer.hpp"
#include "hal/zero_command.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kOldest_ns = 2 * kMs;
/// A command stamped so far ahead is fresh on a machine of any load.
constexpr std::int64_t kFresh_ns = 60'000 * kMs;
constexpr int kMostLooks = 20'000;  // of a millisecond's share each: patience, not a time

std::string socket_path() {
  static std::atomic<int> count{0};
  return "/tmp/haptic_peer_" + std::to_string(getpid()) + "_" + std::to_string(count++);
}

struct Device final : PortDevice {
  void begin() override { ++begun; }
  std::ptrdiff_t control(const ControlRequest& request, std::span<const std::uint8_t>,
                         std::span<std::uint8_t> room) override {
    if (request.request != kReferenceBlockRequest || room.size() < kReferenceBlockBytes) return -1;
    encode(block, room.first<kReferenceBlockBytes>());
    return kReferenceBlockBytes;
  }
  void command(std::span<const std::uint8_t> bytes) override {
    commands.emplace_back(bytes.begin(), bytes.end());
  }
  void end() override { ++ended; }

  ReferenceBlock block;
  int begun = 0, ended = 0;
  std::vector<std::vector<std::uint8_t>> commands;
};

/// A port that a thread serves until it is told to stand still.
struct Served {
  Served() {
    REQUIRE(port.listen(path) == 0);
    thread = std::thread([this] {
      while (!stop.load()) {
        if (!deaf.load()) {
          const std::lock_guard lock(mutex);
          port.serve(device);
        }
        usleep(200);
      }
    });
  }
  ~Served() {
    stop.store(true);
    thread.join();
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  [[nodiscard]] std::vector<std::vector<std::uint8_t>> commands() {
    const std::lock_guard lock(mutex);
    return device.commands;
  }
  bool comes(std::size_t count) {
    for (int k = 0; k < kMostLooks && commands().size() < count; ++k) usleep(500);
    return commands().size() >= count;
  }
  /// From now on the device looks at nothing; what it is doing has ended.
  void be_deaf(bool now) {
    deaf.store(now);
    const std::lock_guard lock(mutex);
  }

  std::string path = socket_path();
  DevicePort port{kOldest_ns};
  Device device;
  std::mutex mutex;
  std::atomic<bool> stop{false}, deaf{false};
  std::thread thread;
};

/// The descriptors that a device's process has, to be misused.
struct EvilDevice {
  EvilDevice() {
    REQUIRE(listener.listen(path) == 0);
    thread = std::thread([this] {
      for (int k = 0; k < kMostLooks && (socket = accept(fd(), nullptr, nullptr)) < 0; ++k)
        usleep(500);
      std::array<std::uint8_t, 64> bytes{};
      iovec part{bytes.data(), bytes.size()};
      alignas(cmsghdr) char room[CMSG_SPACE(4 * sizeof(int))] = {};
      msghdr header{};
      header.msg_iov = &part;
      header.msg_iovlen = 1;
      header.msg_control = room;
      header.msg_controllen = sizeof room;
      if (recvmsg(socket, &header, 0) <= 0) return;
      int numbers[4];
      std::memcpy(numbers, CMSG_DATA(CMSG_FIRSTHDR(&header)), sizeof numbers);
      for (std::size_t k = 0; k < 4; ++k) *descriptors.all()[k] = numbers[k];
      const std::uint8_t yes[] = {'m', 1};
      (void)!send(socket, yes, sizeof yes, MSG_NOSIGNAL);
    });
  }
  ~EvilDevice() {
    if (thread.joinable()) thread.join();
    descriptors.close_all();
    if (socket >= 0) close(socket);
  }
  EvilDevice(const EvilDevice&) = delete;
  EvilDevice& operator=(const EvilDevice&) = delete;
  [[nodiscard]] int fd() const { return listener.watched()[0].fd; }

  std::string path = socket_path();
  DevicePort listener{kOldest_ns};
  int socket = -1;
  CarrierDescriptors descriptors;
  std::thread thread;
};

/// A host of its own that offers this memory; true: the device has taken it.
bool accepts(Served& served, std::uint32_t version, CarrierDescriptors descriptors) {
  const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  served.path.copy(address.sun_path, served.path.size());
  REQUIRE(connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  std::array<std::uint8_t, 9> bytes{'m'};
  const std::uint32_t numbers[] = {version, sizeof(CarrierHalf)};
  std::memcpy(&bytes[1], numbers, sizeof numbers);  // little endian, as the machines here are
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) char room[CMSG_SPACE(4 * sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = room;
  header.msg_controllen = sizeof room;
  cmsghdr* const control = CMSG_FIRSTHDR(&header);
  control->cmsg_level = SOL_SOCKET;
  control->cmsg_type = SCM_RIGHTS;
  control->cmsg_len = CMSG_LEN(4 * sizeof(int));
  int passed[4];
  for (std::size_t k = 0; k < 4; ++k) passed[k] = *descriptors.all()[k];
  std::memcpy(CMSG_DATA(control), passed, sizeof passed);
  REQUIRE(sendmsg(socket, &header, MSG_NOSIGNAL) > 0);
  std::uint8_t answer[2] = {};
  const ssize_t size = recv(socket, answer, sizeof answer, 0);
  close(socket);
  for (int k = 0; k < kMostLooks; ++k) {  // until it is free for the next one
    const std::lock_guard lock(served.mutex);
    if (!served.port.has_host()) break;
    served.port.serve(served.device);
  }
  REQUIRE(size == 2);
  return answer[0] == 'm' && answer[1] == 1;
}

std::vector<std::uint8_t> bytes_of(std::uint8_t value) {
  return std::vector<std::uint8_t>(56, value);
}

}  // namespace

TEST_SUITE("hal.process_peer") {
  TEST_CASE("requests are answered, the newest report and the newest command alone arrive") {
    Served served;
    ProcessPeer peer(served.path);
    REQUIRE(peer.plug(monotonic_ns()) == HalStatus::kOk);
    std::array<std::uint8_t, kReferenceBlockBytes> block{};
    std::size_t moved = 0;
    CHECK(peer.control({kReferenceBlockRequestType, kReferenceBlockRequest, 1, 0}, block, moved) ==
          HalStatus::kOk);
    CHECK(moved == kReferenceBlockBytes);
    CHECK(peer.control({kReferenceBlockRequestType, 99, 1, 0}, block, moved) ==
          HalStatus::kTransferFailed);

    std::array<std::uint8_t, kMaxReportBytes> in{};
    std::int64_t sampled_ns = 0;
    CHECK(peer.report(0, in, sampled_ns) == 0);
    served.be_deaf(true);
    for (std::uint8_t k = 1; k <= 5; ++k) served.port.publish(bytes_of(k), 100 + k);
    CHECK(peer.report(0, in, sampled_ns) == 56);
    CHECK(in[0] == 5);
    CHECK(sampled_ns == 105);
    CHECK(peer.report(0, in, sampled_ns) == 0);  // once

    for (std::uint8_t k = 1; k <= 100; ++k) peer.command(monotonic_ns(), bytes_of(k));
    peer.command(monotonic_ns() + kFresh_ns, bytes_of(101));
    served.be_deaf(false);
    REQUIRE(served.comes(1));
    usleep(5000);
    REQUIRE(served.commands().size() == 1);
    CHECK(served.commands()[0] == bytes_of(101));
  }

  TEST_CASE("a command that has become old while nobody looked is never passed on") {
    Served served;
    ProcessPeer peer(served.path);
    REQUIRE(peer.plug(monotonic_ns()) == HalStatus::kOk);
    served.be_deaf(true);
    peer.command(monotonic_ns() - kOldest_ns - 1, bytes_of(6));
    served.be_deaf(false);
    for (int k = 0; k < kMostLooks; ++k) {
      const std::lock_guard lock(served.mutex);
      if (served.port.stale() == 1) break;
      usleep(500);
    }
    CHECK(served.port.stale() == 1);
    CHECK(served.commands().empty());
  }

  TEST_CASE("zero comes before what a deaf device has not looked at, and makes it void") {
    Served served;
    ProcessPeer peer(served.path);
    REQUIRE(peer.plug(monotonic_ns()) == HalStatus::kOk);
    served.be_deaf(true);
    // More than any socket would queue.
    for (int k = 0; k < 3000; ++k) peer.command(monotonic_ns(), bytes_of(6));
    ZeroCommand zero;
    zero.descriptor = peer.descriptor();
    zero.size = 56;
    REQUIRE(send_zero(zero));
    served.be_deaf(false);
    REQUIRE(served.comes(1));
    usleep(5000);
    REQUIRE(served.commands().size() == 1);
    CHECK(served.commands()[0] == bytes_of(0));
    peer.command(monotonic_ns() + kFresh_ns, bytes_of(7));  // a host that lives on may go on
    REQUIRE(served.comes(2));
    CHECK(served.commands()[1] == bytes_of(7));
  }

  TEST_CASE("one host at a time; its end and the device's are noticed") {
    auto served = std::make_unique<Served>();
    ProcessPeer peer(served->path), other(served->path);
    REQUIRE(peer.plug(0) == HalStatus::kOk);
    CHECK(other.plug(0) == HalStatus::kDeviceBusy);
    CHECK(served->port.refused() == 1);
    CHECK_FALSE(peer.gone());
    peer.unplug();
    for (int k = 0; k < kMostLooks && served->device.ended == 0; ++k) usleep(500);
    CHECK(served->device.ended == 1);
    REQUIRE(other.plug(0) == HalStatus::kOk);
    served->stop.store(true);
    served->thread.join();
    served->thread = std::thread([] {});
    served.reset();
    for (int k = 0; k < kMostLooks && !other.gone(); ++k) other.wait(monotonic_ns() + kMs);
    CHECK(other.gone());
    CHECK(ProcessPeer("/tmp/haptic_nobody").plug(0) == HalStatus::kDeviceNotFound);
  }

  TEST_CASE("a device can neither write nor shrink what is not its own") {
    EvilDevice evil;
    ProcessPeer peer(evil.path);
    REQUIRE(peer.plug(0) == HalStatus::kOk);
    evil.thread.join();
    const int commands = evil.descriptors.commands, reports = evil.descriptors.reports;
    CHECK(mmap(nullptr, sizeof(CarrierHalf), PROT_READ | PROT_WRITE, MAP_SHARED, commands, 0) ==
          MAP_FAILED);
    const char byte = 1;
    CHECK(pwrite(commands, &byte, 1, 0) < 0);
    for (const int half : {commands, reports}) {
      CHECK(ftruncate(half, 0) != 0);
      CHECK(ftruncate(half, 1 << 20) != 0);
      CHECK(fcntl(half, F_ADD_SEALS, F_SEAL_WRITE) != 0);
    }
    // The probe: what is its own it can write, or the checks above say nothing.
    void* const own =
        mmap(nullptr, sizeof(CarrierHalf), PROT_READ | PROT_WRITE, MAP_SHARED, reports, 0);
    CHECK(own != MAP_FAILED);
    munmap(own, sizeof(CarrierHalf));
  }

  TEST_CASE("any bytes in its half give a report of at most its room, and no command is lost") {
    EvilDevice evil;
    ProcessPeer peer(evil.path);
    REQUIRE(peer.plug(0) == HalStatus::kOk);
    evil.thread.join();
    auto* const half =
        static_cast<std::uint8_t*>(mmap(nullptr, sizeof(CarrierHalf), PROT_READ | PROT_WRITE,
                                        MAP_SHARED, evil.descriptors.reports, 0));
    REQUIRE(half != MAP_FAILED);
    std::array<std::uint8_t, kMaxReportBytes> in{};
    std::uint64_t random = 88172645463325252u;
    NewestWriter<CarriedBytes> writer(*reinterpret_cast<CarrierHalf*>(half));
    unsigned reports = 0, none = 0;
    for (int k = 0; k < 20'000; ++k) {
      const auto next = [&random] {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        return random;
      };
      CarriedBytes wild;
      wild.stamp_ns = static_cast<std::int64_t>(next());
      wild.size = static_cast<std::uint32_t>(k % 3 == 0 ? next() : next() % 200);
      if (k % 2 == 0) writer.publish(wild);
      // Some of its words, or all of them.
      const std::uint64_t scribbles = k % 5 == 0 ? sizeof(CarrierHalf) : next() % 4;
      for (std::uint64_t n = 0; n < scribbles; ++n)
        half[next() % sizeof(CarrierHalf)] = static_cast<std::uint8_t>(next());
      std::int64_t sampled_ns = 0;
      const std::size_t size = peer.report(0, in, sampled_ns);
      REQUIRE(size <= in.size());
      (size > 0 ? reports : none) += 1;
    }
    CHECK(reports > 1000);
    CHECK(none > 1000);
    munmap(half, sizeof(CarrierHalf));
  }

  TEST_CASE("a device that wakes its host all the time, or floods the socket, holds up nobody") {
    EvilDevice evil;
    ProcessPeer peer(evil.path);
    REQUIRE(peer.plug(0) == HalStatus::kOk);
    evil.thread.join();
    const std::uint64_t full = ~std::uint64_t{0} - 1;
    REQUIRE(write(evil.descriptors.wakes_host, &full, sizeof full) == sizeof full);
    const std::int64_t begin_ns = monotonic_ns();
    for (int k = 0; k < 100; ++k) peer.wait(monotonic_ns() + kMs);
    CHECK(monotonic_ns() - begin_ns >= 99 * 20'000);  // it sleeps between two wakes all the same
    // Its own side may be full: a command never blocks.
    const std::uint64_t more = ~std::uint64_t{0} - 2;
    (void)!write(evil.descriptors.wakes_device, &more, sizeof more);
    peer.command(monotonic_ns(), bytes_of(1));
    fcntl(evil.socket, F_SETFL, O_NONBLOCK);
    const std::array<std::uint8_t, 8> noise{'i', 1, 2, 3, 4, 5, 6, 7};
    unsigned sent = 0;
    while (sent < 100'000 && send(evil.socket, noise.data(), noise.size(), MSG_NOSIGNAL) > 0)
      ++sent;
    CHECK(sent > 16);
    std::array<std::uint8_t, 8> bytes{};
    std::size_t moved = 0;
    CHECK(peer.control({0xc0, 1, 0, 0}, bytes, moved) == HalStatus::kTimeout);
    CHECK_FALSE(peer.gone());
  }

  TEST_CASE("a zero that a host has sent last arrives, though it has left answers unread") {
    Served served;
    ProcessPeer peer(served.path);
    REQUIRE(peer.plug(monotonic_ns()) == HalStatus::kOk);
    const std::array<std::uint8_t, 9> asks{'c', 0xc0, 1, 0, 0, 0, 0, 64, 0};
    REQUIRE(send(peer.descriptor(), asks.data(), asks.size(), MSG_NOSIGNAL) > 0);
    char unread = 0;
    for (int k = 0; k < kMostLooks && recv(peer.descriptor(), &unread, 1, MSG_PEEK) <= 0; ++k)
      usleep(500);
    REQUIRE(unread == 'a');
    served.be_deaf(true);
    peer.command(monotonic_ns(), bytes_of(6));
    ZeroCommand zero;
    zero.descriptor = peer.descriptor();
    zero.size = 56;
    REQUIRE(send_zero(zero));
    peer.unplug();
    served.be_deaf(false);
    REQUIRE(served.comes(1));
    CHECK(served.commands()[0] == bytes_of(0));
    for (int k = 0; k < kMostLooks && served.device.ended == 0; ++k) usleep(500);
    CHECK(served.device.ended == 1);
    CHECK(served.commands().size() == 1);
  }

  TEST_CASE("another version, or memory that its host could shrink, is refused and let go") {
    Served served;
    for (const int wrong : {0, 1, 2}) {
      CAPTURE(wrong);
      CarrierDescriptors given;
      // As make does it, but for the seals.
      given.commands = memfd_create("commands", MFD_CLOEXEC | MFD_ALLOW_SEALING);
      given.reports = memfd_create("reports", MFD_CLOEXEC | MFD_ALLOW_SEALING);
      given.wakes_device = eventfd(0, EFD_NONBLOCK);
      given.wakes_host = eventfd(0, EFD_NONBLOCK);
      for (const int half : {given.commands, given.reports})
        REQUIRE(ftruncate(half, sizeof(CarrierHalf)) == 0);
      CarrierMemory memory;
      REQUIRE(memory.make() == 0);
      CHECK(accepts(served, kSocketVersion, memory.descriptors()));  // the probe
      if (wrong == 0) CHECK_FALSE(accepts(served, kSocketVersion + 1, memory.descriptors()));
      if (wrong == 1) CHECK_FALSE(accepts(served, kSocketVersion, given));
      if (wrong == 2) {
        given.close_all();
        given = memory.descriptors();
        given.commands = given.wakes_device;  // no memory at all
        CHECK_FALSE(accepts(served, kSocketVersion, given));
        continue;
      }
      given.close_all();
    }
  }

  TEST_CASE("messages of any bytes do not upset it") {
    Served served;
    ProcessPeer peer(served.path);
    std::uint64_t random = 1234567;
    for (int k = 0; k < 2000; ++k) {
      REQUIRE(peer.plug(0) == HalStatus::kOk);
      std::array<std::uint8_t, 40> message{};
      for (std::uint8_t& byte : message) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        byte = static_cast<std::uint8_t>(random >> 56);
      }
      constexpr char kKinds[] = "mcaioz?";
      message[0] = static_cast<std::uint8_t>(kKinds[k % 7]);
      (void)!send(peer.descriptor(), message.data(), 1 + random % 39, MSG_NOSIGNAL | MSG_DONTWAIT);
      peer.unplug();
      for (int look = 0; look < kMostLooks && served.device.ended <= k; ++look) usleep(100);
    }
    CHECK(served.port.hosts() == 2000);
  }
}
