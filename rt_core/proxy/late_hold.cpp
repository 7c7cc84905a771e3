// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/late_hold.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/proxy/proxy_law.hpp"

namespace haptic {
namespace {

/// Ticks after the last spent one in which a pull that is left open still counts as late, and late
/// ticks in a row without a motion after which the pull is felt all the same.
constexpr std::uint32_t kCatchUpTicks = 32, kLongestHold = 32;
/// What the pull grows by in a tick where it comes back, its torque by this at the part's radius,
/// and either by at least this share of the spring's.
constexpr Real kBack_n = 0.1_r, kBackShare = 0.05_r;

}  // namespace

PoseError LateHold::felt(const LeftPull& pull, const Spring& spring, Real radius_m) noexcept {
  PoseError felt = pull.error;
  holds_ = false;
  if (!late_) {
    if (pull.spent) {  // from what was felt before this tick on
      late_ = true;
      still_ticks_ = 0;
      felt_m_ = std::sqrt(felt_m_);
      felt_rad_ = std::sqrt(felt_rad_);
    } else {
      felt_m_ = felt.translation_m.squaredNorm();
      felt_rad_ = felt.rotation_rad.squaredNorm();
    }
  }
  if (late_) {
    const Real place_m = std::sqrt(felt.translation_m.squaredNorm());
    const Real turn_rad = std::sqrt(felt.rotation_rad.squaredNorm());
    since_spent_ = pull.spent ? 0 : since_spent_ + 1;
    const bool lags = pull.spent || (since_spent_ <= kCatchUpTicks && pull.open_n > kResidual_n);
    still_ticks_ = pull.moved ? 0 : still_ticks_ + 1;
    const bool grows = !lags || still_ticks_ > kLongestHold;
    const Real more_m =
        grows ? std::max(kBack_n / spring.k_t_n_per_m, kBackShare * place_m) : Real{0};
    const Real more_rad =
        grows ? std::max(kBack_n * radius_m / spring.k_r_nm_per_rad, kBackShare * turn_rad)
              : Real{0};
    const Real most_m = std::max(felt_m_ + more_m, pull.held_m);
    const Real most_rad = felt_rad_ + more_rad;
    const bool holds_place = place_m > most_m, holds_turn = turn_rad > most_rad;
    if (holds_place) felt.translation_m *= most_m / place_m;
    if (holds_turn) felt.rotation_rad *= most_rad / turn_rad;
    holds_ = holds_place || holds_turn;
    late_ = lags || holds_;
    felt_m_ = std::min(place_m, most_m);
    felt_rad_ = std::min(turn_rad, most_rad);
    if (!late_) {
      felt_m_ *= felt_m_;
      felt_rad_ *= felt_rad_;
    }
  }
  return felt;
}

}  // namespace haptic
