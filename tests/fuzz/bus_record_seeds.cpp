// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_bus_record: a header alone, one record of each kind, a short session.
#include <array>

#include "hal/usb/bus_record.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

using namespace haptic::hal;
using Bytes = std::vector<std::uint8_t>;

Bytes header() {
  BusSession session;
  session.scene_hash = 0x0123'4567'89ab'cdefu;
  session.driver = "reference 6-DOF device";
  Bytes file;
  append_header(file, session);
  return file;
}

void add_event(Bytes& file, std::uint8_t kind, std::size_t size) {
  const std::vector<std::uint8_t> bytes(size, std::uint8_t{0x5a});
  LinkEvent event;
  event.kind = static_cast<LinkEventKind>(kind);
  event.code = 1;
  event.stamp_ns = 1'000'000'000 + kind;
  event.number = kind;
  event.bytes = bytes;
  append_event(file, event);
}

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace

std::vector<Seed> seeds() {
  const std::array<std::int64_t, 3> stamps{1'000'000'000, 1'000'000'100, 1'000'500'000};
  Bytes kinds = header();
  for (std::uint8_t kind = 1; kind <= kMostLinkEventKind; ++kind) {
    if (kind == static_cast<std::uint8_t>(LinkEventKind::kClock)) {
      append_clocks(kinds, stamps);
    } else {
      add_event(kinds, kind, kind);
    }
  }
  RecordedTick tick;
  tick.tick = 1;
  tick.command_d = {1, -2, 3, 0.1, 0, -0.1};
  append_tick(kinds, tick);
  RecordedGiven given;
  given.number = 2;
  given.frame.number = 7;
  given.frame.p_m[1] = -0.25;
  append_given(kinds, given);
  append_given(kinds, {RecordedGiven::Kind::kTake, 3, {}});
  append_given(kinds, {RecordedGiven::Kind::kRelease, 0, {}});
  append_end(kinds, {kMostLinkEventKind + 4u, 0, 0});

  Bytes session = header();
  for (int k = 0; k < 3; ++k) {
    add_event(session, static_cast<std::uint8_t>(LinkEventKind::kTurn), 0);
    append_clocks(session, stamps);
    add_event(session, static_cast<std::uint8_t>(LinkEventKind::kReport), 96);
    add_event(session, static_cast<std::uint8_t>(LinkEventKind::kSend), 56);
    append_tick(session, tick);
    ++tick.tick;
  }
  Bytes cut = session;
  cut.resize(cut.size() - 17);
  Bytes damaged = kinds;
  damaged[header().size() + 9] ^= 1;
  return {{"header", text_of(header())},
          {"kinds", text_of(kinds)},
          {"session", text_of(session)},
          {"cut", text_of(cut)},
          {"damaged", text_of(damaged)}};
}

}  // namespace haptic::fuzz
