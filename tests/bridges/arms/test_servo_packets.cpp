// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/support/random.hpp"
#include "tools/bridges/dynamixel/dynamixel_packet.hpp"
#include "tools/bridges/feetech/feetech_packet.hpp"

using namespace haptic::tools;
using Bytes = std::vector<std::uint8_t>;

namespace {

Bytes dynamixel_packet(std::uint8_t id, DynamixelInstruction instruction, const Bytes& parameters) {
  DynamixelOutput output;
  REQUIRE(output.add(id, instruction, parameters));
  return {output.bytes().begin(), output.bytes().end()};
}

template <typename Input>
void feed(Input& input, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto room = input.room();
    REQUIRE(!room.empty());
    const std::size_t count = std::min(room.size(), bytes.size());
    std::ranges::copy(bytes.first(count), room.begin());
    input.added(count);
    bytes = bytes.subspan(count);
  }
}

}  // namespace

TEST_SUITE("bridges.servo_packets") {
  TEST_CASE("DYNAMIXEL: the packets of the e-Manual, byte by byte") {
    using enum DynamixelInstruction;
    CHECK(dynamixel_packet(1, kPing, {}) == Bytes{0xff, 0xff, 0xfd, 0, 1, 3, 0, 1, 0x19, 0x4e});
    CHECK(dynamixel_packet(1, kRead, {0x84, 0, 4, 0}) ==
          Bytes{0xff, 0xff, 0xfd, 0, 1, 7, 0, 2, 0x84, 0, 4, 0, 0x1d, 0x15});
    CHECK(dynamixel_packet(1, kWrite, {0x74, 0, 0, 2, 0, 0}) ==
          Bytes{0xff, 0xff, 0xfd, 0, 1, 9, 0, 3, 0x74, 0, 0, 2, 0, 0, 0xca, 0x89});
    DynamixelInput input;
    feed(input,
         Bytes{0x00, 0xff, 0xff, 0xff, 0xfd, 0, 1, 8, 0, 0x55, 0, 0xa6, 0, 0, 0, 0x8c, 0xc0, 0xff});
    DynamixelStatus status;
    REQUIRE(input.next(status) == DynamixelRead::kStatus);
    CHECK(status.id == 1);
    CHECK(status.error == 0);
    REQUIRE(status.parameters.size() == 4);
    CHECK(int32_at(status.parameters) == 166);
    CHECK(input.next(status) == DynamixelRead::kNothing);
  }

  TEST_CASE("DYNAMIXEL: what looks like a header is stuffed, and comes out as it went in") {
    const Bytes data{0xff, 0xff, 0xfd, 0xff, 0xff, 0xfd, 0xfd, 1, 0xff, 0xff, 0xfd};
    Bytes answer{0};
    answer.insert(answer.end(), data.begin(), data.end());
    const Bytes packet = dynamixel_packet(7, DynamixelInstruction::kStatus, answer);
    CHECK(packet.size() == 8 + answer.size() + 3 + 2);
    DynamixelInput input;
    feed(input, packet);
    DynamixelStatus status;
    REQUIRE(input.next(status) == DynamixelRead::kStatus);
    CHECK(Bytes(status.parameters.begin(), status.parameters.end()) == data);
    DynamixelOutput output;
    CHECK_FALSE(output.add(1, DynamixelInstruction::kWrite, Bytes(200)));
  }

  TEST_CASE("DYNAMIXEL: each bit of an answer flipped is a wrong check sum or no packet") {
    const Bytes right = dynamixel_packet(3, DynamixelInstruction::kStatus, {0, 1, 2, 3, 4});
    for (std::size_t bit = 0; bit < 8 * right.size(); ++bit) {
      Bytes wrong = right;
      wrong[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      DynamixelInput input;
      feed(input, wrong);
      DynamixelStatus status;
      CHECK(input.next(status) != DynamixelRead::kStatus);
      feed(input, Bytes(300));  // the bytes that it waited for have come
      feed(input, right);
      DynamixelRead got = input.next(status);
      while (got == DynamixelRead::kWrongCheck) got = input.next(status);
      CHECK(got == DynamixelRead::kStatus);
    }
  }

  TEST_CASE("Feetech: the packets of the protocol manual, signs, each bit flipped") {
    const FeetechOutput read(1, FeetechInstruction::kRead, Bytes{0x38, 2});
    CHECK(Bytes(read.bytes().begin(), read.bytes().end()) ==
          Bytes{0xff, 0xff, 1, 4, 2, 0x38, 2, 0xbe});
    const Bytes right{0xff, 0xff, 1, 4, 0, 0x18, 0x05, 0xdd};
    FeetechInput input;
    feed(input, right);
    FeetechStatus status;
    REQUIRE(input.next(status) == FeetechRead::kStatus);
    CHECK(feetech_number(status.parameters) == 0x518);
    CHECK(feetech_number(Bytes{5, 0x80}) == -5);
    for (std::size_t bit = 0; bit < 8 * right.size(); ++bit) {
      Bytes wrong = right;
      wrong[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      input.clear();
      feed(input, wrong);
      CHECK(input.next(status) != FeetechRead::kStatus);
    }
  }

  TEST_CASE("any bytes: parsers stay within them and find the packet behind") {
    constexpr std::array<std::uint8_t, 8> kLikely{0xff, 0xff, 0xfd, 0x00, 0x01, 0x55, 0xfe, 0x04};
    haptic::test::Random random(5);
    const Bytes dynamixel = dynamixel_packet(9, DynamixelInstruction::kStatus, {0, 0x42});
    const Bytes feetech{0xff, 0xff, 1, 4, 0, 0x18, 0x05, 0xdd};
    for (int trial = 0; trial < 4000; ++trial) {
      Bytes noise(random.next() % 700);
      for (std::uint8_t& byte : noise) {
        byte = kLikely[random.next() % kLikely.size()];
        if (random.next() % 3 == 0) byte = static_cast<std::uint8_t>(random.next());
      }
      DynamixelInput from_dynamixel;
      FeetechInput from_feetech;
      DynamixelStatus d;
      FeetechStatus f;
      const auto drain = [&] {
        int rounds = 0;
        while (from_dynamixel.next(d) != DynamixelRead::kNothing) {
          CHECK(d.parameters.size() <= kMaxDynamixelPacket);
          static_cast<void>(block_of(d, random.next() % 10, random.next() % 40));
          REQUIRE(++rounds < 1000);
        }
        while (from_feetech.next(f) != FeetechRead::kNothing) {
          CHECK(f.parameters.size() <= kMaxFeetechPacket);
          REQUIRE(++rounds < 2000);
        }
      };
      feed(from_dynamixel, noise);
      feed(from_feetech, noise);
      drain();
      // A cycle begins with nothing of the one before.
      from_dynamixel.clear();
      from_feetech.clear();
      feed(from_dynamixel, dynamixel);
      feed(from_feetech, feetech);
      CHECK(from_dynamixel.next(d) == DynamixelRead::kStatus);
      CHECK(from_feetech.next(f) == FeetechRead::kStatus);
    }
  }
}
