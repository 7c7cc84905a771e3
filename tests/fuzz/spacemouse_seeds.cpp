// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_spacemouse: descriptors with joined and split axes, of a mouse, with pushes, long
/// items and sizes at their limits; reports of every kind behind them.
#include <array>

#include "hal/drivers/spacemouse_codec.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/spacemouse_counterpart.hpp"

namespace haptic::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <typename Sequence>
std::string text_of(const Sequence& bytes) {
  return {bytes.begin(), bytes.end()};
}

std::string with_descriptor(char model, const Bytes& descriptor) {
  std::string text(1, model);
  text += static_cast<char>(descriptor.size() & 0xff);
  text += static_cast<char>(descriptor.size() >> 8);
  return text + text_of(descriptor);
}

/// 1 << 23 ns: about 8 ms; then the report.
std::string report(const std::string& bytes) {
  return std::string("\x17") + static_cast<char>(bytes.size()) + bytes;
}

std::string reports() {
  const std::array<std::int16_t, 6> axes{350, -350, 20, 1000, -32768, 32767};
  const std::array<std::int16_t, 6> rest{};
  const std::array<std::int16_t, 3> three{-200, 0, 111};
  return report(text_of(hal::encode_long(axes))) + report(text_of(hal::encode_short(1, three))) +
         report(text_of(hal::encode_short(2, three))) + report(std::string("\x03\x05\0\0\0", 5)) +
         report("\x17\x50") + report("\x01") + report(text_of(hal::encode_long(rest)));
}

}  // namespace

std::vector<Seed> seeds() {
  const Bytes mouse{0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0x05, 0x09, 0x19, 0x01, 0x29, 0x03,
                    0x15, 0x00, 0x25, 0x01, 0x95, 0x03, 0x75, 0x01, 0x81, 0x02, 0x95, 0x01,
                    0x75, 0x05, 0x81, 0x01, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x15, 0x81,
                    0x25, 0x7f, 0x75, 0x08, 0x95, 0x02, 0x81, 0x06, 0xc0};
  const Bytes odd{0x05, 0x01, 0xa4, 0x17, 0x00, 0x00, 0x00, 0x80, 0x27, 0xff, 0xff, 0xff,
                  0x7f, 0x75, 0x20, 0x95, 0x06, 0x1b, 0x30, 0x00, 0x01, 0x00, 0x2b, 0x35,
                  0x00, 0x01, 0x00, 0xfe, 0x02, 0x33, 0x01, 0x02, 0x81, 0x02, 0xb4};
  const Bytes endless{0x05, 0x01, 0x15, 0x80, 0x25, 0x7f, 0x77, 0xff, 0xff, 0xff,
                      0xff, 0x97, 0xff, 0xff, 0xff, 0xff, 0x1b, 0x00, 0x00, 0x00,
                      0x00, 0x2b, 0xff, 0xff, 0xff, 0xff, 0x81, 0x02};
  return {{"joined", with_descriptor(17, test::spacemouse_descriptor(350, true)) + reports()},
          {"split", with_descriptor(6, test::spacemouse_descriptor(500, false)) + reports()},
          {"older", with_descriptor(0, test::spacemouse_descriptor(32767, true)) + reports()},
          {"mouse", with_descriptor(9, mouse) + reports()},
          {"pushes", with_descriptor(1, odd) + reports()},
          {"endless", with_descriptor(2, endless) + reports()},
          {"no_descriptor", with_descriptor(3, {}) + reports()}};
}

}  // namespace haptic::fuzz
