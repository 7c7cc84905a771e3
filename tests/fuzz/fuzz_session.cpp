// SPDX-License-Identifier: Apache-2.0
/// The session protocol between a program and run_device: any bytes and descriptors as a request,
/// and memory in which the other side writes what it likes. Refused with a reason, or within its
/// ranges; texts end, maps are usable, and no descriptor is left open.
#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

#include "tests/fuzz/carrier_bench.hpp"
#include "tools/session/session_channel.hpp"
#include "tools/session/session_records.hpp"

namespace {

using namespace haptic;
using namespace haptic::tools;
using fuzz::ReportStream;
using fuzz::require;

/// Sealed memory, memory that can be shrunk, an eventfd: what may come in place of the memory.
std::array<int, 3> given_descriptors() {
  std::array<int, 3> all{memfd_create("sealed", MFD_CLOEXEC | MFD_ALLOW_SEALING),
                         memfd_create("open", MFD_CLOEXEC | MFD_ALLOW_SEALING),
                         eventfd(0, EFD_CLOEXEC)};
  for (const int each : {all[0], all[1]})
    require(ftruncate(each, sizeof(SessionDown)) == 0, "memory can be made");
  require(fcntl(all[0], F_ADD_SEALS, F_SEAL_SHRINK) == 0, "memory can be sealed");
  return all;
}

/// A request over a socket, as run_device takes it.
void ask(ReportStream& input) {
  static const std::array<int, 3> kGiven = given_descriptors();
  int ends[2];
  require(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0, "a pair of sockets");
  const Descriptor theirs(ends[0]), ours(ends[1]);
  SessionAsk right;
  std::vector<std::uint8_t> bytes(sizeof right);
  std::memcpy(bytes.data(), &right, sizeof right);
  const std::uint8_t kind = input.byte();
  const std::size_t length = kind % 4 == 0 ? std::size_t{input.byte()} * 2 : bytes.size();
  bytes.resize(length);
  for (int k = input.byte() % 8; k > 0 && !bytes.empty(); --k)
    bytes[(input.byte() + 256u * (input.byte() % 2)) % bytes.size()] = input.byte();
  if (kind % 3 == 0 && bytes.size() == sizeof right) {  // its layout put right, or little passes
    std::memcpy(bytes.data(), &right, offsetof(SessionAsk, history_s));
  }
  std::vector<int> with;
  const std::size_t count =
      kind % 5 == 0 ? input.byte() % (kMostSessionDescriptors + 1) : SessionAsk::kDescriptors;
  for (std::size_t k = 0; k < count; ++k) with.push_back(kGiven[input.byte() % kGiven.size()]);
  require(send_message(theirs.get(), std::as_bytes(std::span(bytes)), with) == 0, "it is sent");
  SessionAsk asked;
  const SessionMessage message =
      take_message(ours.get(), std::as_writable_bytes(std::span(&asked, 1)));
  const std::string defect = defect_of(message, asked);
  if (!defect.empty()) {
    require(defect.size() < 1000, "a reason of bounded length");
    return;
  }
  require(asked.layout == SessionLayout{} && asked.hands <= kSessionDevices &&
              asked.history_s >= 0 && asked.history_s <= kMostSessionHistory_s &&
              message.descriptor_count == SessionAsk::kDescriptors,
          "a request that is taken is within its ranges");
  SharedView view;
  if (view.map(message.descriptors[0], sizeof(SessionDown)) != 0) return;
  require(view.bytes().size() >= sizeof(SessionDown), "memory of its size");
}

/// Memory of the other side with any bytes in it.
void read_memory(ReportStream& input) {
  static auto up = std::make_unique<SessionUp>();
  auto* const bytes = reinterpret_cast<std::uint8_t*>(up.get());
  NewestWriter<SessionStatus> writer(up->status);
  EventWriter events(up->events);
  while (!input.empty()) {
    switch (input.byte() % 4) {
      case 0:
        writer.publish(SessionStatus{});
        break;
      case 1:
        events.write(SessionEvent{});
        break;
      case 2:
        std::memset(bytes + (input.byte() * 997u) % sizeof(SessionUp) / 2, input.byte(),
                    input.byte());
        break;
      default:
        for (int k = input.byte() % 16; k > 0; --k)
          bytes[(input.byte() * 251u + input.byte()) % sizeof(SessionUp)] = input.byte();
        break;
    }
  }
  const SessionStatus status = NewestReader<SessionStatus>(up->status).newest();
  require(text_in(status.why).size() <= sizeof status.why, "a text within its field");
  for (const SessionDeviceStatus& device : status.devices)
    require(text_in(device.waits_for).size() <= sizeof device.waits_for, "a text within its field");
  const std::uint64_t newest = up->events.newest.load();
  for (std::uint64_t k = 0; k < EventRing::kEvents; ++k) {
    SessionEvent event;
    if (copy_event(up->events, newest - k, event))
      require(text_in(event.text).size() <= sizeof event.text, "a text within its field");
  }
}

/// A map of the other side: usable, or the identity.
void read_map(ReportStream& input) {
  MapRecord record;
  const auto raw = input.bytes<sizeof record>();
  if (input.byte() % 4 == 0) std::memcpy(static_cast<void*>(&record), raw.data(), sizeof record);
  record.scale = static_cast<double>(input.number());
  for (double& x : record.offset_w) x = static_cast<double>(input.number());
  require(is_usable(map_of(record)), "a map that can be used");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  ReportStream input(std::span<const std::uint8_t>(data + 1, size - 1));
  if (data[0] % 3 == 1) read_memory(input);
  if (data[0] % 3 == 2) read_map(input);
  if (data[0] % 3 != 0) return 0;
  ask(input);  // the first makes what all are given
  const int before = fuzz::lowest_descriptor();
  ReportStream again(std::span<const std::uint8_t>(data + 1, size - 1));
  ask(again);
  require(fuzz::lowest_descriptor() == before, "no descriptor is left open");
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  return {{"right", std::string("\0\3\0\0\1", 5)},
          {"changed", std::string("\0\1\3\x10\0\x55\x20\0\xff\x30\0\1\0\1", 14)},
          {"short", std::string("\0\4\x10\0\0\1", 6)},
          {"many_descriptors", std::string("\0\5\0\x08\0\1\2\0\1\2\0\1", 12)},
          {"memory", std::string("\1\0\1\3\x0f", 5) + std::string(45, '\x37') + "\1\2\7\xff\x80"},
          {"map", std::string("\2") + std::string(240, '\x3f')}};
}
