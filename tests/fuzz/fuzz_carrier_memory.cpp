// SPDX-License-Identifier: Apache-2.0
/// The memory between a host and a device, both halves in turn in the hands of a side that writes
/// what it likes, and descriptors of any kind in place of the memory: what is read is of at most
/// its room, the other half stays as its owner has written it, and nothing is left open.
#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/mman.h>

#include <memory>

#include "tests/fuzz/carrier_bench.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using fuzz::ReportStream;
using fuzz::require;

CarrierDescriptors copies_of(const CarrierDescriptors& given) {
  CarrierDescriptors from = given, to;
  for (std::size_t k = 0; k < CarrierDescriptors::kCount; ++k)
    *to.all()[k] = fcntl(*from.all()[k], F_DUPFD_CLOEXEC, 0);
  return to;
}

/// Host and device with the same memory, and each half mapped by who misuses it. The commands can
/// be misused by the host alone, before it seals them: here by the one mapping that it has.
struct Pair {
  Pair() {
    require(host.make() == 0, "memory can be made");
    require(device.take(copies_of(host.descriptors())) == 0, "what is made can be taken");
    reports = std::make_unique<fuzz::WildHalf>(host.descriptors().reports);
  }
  CarrierMemory host, device;
  std::unique_ptr<fuzz::WildHalf> reports;
};

/// Any descriptors in place of the memory: refused or mapped, and closed with it.
void take_any(ReportStream& input) {
  const int before = fuzz::lowest_descriptor();
  {
    CarrierMemory other, memory;
    require(other.make() == 0, "memory can be made");
    CarrierDescriptors given = copies_of(other.descriptors());
    for (int* const each : given.all()) {
      const std::uint8_t kind = input.byte() % 6;
      if (kind == 0) continue;
      close(*each);
      *each = -1;
      if (kind == 1) *each = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
      if (kind >= 2 && kind < 5) {  // memory of another size, sealed or not
        *each = memfd_create("any", MFD_CLOEXEC | MFD_ALLOW_SEALING);
        (void)!ftruncate(*each, kind == 4 ? 0 : input.byte() * 64);
        if (kind == 3) (void)fcntl(*each, F_ADD_SEALS, F_SEAL_SHRINK);
      }
    }
    const int commands = given.commands, reports = given.reports;
    const auto is_memory = [](int fd) {
      const int seals = fcntl(fd, F_GET_SEALS);
      return seals >= 0 && (seals & F_SEAL_SHRINK) != 0 &&
             lseek(fd, 0, SEEK_END) >= static_cast<off_t>(sizeof(CarrierHalf));
    };
    const bool fits = is_memory(commands) && is_memory(reports);
    const int error = memory.take(given);
    require(error != 0 || fits, "only memory that nobody can shrink is taken");
    require((error == 0) == memory.is_open(), "what is refused is not open");
    memory.publish(carried(input.bytes<8>(), 1));
    if (const CarriedBytes* const found = memory.newest())
      require(found->used().size() <= kMaxReportBytes, "at most its room");
  }
  require(fuzz::lowest_descriptor() == before, "no descriptor is left open");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto pair = std::make_unique<Pair>();
  ReportStream input(std::span<const std::uint8_t>(data, size));
  if (input.byte() % 16 == 0) {
    take_any(input);
    return 0;
  }
  std::array<std::uint8_t, 5> command{};
  bool was_published = false;
  while (!input.empty()) {
    switch (input.byte() % 4) {
      case 0:
        pair->reports->publish(input, input.byte());
        break;
      case 1:
        pair->reports->scribble(input);
        break;
      case 2:
        command = input.bytes<5>();
        pair->host.publish(carried(command, input.byte()));
        was_published = true;
        break;
      default:
        if (const CarriedBytes* const found = pair->host.newest())
          require(found->used().size() <= kMaxReportBytes, "at most its room");
        break;
    }
  }
  const CarriedBytes* const got = pair->device.newest();
  require((got != nullptr) == was_published, "the newest command is there, and no other");
  require(got == nullptr ||
              std::equal(command.begin(), command.end(), got->used().begin(), got->used().end()),
          "the other half stays as its owner has written it");
  take_wake(pair->device.wakes_us());
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  const std::string block(hal::kMaxReportBytes, '\x5a');
  return {{"any_memory", std::string("\0\0\0\0\0", 5)},
          {"other_memory", std::string("\0\3\40\2\40\1\5", 7)},
          {"a_report", std::string("\1\0\0\x40", 4) + block + "\3"},
          {"a_command", std::string("\1\2hello\7\3\0\0\x40", 12) + block + "\3"},
          {"scribbles", "\1\1\7abcdefghijklmnopqrstuvwxyz0123456789\3\1\1abcde\3\1\10\xff\3"}};
}
