// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_link: each device driven to full force, and each way to end that.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/hal/link_bench.hpp"

namespace haptic::fuzz {
namespace {

using test::BenchDevice;
using test::BenchOp;

std::string op(BenchOp what, const std::string& takes = {}) {
  return std::string(1, static_cast<char>(what)) + takes;
}
std::string beats(unsigned count) {
  return op(BenchOp::kBeat, std::string(1, static_cast<char>(count - 1)));
}
std::string byte(unsigned value) { return {static_cast<char>(value)}; }

/// Ready, armed, 128 to 160 periods of full force.
std::string pressing(BenchDevice device, unsigned rest_of_setup = 0) {
  return byte(static_cast<unsigned>(device) | rest_of_setup) + beats(12) + op(BenchOp::kArm) +
         op(BenchOp::kCommand, "\x40\xf0\x20\x10") + beats(32) + beats(32) + beats(32) + beats(32);
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string held = pressing(BenchDevice::kReference, 8);
  const std::string free = pressing(BenchDevice::kReference, 4);
  const std::string again = op(BenchOp::kArm) + beats(32) + beats(32);
  std::vector<Seed> list = {
      {"reference", held + again},
      {"reference_clocked", free + again},
      {"falcon", pressing(BenchDevice::kFalcon, 8) + again},
      {"polhem", pressing(BenchDevice::kPolhem) + again},
      {"spacemouse", pressing(BenchDevice::kSpaceMouse) +
                         op(BenchOp::kReport, std::string("\x01\x00", 2)) + again},
      {"released", held + op(BenchOp::kDeadman, byte(0)) + beats(3) +
                       op(BenchOp::kCommand, "\x7f\x7f\x7f\x7f") + beats(20) +
                       op(BenchOp::kDeadman, byte(1)) + again},
      {"stalled", held + op(BenchOp::kPass, byte(40)) + op(BenchOp::kCommand, "\x81\x10\xe0\xf0") +
                      op(BenchOp::kTurn) + beats(4)},
      {"leap", held + op(BenchOp::kLeap, byte(49)) + beats(4) + again},
      {"servo_lost", held + op(BenchOp::kServoLost, byte(0)) + beats(20) + again},
      {"successor", held + op(BenchOp::kServoLost, byte(1)) + beats(20) + again},
      {"replugged", held + op(BenchOp::kReplug, byte(3)) + beats(20) + again},
      {"closed", held + op(BenchOp::kRest) + beats(20) + op(BenchOp::kReplug, byte(0)) + again},
      {"refused", held + op(BenchOp::kRefuse, byte(4)) + beats(10) + again},
      {"undelivered", held + op(BenchOp::kPass, byte(4)) + op(BenchOp::kOutFailed) + beats(10)},
      {"never_taken", held + op(BenchOp::kReport, std::string(2, '\0')) +
                          op(BenchOp::kPass, byte(100)) + op(BenchOp::kPass, byte(8)) + beats(8)},
      {"garbled", held + op(BenchOp::kRawReport, "\x05hello") + op(BenchOp::kRawReport, byte(0)) +
                      beats(2) + again},
      {"stopped", held + op(BenchOp::kStop) + beats(8) + again},
      {"slept", held + op(BenchOp::kSleep, byte(9)) + beats(8) + again},
      {"pedal", pressing(BenchDevice::kPolhem, 0x88) + op(BenchOp::kPedal, byte(0)) + beats(8) +
                    op(BenchOp::kPedal, byte(1)) + again},
      {"scribbled",
       held + op(BenchOp::kScribble, std::string("\x30\x00\x40", 3) + std::string(64, 'A')) +
           beats(8) + again},
      {"silent", held + op(BenchOp::kPass, byte(100)) + beats(2) + again}};
  for (unsigned trouble = 0; trouble < 8; ++trouble) {
    const std::string report =
        op(BenchOp::kReport, byte(1u << trouble) + byte(0x30)) + op(BenchOp::kOutEnd);
    list.push_back(
        {"trouble_" + std::to_string(trouble), held + report + report + beats(8) + again});
    list.push_back({"falcon_trouble_" + std::to_string(trouble),
                    pressing(BenchDevice::kFalcon) + report + report + report + beats(8) + again});
    list.push_back({"stated_" + std::to_string(trouble),
                    pressing(BenchDevice::kReference, trouble << 4u) + again});
  }
  // Kinds of tick, stamp, arming and wrench.
  for (const unsigned kinds : {0x00u, 0x01u, 0x03u, 0x02u, 0x04u, 0x08u, 0x0cu, 0x10u, 0x20u, 0x30u,
                               0x40u, 0x80u, 0x90u, 0xc0u}) {
    const std::string hostile = op(BenchOp::kHostile, byte(kinds) + std::string(16, '\x03'));
    list.push_back({"hostile_" + std::to_string(kinds),
                    held + hostile + op(BenchOp::kPass, byte(4)) + hostile + beats(8) + again});
  }
  return list;
}

}  // namespace haptic::fuzz
