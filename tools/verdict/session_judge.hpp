// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One judgement of a session, tick by tick: whether the part followed the hand, if not why and
/// which key of the scene helps, and whether the session failed. Every program, the C library and
/// the page end with it. The core alone is needed; no heap, lock or system call.

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/step.hpp"

namespace haptic::tools {

/// The quantities of one tick that are judged.
struct JudgedTick {
  bool refused = false;     ///< the pose was: nothing below is of this tick
  bool in_contact = false;  ///< felt_part_touches
  double pull_n = 0;        ///< of the spring: StepResult::spring_w
  std::uint32_t flags = 0;  ///< StepFlag
  double energy_j = 0;      ///< StepResult::energy_j, where the scene has an observer
};

/// "In contact", wherever a program says so: the part as it is felt touches something. Law kProxy:
/// planes hold it. Other laws feel the part at the goal: a contact carries force, or it overlaps.
[[nodiscard]] bool felt_part_touches(const StepResult& result, LawId law) noexcept;
[[nodiscard]] JudgedTick judged_tick(const StepResult& result, LawId law) noexcept;

/// Why the part did not follow the hand in a tick, gravest first; a tick may have several.
enum class WhyNot : std::uint8_t {
  kRefused = 0,  ///< the pose was not usable
  kInside,       ///< the part is inside an obstacle and is led out
  kOutside,      ///< the scene's envelope was left
  kStuck,        ///< free to move, and did not
  kListFull,     ///< more pairs near than near_pairs
  kBehind,       ///< the budget of work was spent
  kSaturated,    ///< the pull has met its limit
  kRamped,       ///< the force is ramped out or in
  kCount
};
inline constexpr std::size_t kWhyNots = static_cast<std::size_t>(WhyNot::kCount);
/// "behind", as keys of JSON have it: "behind_ticks".
[[nodiscard]] const char* to_text(WhyNot why) noexcept;
/// WhyNot of a tick, a bit each.
[[nodiscard]] std::uint32_t why_not(const JudgedTick& tick) noexcept;

/// Result of a session, gravest first. Values are part of the C interface.
enum class Outcome : std::uint8_t {
  kFollowed = 0,        ///< the part followed the hand, but for what is counted
  kNoTicks = 1,         ///< there was none
  kEnergy = 2,          ///< FAILED: the rendering gave energy to the device
  kForceInTheOpen = 3,  ///< FAILED: force while the felt part touches nothing
  kStuck = 4,           ///< FAILED: the part is free to move, is pulled and stays
  kInside = 5,          ///< FAILED: the part is inside an obstacle and does not come out
  kBehind = 6,          ///< FAILED: too many ticks end for want of budget
  kNothingTouched = 7,  ///< FAILED where a touch was asked for
  kCount
};
[[nodiscard]] const char* to_text(Outcome outcome) noexcept;

/// A force above this while nothing touches, or a part that is stuck, for more ticks in a row than
/// this, fails a session.
inline constexpr double kOpenForce_n = 0.05;
inline constexpr std::uint32_t kMostOpenTicks = 100, kMostStuckTicks = 100;
/// A session that ends inside an obstacle fails if it has been there for more ticks than this.
inline constexpr std::uint32_t kMostInsideTicks = 100;
/// Fails: a larger share of the ticks behind, if they are more than so many.
inline constexpr double kMostBehindShare = 0.01;
inline constexpr std::uint32_t kFewBehindTicks = 10;
/// More energy given out than this [J].
inline constexpr double kMostGivenOut_j = 1.0e-3;

/// A run of ticks.
struct TickRun {
  std::uint64_t begin = 0, ticks = 0;
};

/// The judgement so far. Trivially copyable.
struct SessionVerdict {
  Outcome outcome = Outcome::kNoTicks;  ///< the gravest
  std::uint32_t failures = 0;           ///< Outcome, a bit each
  std::uint64_t ticks = 0, followed_ticks = 0, contact_ticks = 0;
  std::array<std::uint64_t, kWhyNots> why_not{};  ///< ticks, by WhyNot
  bool started_inside = false;
  TickRun longest_open, longest_stuck;  ///< force in the open, stuck
  std::uint64_t inside_to_end = 0;      ///< ticks inside, up to the last one
  double open_force_n = 0;              ///< largest in the open, in runs that fail
  /// Most work of the rendering on the device; not a number where no device was accounted for.
  double given_out_j = std::numeric_limits<double>::quiet_NaN();
  /// Numbers of the scene from which the advice follows: pairs of pieces, and its budgets.
  std::uint64_t pair_count = 0;
  std::uint32_t near_pairs = 0, work_units = 0;
  bool has_device = false;

  [[nodiscard]] bool failed() const noexcept { return failures != 0; }
  [[nodiscard]] bool has(Outcome failure) const noexcept {
    return (failures >> static_cast<unsigned>(failure) & 1u) != 0;
  }
};

/// One session after another, as of one whose servo process was replaced by its spare.
void add(const SessionVerdict& later, SessionVerdict& to) noexcept;

/// Memory: this object alone. One thread.
class SessionJudge {
 public:
  SessionJudge() noexcept = default;
  explicit SessionJudge(const SceneView& scene) noexcept;

  /// Takes one tick. Constant cost.
  void take(const JudgedTick& tick) noexcept;
  void take(const StepResult& result) noexcept { take(judged_tick(result, law_)); }
  /// Work of the rendering on the device so far [J], where somebody keeps account of a device.
  /// Without one the core's passivity observer says what was given out, where the scene has it.
  void note_work(double delivered_j) noexcept;
  /// The motion was made to touch: a session without contact fails.
  void expect_contact() noexcept { expects_contact_ = true; }
  /// Forgets all ticks.
  void reset() noexcept;

  [[nodiscard]] SessionVerdict verdict() const noexcept;

 private:
  SessionVerdict sum_;
  LawId law_ = LawId::kProxy;
  double allowed_work_j_ = kMostGivenOut_j;  ///< that of a guide included
  TickRun open_, stuck_;                     ///< the present ones
  double open_force_n_ = 0;                  ///< largest of the present one
  bool observes_ = false;                    ///< the scene has a passivity observer
  bool expects_contact_ = false;
};

/// One line for people, without its end.
struct VerdictLine {
  std::array<char, 768> text{};
  [[nodiscard]] std::string_view view() const noexcept { return text.data(); }
};

/// "followed the hand in 99.7 % of 3001 ticks; 9 ticks behind: [budget] work_units = 2000 helps",
/// or "FAILED: ..": what failed, with the key that helps, then the same. `other`: a failure that
/// the caller has found besides; empty: none.
[[nodiscard]] VerdictLine verdict_line(const SessionVerdict& verdict,
                                       std::string_view other = {}) noexcept;

}  // namespace haptic::tools
