// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A link without a bus: report flow, output guard and a real driver over a carrier and a clock
/// that are played, with a servo that may say anything. What happens is written as bytes, so that
/// one language serves a fuzzer and a seeded random test; every command that is sent goes through
/// a ForceMonitor.
///
/// First byte: bits 0-1 device (BenchDevice), 2 report-clocked, 3 a deadman, 4-6 which limits the
/// device states, 7 the deadman is beside the device. Then operations, each a byte (BenchOp,
/// remainder by their number) and what it takes.

#include <cstdint>
#include <span>
#include <string>

namespace haptic::test {

enum class BenchDevice : std::uint8_t { kReference = 0, kFalcon, kPolhem, kSpaceMouse };

enum class BenchOp : std::uint8_t {
  kBeat = 0,   ///< one byte: 1 to 32 periods as they should be
  kReport,     ///< two bytes: troubles, motion
  kRawReport,  ///< length, bytes
  kCommand,    ///< four bytes: force along x, y, z, torque about z
  kHostile,    ///< kinds of tick, stamp, arming and wrench, then what these take
  kPass,       ///< one byte: a quarter of a period each
  kLeap,       ///< one byte: 2 to that many ns
  kOutEnd,     ///< the transfer to the device ends well
  kOutFailed,  ///< ... or without having reached it
  kRefuse,     ///< one byte: that many sends are refused
  kTurn,       ///< the link's turn without a report
  kServoLost,  ///< one byte: with a successor, from tick 1 on, in a mailbox of its own
  kReplug,     ///< one byte: for so long; bits: lost, without power, another device
  kRest,       ///< an orderly end begins
  kArm,        ///< the operator arms: later commands carry it
  kDeadman,    ///< one byte: released or pressed, from the next report on
  kStop,       ///< the emergency stop is called
  kSleep,      ///< one byte: the machine sleeps, 4 ms each
  kPedal,      ///< one byte: the switch beside the device is up or down
  kScribble,   ///< two bytes where, length, bytes: over the servo's half of the mailbox
  kCount
};

/// Of a run: what shows that it was no idle one.
struct BenchCounts {
  unsigned sends = 0;            ///< that reached the device
  unsigned pushing = 0;          ///< of them, with force
  unsigned pushing_blocked = 0;  ///< of them, while the output must come down
  unsigned full = 0;             ///< of them, at nine tenths of the device's force
  unsigned states = 0;           ///< published
};

class LinkBench {
 public:
  /// Plays `script` from the beginning. Returns the first rule that was broken and where; empty:
  /// none.
  [[nodiscard]] std::string run(std::span<const std::uint8_t> script);
  [[nodiscard]] const BenchCounts& counts() const { return counts_; }

  /// For probes: a driver that sends what it should not.
  enum class Sabotage : std::uint8_t { kNone = 0, kLouder, kDrivesOn, kNotFinite, kStuck };
  void sabotage(Sabotage how) { sabotage_ = how; }

 private:
  class Play;
  Sabotage sabotage_ = Sabotage::kNone;
  BenchCounts counts_;
};

}  // namespace haptic::test
