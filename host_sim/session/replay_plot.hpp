// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Picture of a replay over time: force, torque, what a guide does, distance of the part from the
/// device's pose, d_near and contact situation; marked are sudden releases of what was held, and
/// the ticks in which the part does not follow the hand.

#include <cstdint>
#include <span>
#include <string>

#include "host_sim/report/picture.hpp"
#include "host_sim/session/tick_csv.hpp"

namespace haptic::sim {

/// Distance of the part, as it is felt, from the goal that the device asks for: what the spring of
/// law proxy pulls by. One value [m] per time; worth a panel when one of them is not zero.
[[nodiscard]] std::string apart_panel(Panel panel, std::span<const double> times,
                                      std::span<const double> apart_m);
[[nodiscard]] bool shows_apart(std::span<const double> apart_m);

/// Panels of a scene with a guide: the norm of its force in `pull`, and in `station` the last
/// station of the plan that was passed, in ticks in which it leads. One value per time.
[[nodiscard]] std::string guide_panels(Panel pull, Panel station, std::span<const double> times,
                                       std::span<const TickGuide> guides);
/// True if a guide leads or looks for its way in any tick.
[[nodiscard]] bool shows_guide(std::span<const TickGuide> guides);

/// d_near at the goal pose. Far free motion would flatten what happens in contact: the axis ends a
/// few penetrations above zero, and what lies above is not drawn. Ticks without a search are not
/// finite; with no others there is nothing to draw.
[[nodiscard]] std::string depth_panel(Panel panel, std::span<const double> times,
                                      std::span<const double> d_near_m);
/// d_near of a tick where it was searched, else no number: a bound is not drawn as if it were one.
/// `exact_band_m`: of the scene; where kFlagFarBand is set, what is beyond it is a bound.
[[nodiscard]] double searched_depth_m(const TickRecord& tick, double exact_band_m);
[[nodiscard]] bool shows_depth(std::span<const double> d_near_m);

/// Contact situation over time as a band with times below it; what its colours mean at `key_y`.
[[nodiscard]] std::string situation_band(const Panel& panel, std::span<const double> times,
                                         std::span<const ContactSituation> situations,
                                         double key_y);

/// Why the part does not follow the hand, over time, as a band without times: the core's flags of
/// each tick, the gravest of a pixel column. The key of its colours at `key_y`.
[[nodiscard]] std::string mark_band(const Panel& panel, std::span<const double> times,
                                    std::span<const std::uint32_t> flags, double key_y);
/// True if there is a mark.
[[nodiscard]] bool shows_marks(std::span<const std::uint32_t> flags);

/// A complete SVG document. Curves are reduced to their least and largest value per pixel column,
/// so no peak is lost and the size stays below 1 MB for any number of ticks. `title` may hold any
/// text; `exact_band_m` as of searched_depth_m. Deterministic.
[[nodiscard]] std::string replay_plot(std::span<const TickRecord> ticks, const std::string& title,
                                      double exact_band_m);

}  // namespace haptic::sim
