// SPDX-License-Identifier: Apache-2.0
/// Bytes of a spacenavd of either version, in pieces, and the file that says where
/// it listens: the same units in pieces of any size, texts that end and are printable, and a
/// path of one line.
#include <cstring>
#include <utility>

#include "hal/drivers/spacenav_socket.hpp"
#include "tests/fuzz/report_stream.hpp"
#include "tools/bridges/spacenav/spacenav_protocol.hpp"

namespace {

using namespace haptic;
using namespace haptic::tools;
using fuzz::require;
using Item = SpnavStream::Item;

/// A second reading of the same bytes, all at once.
std::vector<std::pair<Item, SpnavUnit>> items_of(std::span<const std::uint8_t> bytes) {
  std::vector<std::pair<Item, SpnavUnit>> items;
  while (bytes.size() >= 4) {
    SpnavUnit unit;
    std::uint32_t head = 0;
    std::memcpy(&head, bytes.data(), 4);
    if (head >> 8 == 0x7faa55u) {
      unit.data[0] = static_cast<std::int32_t>(head & 0xffu);
      items.emplace_back(Item::kVersion, unit);
      bytes = bytes.subspan(4);
      continue;
    }
    if (bytes.size() < 32) break;
    std::memcpy(&unit, bytes.data(), 32);
    items.emplace_back(Item::kUnit, unit);
    bytes = bytes.subspan(32);
  }
  return items;
}

/// As a bridge takes a text in: a new one after an end or a refusal.
class Texts {
 public:
  void add(const SpnavUnit& unit) {
    const SpnavText::State state = text_.add(unit);
    require(text_.text().size() <= kSpnavMostText, "a text of at most its length");
    for (const char c : text_.text()) require(c >= ' ' && c <= '~', "a text is printable");
    require(++pieces_ <= kSpnavMostText / 24 + 1, "a text ends");
    if (state == SpnavText::State::kMore) return;
    text_ = SpnavText();
    pieces_ = 0;
  }

 private:
  SpnavText text_;
  std::size_t pieces_ = 0;
};

void read_stream(std::uint8_t seed, std::span<const std::uint8_t> bytes) {
  const auto expected = items_of(bytes);
  std::size_t at = 0;
  SpnavStream stream;
  Texts texts;
  std::uint32_t random = seed;
  while (!bytes.empty()) {
    const std::span<std::byte> room = stream.room();
    require(!room.empty(), "there is room for more");
    random = random * 1664525u + 1013904223u;
    const std::size_t count =
        std::min({bytes.size(), room.size(), std::size_t{1} + (random >> 24)});
    std::memcpy(room.data(), bytes.data(), count);
    bytes = bytes.subspan(count);
    stream.added(count);
    SpnavUnit unit;
    for (Item item = stream.next(unit); item != Item::kNone; item = stream.next(unit)) {
      require(at < expected.size() && expected[at].first == item &&
                  std::memcmp(&expected[at].second, &unit, sizeof unit) == 0,
              "the same units in pieces of any size");
      ++at;
      require(!is_answer(unit, kSpnavDeviceName) || is_answer(unit),
              "an answer to it is an answer");
      (void)is_refused(unit);
      texts.add(unit);
    }
  }
  require(at == expected.size(), "every unit that is whole");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  if (data[0] % 4 == 0) {
    const std::string path =
        hal::spacenav_path_of({reinterpret_cast<const char*>(data + 1), size - 1});
    require(path.find('\n') == std::string::npos && path.size() < size, "a path of one line");
    return 0;
  }
  read_stream(data[0], std::span<const std::uint8_t>(data + 1, size - 1));
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  const auto bytes_of = [](std::initializer_list<std::int32_t> words) {
    std::string bytes;
    for (const std::int32_t word : words) {
      char part[4];
      std::memcpy(part, &word, 4);
      bytes.append(part, 4);
    }
    return bytes;
  };
  const std::string motion = bytes_of({0, 12, -350, 7, 0, 1, -1, 16});
  const std::string press = bytes_of({1, 3, 0, 0, 0, 0, 0, 0});
  const std::string version = bytes_of({kSpnavChangeProtocol | 1});
  const std::string added = bytes_of({3, 0, 1, 0, 0x256f, 0xc635, 0, 0});
  const std::int32_t name = 0x7faa0000 | kSpnavDeviceName;
  const std::string long_name =
      bytes_of({name, 0x65636170, 0x73756f6d, 0x72702065, 0x6c20206f, 0x20676e6f, 0x656d616e, 30}) +
      bytes_of({name, 0x65636170, 0, 0, 0, 0, 0, 6 | 0x10000});
  const std::string refused = bytes_of({0x7faa0000 | kSpnavDeviceUsb, 0, 0, 0, 0, 0, 0, -1});
  return {{"version_0", "\1" + motion + press + motion},
          {"version_1", "\2" + version + long_name + refused + added + motion + press},
          {"answer_between", "\3" + motion + version + motion},
          {"file", std::string(1, '\0') + "# a comment\n socket = /run/spnav.sock \nled = on\n"}};
}
