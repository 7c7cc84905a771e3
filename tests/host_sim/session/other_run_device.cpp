// SPDX-License-Identifier: Apache-2.0
// In place of run_device: a program that takes the request of a session and answers as HAPTIC_OTHER
// says, to see what the library makes of it.
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <random>
#include <span>
#include <string_view>

#include "hal/realtime/shared_memory.hpp"
#include "rt_core/exchange/step_trace.hpp"
#include "tools/session/session_channel.hpp"
#include "tools/session/session_records.hpp"

using namespace haptic;
using namespace haptic::tools;

int main(int argc, char** argv) {
  const std::string_view as = std::getenv("HAPTIC_OTHER");
  const int socket = argc == 5 ? std::atoi(argv[4]) : -1;
  if (as == "ends") return 7;
  if (as == "older") {  // as a program that does not know the option
    static constexpr char kWords[] =
        "run_device: The following argument was not expected: --session\n";
    (void)!write(STDERR_FILENO, kWords, sizeof kWords - 1);
    return 2;
  }
  SessionAsk ask;
  if (!waits_for_message(socket, 5000)) return 8;
  (void)take_message(socket, std::as_writable_bytes(std::span(&ask, 1)));

  const std::size_t flight_bytes = FlightRecorder::bytes_for(100);
  const std::size_t tick_bytes = sizeof(NewestRecord<SessionTick>);
  hal::SharedMemory up(sizeof(SessionUp), hal::SharedMemory::Readers::kByDescriptor);
  hal::SharedMemory ticks(tick_bytes + flight_bytes, hal::SharedMemory::Readers::kByDescriptor);
  SessionHello hello;
  hello.devices = hello.processes = 1;
  hello.period_ns = 1'000'000;
  hello.of[0].tick = {0, tick_bytes};
  hello.of[0].flight = {tick_bytes, flight_bytes};
  int second = ticks.descriptor();
  std::size_t size = sizeof hello;
  if (as == "version") hello.layout.version += 1;
  if (as == "layout") hello.layout.trace_bytes += 8;
  if (as == "short") size = 20;
  if (as == "garbage") std::memset(static_cast<void*>(&hello), 0x5a, sizeof hello);
  if (as == "devices") hello.devices = 3;
  if (as == "processes") hello.processes = 1000;
  if (as == "range") hello.of[0].tick.begin = 1u << 20;
  if (as == "overflow") hello.of[0].flight = {64, ~std::uint64_t{0} - 32};
  if (as == "unaligned") hello.of[0].tick.begin = 1;
  if (as == "shrinks") {  // memory that it could take away below the reader
    second = memfd_create("other", MFD_CLOEXEC);
    if (ftruncate(second, static_cast<off_t>(tick_bytes + flight_bytes)) != 0) return 9;
  }
  std::array<int, 2> descriptors{up.descriptor(), second};
  const std::size_t count = as == "descriptors" ? 1 : 2;
  if (send_message(socket, std::as_bytes(std::span(&hello, 1)).first(size),
                   std::span(descriptors).first(count)) != 0)
    return 10;
  if (as == "twice") (void)send_message(socket, std::as_bytes(std::span(&hello, 1)), descriptors);
  const std::array<std::byte, 1> begun{static_cast<std::byte>(kSessionBegun)};
  if (as == "scribbles") {
    // Each copy of a record that is whole has any bytes in it.
    new (up.bytes().data()) SessionUp{};
    new (ticks.bytes().data()) NewestRecord<SessionTick>{};
    auto* const own = reinterpret_cast<SessionUp*>(up.bytes().data());
    NewestWriter<SessionStatus> status(own->status);
    NewestWriter<SessionTick> tick(
        *reinterpret_cast<NewestRecord<SessionTick>*>(ticks.bytes().data()));
    EventWriter events(own->events);
    std::mt19937_64 random(7);
    const auto fill = [&random](void* to, std::size_t bytes) {
      for (std::size_t k = 0; k < bytes; ++k)
        static_cast<unsigned char*>(to)[k] = static_cast<unsigned char>(random() >> 40);
    };
    (void)send_message(socket, begun);
    for (int k = 0; k < 20'000 && !waits_for_message(socket, 0); ++k) {
      alignas(SessionStatus) unsigned char s[sizeof(SessionStatus)];
      alignas(SessionTick) unsigned char t[sizeof(SessionTick)];
      alignas(SessionEvent) unsigned char e[sizeof(SessionEvent)];
      fill(s, sizeof s);
      fill(t, sizeof t);
      fill(e, sizeof e);
      status.publish(*reinterpret_cast<SessionStatus*>(s));
      tick.publish(*reinterpret_cast<SessionTick*>(t));
      events.write(*reinterpret_cast<SessionEvent*>(e));
      fill(ticks.bytes().data() + tick_bytes, flight_bytes);
      if (k % 100 == 0) own->events.newest.store(random());
    }
    return 0;
  }
  (void)send_message(socket, begun);
  (void)waits_for_message(socket, 5000);
  return 0;
}
