// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts of a picture that show contact over time: the depth at the asked pose, the situation of
/// the felt part, a sudden release. Coordinates in pixels, y downwards.

#include <span>
#include <string>
#include <vector>

#include "host_sim/report/svg_canvas.hpp"
#include "rt_core/contact/contact_situation.hpp"

namespace haptic::sim {

/// d_near [mm] at each time; far free motion would flatten what happens in contact, so the axis
/// ends a few penetrations above zero and the curve is left out beyond it. Not searched: NaN.
[[nodiscard]] std::string depth_panel(Panel panel, std::span<const double> times,
                                      std::span<const double> d_near_mm);

/// A band of colours, one situation per time, with its key at `key_y`; a pixel column shows its
/// most frequent contact, so that short contacts stay visible.
[[nodiscard]] std::string situation_band(const Panel& panel, std::span<const double> times,
                                         std::span<const ContactSituation> situations,
                                         double key_y);

/// A force that vanishes from one tick to the next, as when a part slips off a rim.
struct Release {
  double t_s, before_n, after_n;
};

/// The largest sudden releases, at most `most`, in the order of time: |force| falls by a quarter of
/// its largest value and by 0.2 N at least between two ticks.
[[nodiscard]] std::vector<Release> sudden_releases(std::span<const double> times,
                                                   std::span<const double> force_n,
                                                   std::size_t most);

/// A dashed line across a panel at each release; `named`: with what happened beside it.
[[nodiscard]] std::string release_marks(const Panel& panel, std::span<const Release> releases,
                                        bool named);

}  // namespace haptic::sim
