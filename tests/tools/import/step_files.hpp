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
/// A cylinder about z from 0 to `height`: a round face with a seam, and two discs.
std::string step_cylinder(double radius, double height, const std::string& unit = kStepMillimetre);

}  // namespace haptic::tools::test
