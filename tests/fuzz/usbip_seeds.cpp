// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_usbip: what a kernel says to enumerate, poll and command the device, and what it
/// would not say.
#include <array>

#include "host_sim/device/usbip_codec.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

using namespace sim;

std::string text_of(const UsbipMessage& message) {
  std::array<std::uint8_t, kUsbipHeaderBytes> header{};
  encode(message, header);
  return {header.begin(), header.end()};
}

std::string request(std::uint32_t sequence, std::array<std::uint8_t, 8> setup, std::uint32_t room) {
  UsbipSubmit submit;
  submit.sequence = sequence;
  submit.to_host = (setup[0] & 0x80u) != 0;
  submit.byte_count = room;
  submit.setup = setup;
  return text_of(submit);
}

std::string in(std::uint32_t sequence, std::uint32_t room, std::uint32_t flags = 0) {
  UsbipSubmit submit;
  submit.sequence = sequence;
  submit.to_host = true;
  submit.endpoint = 1;
  submit.byte_count = room;
  submit.flags = flags;
  return text_of(submit);
}

std::string out(std::uint32_t sequence, std::uint32_t count) {
  UsbipSubmit submit;
  submit.sequence = sequence;
  submit.endpoint = 1;
  submit.byte_count = count;
  return text_of(submit) + std::string(count, 'x');
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string device = request(1, {0x80, 6, 0, 1, 0, 0, 18, 0}, 18);
  const std::string configuration = request(2, {0x80, 6, 0, 2, 0, 0, 255, 0}, 255);
  const std::string configure = request(3, {0x00, 9, 1, 0, 0, 0, 0, 0}, 0);
  const std::string status = request(4, {0x82, 0, 0, 0, 0x81, 0, 2, 0}, 2);
  const std::string vendor = request(5, {0xc1, 1, 1, 0, 0, 0, 64, 0}, 64);
  const std::string unlink = text_of(UsbipUnlink{20, 0, 10});
  return {
      {"enumerate", device + configuration + configure + status + vendor},
      {"reports", in(10, 96) + in(11, 96) + out(12, 56) + out(13, 96) + in(14, 8) + out(15, 56)},
      {"short_not_ok", in(10, 96, kUsbipShortNotOk) + out(12, 8)},
      {"taken_back", in(10, 96) + unlink + unlink + out(12, 56)},
      {"same_number", in(10, 96) + out(10, 56) + in(10, 96)},
      {"no_endpoint", request(9, {}, 0) + text_of(UsbipSubmit{8, 0, true, 5, 0, 10, 0, {}})},
      {"device_side", text_of(UsbipSubmitEnd{1, -32, 9}) + device},
      {"unlink_end", text_of(UsbipUnlinkEnd{1, -104})},
      {"setup_against_direction",
       request(6, {0x40, 6, 0, 2, 0, 0, 0xff, 0xff}, 3) + "abc" +
           text_of(UsbipSubmit{7, 0, false, 0, 0, 4, 0, {0x80, 6, 0, 1}}) + "abcd"},
      {"cut_header", device.substr(0, 30)},
      {"cut_bytes", out(12, 56).substr(0, 70)},
      {"zeros", std::string(100, '\0')}};
}

}  // namespace haptic::fuzz
