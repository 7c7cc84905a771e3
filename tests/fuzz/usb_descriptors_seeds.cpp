// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_usb_descriptors: the reference device's own, endpoints in another order or
/// missing, several interfaces and settings, and lengths that contradict each other.
#include "host_sim/device/reference_usb.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

/// A configuration with these descriptors behind its own nine bytes.
std::string device_of(const std::string& inside, std::uint8_t interfaces = 1) {
  const std::vector<std::uint8_t> reference = sim::reference_descriptors();
  const std::size_t total = 9 + inside.size();
  std::string text(reference.begin(), reference.begin() + 18);
  text += std::string("\x09\x02", 2);
  text += static_cast<char>(total & 0xffu);
  text += static_cast<char>(total >> 8u);
  text += static_cast<char>(interfaces);
  return text + std::string("\x01\x00\xc0\x00", 4) + inside;
}

std::string interface(char number, char setting, char endpoints) {
  std::string text("\x09\x04\x00\x00\x00\xff\x00\x00\x00", 9);
  text[2] = number;
  text[3] = setting;
  text[4] = endpoints;
  return text;
}

std::string endpoint(unsigned char address, char type, unsigned packet) {
  std::string text("\x07\x05\x00\x00\x00\x00\x01", 7);
  text[2] = static_cast<char>(address);
  text[3] = type;
  text[4] = static_cast<char>(packet & 0xffu);
  text[5] = static_cast<char>(packet >> 8u);
  return text;
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string request("\x00\x06\x01\x00", 4);
  const std::vector<std::uint8_t> reference = sim::reference_descriptors();
  const std::string whole(reference.begin(), reference.end());
  const std::string both = endpoint(0x82, 3, 96) + endpoint(0x03, 3, 56);
  return {
      {"reference", request + whole},
      {"other_numbers", request + device_of(interface(0, 0, 2) + both)},
      {"bulk_alone",
       request + device_of(interface(0, 0, 2) + endpoint(0x81, 2, 64) + endpoint(0x01, 2, 64))},
      {"packet_of_zero",
       request + device_of(interface(0, 0, 2) + endpoint(0x81, 3, 0) + endpoint(0x01, 3, 0))},
      {"many_transactions", request + device_of(interface(0, 0, 2) + endpoint(0x81, 3, 0x17ff) +
                                                endpoint(0x01, 3, 0x1400))},
      {"no_out", request + device_of(interface(0, 0, 1) + endpoint(0x81, 3, 96))},
      {"two_interfaces",
       request + device_of(interface(1, 0, 0) + interface(0, 0, 2) + both + interface(0, 1, 0), 2)},
      {"class_descriptor",
       request + device_of(interface(0, 0, 2) +
                           std::string("\x09\x21\x11\x01\x00\x01\x22\x40\x00", 9) + both)},
      {"no_interface", request + device_of("", 0)},
      {"says_more_endpoints", request + device_of(interface(0, 0, 9) + both)},
      {"second_configuration", request + whole + whole.substr(18)},
      {"too_short", request + whole.substr(0, 30)},
      {"length_zero", request + device_of(std::string("\x00\x04", 2))},
      {"length_beyond", request + device_of(std::string("\x30\x04\x00", 3))}};
}

}  // namespace haptic::fuzz
