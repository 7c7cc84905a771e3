// SPDX-License-Identifier: Apache-2.0
/// The host's end of the carrier against a device that writes what it likes into its half and says
/// what it likes over the socket: reports of at most their room, answers of at most theirs, bounded
/// time, and commands that the device finds as they were made.
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <memory>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "hal/local/device_port.hpp"
#include "hal/local/process_peer.hpp"
#include "tests/fuzz/carrier_bench.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using fuzz::ReportStream;
using fuzz::require;

constexpr std::int64_t kLongest_ns = 20'000'000'000;

/// A listening socket, and the device's side of one connection to it.
class EvilDevice {
 public:
  EvilDevice() : path_(fuzz::carrier_path()) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, path_.size());
    unlink(path_.c_str());
    listener_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    require(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
                listen(listener_, 4) == 0,
            "a socket for the device");
  }
  ~EvilDevice() {
    hang_up();
    close(listener_);
    unlink(path_.c_str());
  }
  EvilDevice(const EvilDevice&) = delete;
  EvilDevice& operator=(const EvilDevice&) = delete;

  /// A host that is taken in as it should be.
  void meet(ProcessPeer& peer) {
    hang_up();
    std::thread answers([this] { answer(); });
    const HalStatus status = peer.plug(0);
    answers.join();
    require(status == HalStatus::kOk, "a device that answers is there");
    half_ = std::make_unique<fuzz::WildHalf>(descriptors_.reports);
    require(memory_.take(descriptors_) == 0, "its memory can be taken");
  }
  void hang_up() {
    half_.reset();
    memory_.close();
    if (socket_ >= 0) close(socket_);
    socket_ = -1;
  }
  void say(std::span<const std::uint8_t> bytes) {
    (void)!send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  /// Requests that nobody answers would fill the socket.
  void read_requests() {
    std::array<std::uint8_t, kMostSocketBytes> bytes;
    while (recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0) {
    }
  }
  [[nodiscard]] fuzz::WildHalf& half() { return *half_; }
  [[nodiscard]] CarrierMemory& memory() { return memory_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  void answer() {
    socket_ = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    std::array<std::uint8_t, 16> bytes{};
    iovec part{bytes.data(), bytes.size()};
    alignas(cmsghdr) char room[CMSG_SPACE(CarrierDescriptors::kCount * sizeof(int))] = {};
    msghdr header{};
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = room;
    header.msg_controllen = sizeof room;
    (void)!recvmsg(socket_, &header, MSG_CMSG_CLOEXEC);
    if (const cmsghdr* const control = CMSG_FIRSTHDR(&header)) {
      for (std::size_t k = 0; k < CarrierDescriptors::kCount; ++k)
        std::memcpy(descriptors_.all()[k], CMSG_DATA(control) + k * sizeof(int), sizeof(int));
    }
    constexpr std::array<std::uint8_t, 2> kYes{'m', 1};
    say(kYes);
  }

  std::string path_;
  int listener_ = -1, socket_ = -1;
  CarrierDescriptors descriptors_;
  CarrierMemory memory_;
  std::unique_ptr<fuzz::WildHalf> half_;
};

struct Stage {
  Stage() { evil.meet(peer); }
  EvilDevice evil;
  ProcessPeer peer{evil.path()};
};

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto stage = std::make_unique<Stage>();
  EvilDevice& evil = stage->evil;
  ProcessPeer& peer = stage->peer;
  ReportStream input(std::span<const std::uint8_t>(data, size));
  const std::int64_t begin_ns = monotonic_ns();
  std::array<std::uint8_t, kMaxReportBytes> in{};
  std::array<std::uint8_t, 64> room{};
  std::size_t moved = 0;
  bool hung_up = false;
  for (int step = 0; step < 64 && !input.empty() && !hung_up; ++step) {
    switch (input.byte() % 8) {
      case 0: {
        std::int64_t stamp_ns = 0;
        for (const std::uint8_t byte : input.bytes<8>())
          stamp_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(stamp_ns) << 8 | byte);
        evil.half().publish(input, stamp_ns);
        break;
      }
      case 1:
        evil.half().scribble(input);
        break;
      case 2:
      case 3:
        evil.say(input.report());
        break;
      case 4: {
        std::int64_t sampled_ns = 0;
        require(peer.report(0, in, sampled_ns) <= in.size(), "a report of at most its room");
        break;
      }
      case 5: {
        // An answer behind all that was said: nothing is waited for but by those who flood.
        constexpr std::array<std::uint8_t, 4> kAnswer{'a', 1, 2, 3};
        evil.say(kAnswer);
        const ControlRequest request{input.byte(), input.byte(), input.byte(), 0};
        const HalStatus status = peer.control(request, room, moved);
        require(moved <= room.size(), "an answer of at most its room");
        require(status != HalStatus::kOk || !peer.gone(), "who is gone answers nothing");
        break;
      }
      case 6:
        (void)peer.read(room, moved, 0);
        require(moved <= room.size(), "bytes of at most their room");
        break;
      default:
        hung_up = input.byte() % 16 == 0;
        if (hung_up) evil.hang_up();
        break;
    }
  }
  if (hung_up) {
    peer.wait(0);
    (void)peer.read(room, moved, 0);
    (void)peer.write(room);
    require(peer.gone(), "a device that has hung up is gone");
    evil.meet(peer);
  }
  const std::array<std::uint8_t, 6> command{1, 2, 3, static_cast<std::uint8_t>(size & 0xff), 5, 6};
  peer.command(7, command);
  const CarriedBytes* const got = evil.memory().newest();
  require(got != nullptr && got->stamp_ns == 7 &&
              std::equal(command.begin(), command.end(), got->used().begin(), got->used().end()),
          "the device finds the newest command as it was made");
  take_wake(evil.memory().wakes_us());
  evil.read_requests();
  for (int k = 0; k < 64 && peer.read(room, moved, 0) == HalStatus::kOk; ++k) {
  }
  require(monotonic_ns() - begin_ns < kLongest_ns, "bounded time");
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  const std::string block(hal::kMaxReportBytes, '\x5a');
  return {{"report", std::string("\0\0\0\0\0\0\0\1\7\x40", 10) + block + "\4\4"},
          {"control", "\5\xc0\1\4"},
          {"other_answers", "\2\3i\1\2\3\4m\1zz\2\2a\1\5\x80\1\1\6"},
          {"hang_up", std::string("\7\0", 2)},
          {"scribbles", "\1\7abcdefghijklmnopqrstuvwxyz0123456789\4\1\x08\xff\4\4"}};
}
