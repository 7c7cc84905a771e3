// SPDX-License-Identifier: Apache-2.0
/// Any bytes on a bus of DYNAMIXEL servos, in pieces of any size: an answer is given for each
/// packet whose check is right and for no other, within its room, and the answer behind them is
/// found.
#include "tests/fuzz/report_stream.hpp"
#include "tools/bridges/dynamixel/dynamixel_packet.hpp"

namespace {

using namespace haptic;
using namespace haptic::tools;
using fuzz::ReportStream;
using fuzz::require;

/// A packet as it stands on the wire, its check right.
std::vector<std::uint8_t> packet_of(std::uint8_t id, DynamixelInstruction instruction,
                                    std::span<const std::uint8_t> parameters) {
  DynamixelOutput output;
  if (!output.add(id, instruction, parameters)) return {};
  return {output.bytes().begin(), output.bytes().end()};
}

void feed(DynamixelInput& input, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const std::span<std::uint8_t> room = input.room();
    require(!room.empty(), "there is room for more");
    const std::size_t count = std::min(room.size(), bytes.size());
    std::copy_n(bytes.begin(), count, room.begin());
    input.added(count);
    bytes = bytes.subspan(count);
  }
}

/// @return answers found; each is read as a servo's and as a fast one.
std::size_t drain(DynamixelInput& input) {
  DynamixelStatus status;
  std::size_t found = 0;
  for (std::size_t turn = 0;; ++turn) {
    require(turn <= 2 * kMaxDynamixelPacket, "bounded turns");
    const DynamixelRead read = input.next(status);
    if (read == DynamixelRead::kNothing) return found;
    if (read != DynamixelRead::kStatus) continue;
    ++found;
    require(status.parameters.size() <= kMaxDynamixelPacket, "within a packet");
    for (const std::size_t bytes : {std::size_t{2}, std::size_t{10}, std::size_t{200}}) {
      for (std::size_t k = 0; k < 12; ++k) {
        const DynamixelBlock block = block_of(status, k, bytes);
        require(block.data.empty() || block.data.size() == bytes, "a block is whole, or none");
      }
    }
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReportStream stream(std::span<const std::uint8_t>(data, size));
  DynamixelInput input;
  while (!stream.empty()) {
    const std::uint8_t kind = stream.byte();
    if (kind % 4 == 0) {  // its check put right, or no mutation would pass
      const std::uint8_t id = stream.byte();
      const auto instruction = static_cast<DynamixelInstruction>(
          kind % 8 == 0 ? static_cast<std::uint8_t>(DynamixelInstruction::kStatus) : kind);
      feed(input, packet_of(id, instruction, stream.report()));
    } else {
      feed(input, stream.report());
    }
    if (kind % 3 == 0) (void)drain(input);
  }
  (void)drain(input);
  // A cycle begins with nothing of the one before, and stuffing comes out as it went in.
  input.clear();
  std::vector<std::uint8_t> answer{0};
  answer.insert(answer.end(), data, data + std::min<std::size_t>(size, 150));
  const std::vector<std::uint8_t> packet = packet_of(9, DynamixelInstruction::kStatus, answer);
  require(!packet.empty(), "an answer of this length fits");
  feed(input, packet);
  DynamixelStatus status;
  require(input.next(status) == DynamixelRead::kStatus && status.id == 9,
          "the answer behind is found");
  require(std::equal(answer.begin() + 1, answer.end(), status.parameters.begin(),
                     status.parameters.end()),
          "parameters come out as they went in");
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  const auto with_length = [](char kind, const std::string& bytes) {
    return std::string(1, kind) + static_cast<char>(bytes.size()) + bytes;
  };
  const std::string answer("\xff\xff\xfd\0\1\x08\0\x55\0\xa6\0\0\0\x8c\xc0", 15);
  const std::string stuffed("\xff\xff\xfd\xff\xff\xfd\xfd\1", 8);
  return {
      {"answer", with_length('\1', answer)},
      {"pieces", with_length('\1', answer.substr(0, 6)) + with_length('\3', answer.substr(6))},
      {"sealed", std::string("\x08\2\7", 3) + stuffed.substr(0, 7)},
      {"fast", std::string("\x08\xfe\x0e\0\1abcdefgh\0\2ab", 17)},
      {"noise", with_length('\5', std::string(200, '\xff') + std::string("\xfd\0\1\xff\xff", 5))}};
}
