// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The drawings of the families, each from random dimensions and a clearance.

#include "host_sim/lab/strangers/stranger_pair.hpp"

namespace haptic::sim {

struct Family {
  std::string_view name;
  StrangerPair (*draw)(Seeded& random, double clearance_mm);
  double least_mm = 0.005, most_mm = 1;  ///< clearances at which the drawing makes sense
};

// Round and prismatic parts in bores.
StrangerPair draw_keyed_shaft(Seeded& random, double clearance_mm);
StrangerPair draw_splined_shaft(Seeded& random, double clearance_mm);
StrangerPair draw_stepped_shaft(Seeded& random, double clearance_mm);
StrangerPair draw_hex_socket(Seeded& random, double clearance_mm);
StrangerPair draw_hex_key(Seeded& random, double clearance_mm);
StrangerPair draw_ring_on_post(Seeded& random, double clearance_mm);
StrangerPair draw_filleted_peg(Seeded& random, double clearance_mm);
StrangerPair draw_taper_plug(Seeded& random, double clearance_mm);
StrangerPair draw_hinge_pin(Seeded& random, double clearance_mm);
StrangerPair draw_gear_pair(Seeded& random, double clearance_mm);
StrangerPair draw_bayonet(Seeded& random, double clearance_mm);
StrangerPair draw_thread_start(Seeded& random, double clearance_mm);

// Plates, pins, rails and nests.
StrangerPair draw_dowel_plate(Seeded& random, double clearance_mm);
StrangerPair draw_pin_plate(Seeded& random, double clearance_mm);
StrangerPair draw_connector(Seeded& random, double clearance_mm);
StrangerPair draw_card_slot(Seeded& random, double clearance_mm);
StrangerPair draw_t_slot(Seeded& random, double clearance_mm);
StrangerPair draw_dovetail(Seeded& random, double clearance_mm);
StrangerPair draw_rail_clip(Seeded& random, double clearance_mm);
StrangerPair draw_drawer(Seeded& random, double clearance_mm);
StrangerPair draw_battery_tray(Seeded& random, double clearance_mm);
StrangerPair draw_fixture(Seeded& random, double clearance_mm);
StrangerPair draw_casting(Seeded& random, double clearance_mm);
StrangerPair draw_clevis(Seeded& random, double clearance_mm);
StrangerPair draw_scan(Seeded& random, double clearance_mm);
StrangerPair draw_brick(Seeded& random, double clearance_mm);

// Parts by how many pieces they have, for the study of near pairs.
/// A round shaft in its bore, both of so many facets.
[[nodiscard]] StrangerPair shaft_of_facets(std::uint32_t facets, double clearance_mm);
[[nodiscard]] StrangerPair shaft_of_splines(std::uint32_t splines, double clearance_mm);
/// Two rows of square pins.
[[nodiscard]] StrangerPair connector_of_pins(std::uint32_t pins, double clearance_mm);

/// A block around a bore that is open above, its rim chamfered; with a floor below where
/// `floor_mm` is not 0.
[[nodiscard]] DrawnMesh bored_block(const Outline& bore, const Outline& outside, double depth_mm,
                                    double chamfer_mm, double floor_mm);
/// A peg upwards from 0, its lower end chamfered.
[[nodiscard]] DrawnMesh chamfered_peg(const Outline& outline, double length_mm, double chamfer_mm);
/// A pair of which every drawing, made upright, lies down: z becomes x, the way in -x.
[[nodiscard]] StrangerPair laid_down(StrangerPair pair);

}  // namespace haptic::sim
