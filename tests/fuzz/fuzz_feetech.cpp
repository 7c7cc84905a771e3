// SPDX-License-Identifier: Apache-2.0
/// Any bytes on a bus of Feetech servos, in pieces of any size: an answer is given only for a
/// packet whose sum is right, within its room, and the answer behind them is found.
#include "tests/fuzz/report_stream.hpp"
#include "tools/bridges/feetech/feetech_packet.hpp"

namespace {

using namespace haptic;
using namespace haptic::tools;
using fuzz::ReportStream;
using fuzz::require;

void feed(FeetechInput& input, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const std::span<std::uint8_t> room = input.room();
    require(!room.empty(), "there is room for more");
    const std::size_t count = std::min(room.size(), bytes.size());
    std::copy_n(bytes.begin(), count, room.begin());
    input.added(count);
    bytes = bytes.subspan(count);
  }
}

/// A packet as it stands on the wire, its sum right.
std::vector<std::uint8_t> answer_of(std::uint8_t id, std::span<const std::uint8_t> error_and_data) {
  std::vector<std::uint8_t> packet(4 + error_and_data.size() + 1, 0xff);
  packet[2] = id;
  packet[3] = static_cast<std::uint8_t>(error_and_data.size() + 1);
  std::copy(error_and_data.begin(), error_and_data.end(), packet.begin() + 4);
  unsigned sum = 0;
  for (std::size_t k = 2; k + 1 < packet.size(); ++k) sum += packet[k];
  packet.back() = static_cast<std::uint8_t>(~sum & 0xffu);
  return packet;
}

void drain(FeetechInput& input) {
  FeetechStatus status;
  for (std::size_t turn = 0;; ++turn) {
    require(turn <= 4 * kMaxFeetechPacket, "bounded turns");
    const FeetechRead read = input.next(status);
    if (read == FeetechRead::kNothing) return;
    if (read != FeetechRead::kStatus) continue;
    require(status.id < kFeetechBroadcast, "a servo's own number");
    require(status.parameters.size() <= kMaxFeetechPacket, "within a packet");
    // The sum once more, over what was given out.
    unsigned sum = status.id + unsigned{status.error} + unsigned(status.parameters.size() + 2);
    for (const std::uint8_t byte : status.parameters) sum += byte;
    require((*(status.parameters.data() + status.parameters.size()) ^ (~sum & 0xffu)) == 0,
            "its sum is right");
    if (status.parameters.size() >= 2)
      require(std::abs(feetech_number(status.parameters)) <= 0x7fff, "a number of 15 bits");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReportStream stream(std::span<const std::uint8_t>(data, size));
  FeetechInput input;
  while (!stream.empty()) {
    const std::uint8_t kind = stream.byte();
    if (kind % 4 == 0) {
      const std::uint8_t id = stream.byte();
      feed(input, answer_of(id, stream.take(1 + stream.byte() % 60)));
    } else {
      feed(input, stream.report());
    }
    if (kind % 3 == 0) drain(input);
  }
  drain(input);
  input.clear();
  std::vector<std::uint8_t> data_of{4};
  data_of.insert(data_of.end(), data, data + std::min<std::size_t>(size, 50));
  feed(input, answer_of(9, data_of));
  FeetechStatus status;
  require(input.next(status) == FeetechRead::kStatus && status.id == 9 && status.error == 4,
          "the answer behind is found");
  require(std::equal(data_of.begin() + 1, data_of.end(), status.parameters.begin(),
                     status.parameters.end()),
          "parameters come out as they went in");
  const FeetechOutput output(1, FeetechInstruction::kSyncRead, {data, size});
  require(output.bytes().size() <= kMaxFeetechPacket, "a packet of at most its room");
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  const std::string answer("\xff\xff\1\4\0\x18\5\xdd", 8);
  return {{"answer", "\1\x08" + answer},
          {"pieces", "\1\3" + answer.substr(0, 3) + "\3\5" + answer.substr(3)},
          {"sealed", std::string("\4\2\7\0abcdef\4\3\2\0a", 15)},
          {"echo", std::string("\1\x08\xff\xff\xfe\4\x82\x38\6\x3d", 10) + "\1\x08" + answer},
          {"noise", std::string("\5\x7f") + std::string(127, '\xff')}};
}
