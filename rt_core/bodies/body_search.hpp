// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Inside of the law of several bodies: the search of one pass for a step. Not for inclusion
/// outside bodies/.

#include <limits>

#include "rt_core/bodies/body_law.hpp"
#include "rt_core/proxy/pass_numbers.hpp"

namespace haptic {

/// Rounds of program, step and check, on the stack: as for one part, with shares of the step for
/// each island of bodies.
class BodyLaw::StepSearch {
 public:
  StepSearch(BodyLaw& law, ProxyTick& tick) noexcept;
  /// Imposes planes until the step that the program asks for is certified.
  [[nodiscard]] bool run(Step& step) noexcept;
  /// The budget has ended, or a list of near pieces was outrun.
  [[nodiscard]] bool is_spent() const noexcept { return spent_; }
  /// Pull that the planes at p leave.
  [[nodiscard]] Real residual_n() const noexcept { return residual_n_; }

 private:
  enum class Round : std::uint8_t { kFound, kNone, kNext };

  void begin_retry() noexcept;
  void solve() noexcept;
  void set_pulls() noexcept;
  [[nodiscard]] bool solve_shorter() noexcept;
  void solve_rows(bool goes_on) noexcept;
  void push_rows() noexcept;
  void take_solution() noexcept;
  void settle_cones() noexcept;
  void cut_cones() noexcept;
  [[nodiscard]] bool shifts_fit(bool may_lift) const noexcept;
  [[nodiscard]] bool choose_step(Step& step) noexcept;
  [[nodiscard]] bool bound_by_pairs() noexcept;
  void bound_by_tick() noexcept;
  void bound_together() noexcept;
  [[nodiscard]] Round take_certified(bool still) noexcept;
  [[nodiscard]] Round impose_lacking(const Check& result) noexcept;
  [[nodiscard]] bool shares_are_whole() const noexcept;
  [[nodiscard]] Real motion_m() const noexcept;

  BodyLaw& law_;
  ProxyTick& tick_;
  const ProxyScale& scale_;
  const std::uint32_t rounds_;
  const Real tolerance_m_;  ///< of the program
  Real tried_rad_ = 0;      ///< relative turn of the last step, of pairs with something near
  std::uint32_t round_ = 0, retry_at_;
  Real most_m_ = std::numeric_limits<Real>::max(), most_rad_;   ///< of a step with something near
  std::array<std::uint16_t, kMostOpenPairs + 1> pair_begin_{};  ///< of each pair's rows
  std::uint32_t cone_programs_ = 0, shift_programs_ = 0;
  std::array<Real, kMostMovingBodies> s_{}, s_turn_{};  ///< shares of way and turn of each body
  bool far_rows_ = false;      ///< rows linearised away from p are in the program
  bool cut_ = false;           ///< a body's step is shorter than asked for
  bool from_start_ = false;    ///< the next retry chooses its planes from the start
  bool chosen_short_ = false;  ///< planes were chosen from the start, for a short step
  bool shared_ = false;        ///< a share is below 1: the program has been solved
  bool spent_ = false;
  bool goes_on_ = false;      ///< the next program has the rows of the last one and more
  Real free_motion_m_ = 0;    ///< that the program without rows at a step asks for
  std::uint32_t nearer_ = 0;  ///< tries of a part of the step
  Real residual_n_ = 0;
};

}  // namespace haptic
