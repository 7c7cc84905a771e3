// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_mailbox: commands that arrive, commands written over, and patterns over all of it.
#include "hal/device_mailbox.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

/// Armed once, 1 N, 2 N, -1 N.
std::string publish() {
  return std::string(2, '\0') + std::string("\0\0\x80\x3f\0\0\0\x40\0\0\x80\xbf", 12) +
         std::string(12, '\0');
}
std::string scribble(std::size_t where, const std::string& bytes) {
  std::string text(1, '\x01');
  text += static_cast<char>(where & 0xffu);
  text += static_cast<char>(where >> 8u);
  text += static_cast<char>(bytes.size());
  return text + bytes;
}
std::string meanwhile(const std::string& bytes) {
  return std::string(1, '\x03') + static_cast<char>(bytes.size()) + bytes;
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string read(1, '\x02');
  constexpr std::size_t kNewest = offsetof(NewestRecord<DeviceCommand>, newest);
  std::string pressing;
  for (int k = 0; k < 40; ++k) pressing += publish() + read;
  std::string all_of_it;
  for (std::size_t at = 0; at < sizeof(hal::CommandHalf); at += 255)
    all_of_it += scribble(at, std::string(255, 'A'));
  return {{"pressing", pressing},
          {"written_over", pressing + all_of_it + read + read + pressing},
          {"number_of_a_slot", pressing + scribble(kNewest, std::string(8, '\xff')) + read +
                                   scribble(kNewest, std::string("\x05\0\0\0\0\0\0\0", 8)) + read},
          {"slots_swapped", publish() + publish() + scribble(0, std::string(64, '\x02')) + read},
          {"meanwhile", pressing + meanwhile(std::string(200, 'A')) + pressing +
                            meanwhile(std::string("\0\xff\x7f\xf0\x01", 5)) + read}};
}

}  // namespace haptic::fuzz
