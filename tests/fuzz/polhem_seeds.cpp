// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_polhem: a calibration that succeeds, one that is lost, one pressed again, and
/// reports that are none.
#include <array>

#include "hal/drivers/polhem_codec.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

std::string report(const std::array<std::int16_t, 6>& counts, bool pressed) {
  std::array<std::uint8_t, hal::kPolhemReportBytes> bytes{};
  hal::encode(hal::PolhemReport{counts, pressed}, bytes);
  return std::string("\0\x0e", 2) + std::string(bytes.begin(), bytes.end());
}

std::string force() {
  return std::string("\x01\0\0\x80\x3f\0\0\0\xc0\0\0\x40\x40", 13) + std::string(12, '\0');
}

/// 10, 0, 0 N: some 3 A without a limit.
std::string strong_force() { return std::string("\x01\0\0\x20\x41", 5) + std::string(20, '\0'); }

std::string huge_force() {
  return std::string("\x01\xff\xff\x7f\x7f\0\0\x80\x7f\0\0\xc0\x7f", 13) + std::string(12, '\x7f');
}

}  // namespace

std::vector<Seed> seeds() {
  const std::array<std::int16_t, 6> anywhere{100, -200, 300, 4, 5, 6}, set{0, 0, -5000, 0, 0, 0};
  const std::string calibrated = report(anywhere, false) + force() + report(anywhere, true) +
                                 force() + report(set, false) + force();
  std::string lost = report(anywhere, true) + force();
  for (int i = 0; i < 6; ++i) lost += report(anywhere, true) + force();
  std::string bad_info = report(set, false);
  bad_info[14] = 9;
  return {
      {"calibrated", calibrated + report({500, 300, -4000, 100, -100, 50}, false) + force()},
      {"pressed_again", calibrated + report(set, true) + force() + report(set, false) + force()},
      {"lost", lost + report(set, false) + force()},
      {"wrong_counts", report(anywhere, true) + force() + report(anywhere, false) +
                           report(anywhere, false) + report(anywhere, false) +
                           report(anywhere, false) + force()},
      {"huge",
       calibrated + huge_force() + report({32767, -32768, 32767, 1, 2, 3}, false) + huge_force()},
      {"strong", calibrated + strong_force()},
      {"none", bad_info + std::string("\0\x0d", 2) + std::string(13, 'x') + force()}};
}

}  // namespace haptic::fuzz
