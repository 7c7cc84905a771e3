// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a played motion shows, judged by its forces and by the triangles of the files alone: no
/// code of the core has a say in where the parts are apart. A flag alone is no fault.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/strangers/stranger_hand.hpp"
#include "host_sim/oracle/mesh_pair.hpp"

namespace haptic::sim {

/// A force is false above this, for more ticks in a row than these.
inline constexpr double kFalseForce_n = 0.05;
inline constexpr std::size_t kPassingTicks = 2;
/// Farther than this from everything the felt part touches nothing.
inline constexpr double kTouching_m = 1e-6;
/// The same with friction, whose cone lifts a part that slides by a share of its step, and in the
/// closed loop, whose device is felt a tick later.
inline constexpr double kTouchingLoosely_m = 8e-6;

/// A tick as the program has written it.
struct PlayedTick {
  Vector force_n = Vector::Zero(), torque_nm = Vector::Zero();
  bool touches = false;  ///< what the program says
  std::uint32_t flags = 0;
  std::optional<MotionSample> felt;  ///< where the file has it
};
/// The CSV file of `replay` or `run`. @throws tools::InputError  it cannot be read.
[[nodiscard]] std::vector<PlayedTick> read_played_ticks(const std::string& path);

/// The springs between the hand and the part.
struct HandSprings {
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0;
  Vector grip_m = Vector::Zero();  ///< in the frame of the part's file
  /// The pose at which they make this wrench on a hand at `hand`.
  [[nodiscard]] MotionSample felt(const MotionSample& hand, const PlayedTick& tick) const;
};

/// The triangles of a pair's files, the fixed ones where the scene puts them.
class PairTriangles {
 public:
  explicit PairTriangles(const StrangerPair& pair);
  /// Whether the part is farther than `by_m` from everything.
  [[nodiscard]] bool apart(const MotionSample& part, double by_m) const;

 private:
  std::unique_ptr<MeshPair> meshes_;
};

/// Of one played motion.
struct PlayedAccount {
  std::size_t ticks = 0, contact = 0;
  double largest_n = 0, end_n = 0;
  std::size_t stuck = 0, behind = 0, recovery = 0, ramping = 0;  ///< ticks with the flag
  std::size_t first_recovery = 0;
  std::size_t stuck_pulled = 0;  ///< stuck with a false force
  std::size_t loose = 0;         ///< with a force, and the program says that nothing is touched
  std::size_t judged = 0, apart = 0;  ///< poses judged by triangles, and those that touch nothing
  double apart_n = 0;                 ///< largest force at those
  std::size_t apart_at = 0;           ///< that tick
  std::size_t stops = 0, late = 0, late_at = 0;
  double late_n = 0;  ///< largest change of the force while the hand stands still
};
/// `hand`: null where the device has its own way; then stops and `springs` are not used.
[[nodiscard]] PlayedAccount account_of(const std::vector<PlayedTick>& ticks, const HandMotion* hand,
                                       const HandSprings& springs, const PairTriangles& triangles,
                                       double touching_m);

/// How much more force one run has than another of the same motion.
struct ForceExcess {
  double largest_n = 0, largest_difference_n = 0;
  std::size_t ticks = 0, longest_run = 0;  ///< with a false force more
  std::size_t at = 0;                      ///< the tick of the largest
};
[[nodiscard]] ForceExcess excess_of(const std::vector<PlayedTick>& ticks,
                                    const std::vector<PlayedTick>& reference);

enum class StrangerFault : std::uint8_t {
  kRefused,   ///< the compiler does not take the pair
  kStuck,     ///< force in the open, and stuck in more than a tenth of the ticks
  kLeft,      ///< force at the end, back at the free start
  kRecovery,  ///< recovery in a motion that starts free
  kFree,      ///< force in the open for more than two ticks
  kWall,      ///< more than two dozen ticks of force that the parts as meant do not give
  kMore,      ///< more force than with large budgets, for more than two ticks in a row
  kLate,      ///< the hand stands still, and the force changes
  kAir,       ///< force where nothing is within the way to the start
  kExit,      ///< a program fails
  kNoTouch,   ///< `motion --for` touches nothing
  kCount
};
/// "STUCK".
[[nodiscard]] const char* to_text(StrangerFault fault);
[[nodiscard]] std::optional<StrangerFault> stranger_fault_named(const std::string& name);
[[nodiscard]] std::vector<std::string> stranger_fault_names();

struct FoundFault {
  StrangerFault kind;
  std::string words;
};
/// Of one played motion by its account; `begins_free`: recovery is a fault, `ends_free`: a force at
/// the end.
void find_faults(const std::string& name, const PlayedAccount& account, const HandMotion* hand,
                 std::vector<FoundFault>& found);
/// `as_meant`: the reference has the parts where they are meant.
void find_excess(const std::string& name, const ForceExcess& excess, const HandMotion& hand,
                 bool as_meant, std::vector<FoundFault>& found);

/// Falsifies ticks that are right, as a probe of the judge: the fault must be found.
/// `hand`: of the motion that was played.
void falsify(std::vector<PlayedTick>& ticks, const HandMotion& hand, StrangerFault fault);

}  // namespace haptic::sim
