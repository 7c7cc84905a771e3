// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Small STEP files of our own (AP214), written here entity by entity.

#include <array>
#include <string>

namespace haptic::tools::test {

/// Units of length as STEP writes them.
inline constexpr const char* kStepMillimetre = "SI_UNIT(.MILLI.,.METRE.)";
inline constexpr const char* kStepMetre = "SI_UNIT($,.METRE.)";
/// Of 25.4 mm; a conversion-based unit.
inline constexpr const char* kStepInch = "INCH";

/// A box from the origin to `size`, in units of the file. Empty `unit`: the file states none.
std::string step_box(const std::array<double, 3>& size, const std::string& unit = kStepMillimetre);
/// A box of 10 x 20 x 30 mm with one more face, of no width, along an edge.
std::string step_box_with_sliver();
/// A cylinder about z from 0 to `height`: a round face with a seam, and two discs.
std::string step_cylinder(double radius, double height, const std::string& unit = kStepMillimetre);

/// One product with the boxes "body1" and "body2" of 10 x 20 x 30 mm, the second at x = 100 mm.
std::string step_bodies();
/// "machine" of a "plate" of 100 x 100 x 10 mm, a "pair" at z = 10 mm of two "bolt" of 10 x 20 x 30
/// mm, the second at y = 50 mm of the pair, and a "nut" of 8 mm at z = 50 mm. Every place turns by
/// a right angle about z too: x becomes y.
std::string step_assembly();

}  // namespace haptic::tools::test
