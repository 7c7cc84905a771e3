// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Figs. 3 and 4 of the paper: force and torque at an edge-face and at two face-face contacts, with
/// geometry whose numbers can be derived by hand.

#include "host_sim/lab/reproduction/contact_picture.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Edge-face, one type-B and one type-C contact (Fig. 3).
[[nodiscard]] ContactScene edge_face_scene();
/// Face-face with two type-C, one type-A and one type-B contact, pi(x_0) outside H (Fig. 4 left).
[[nodiscard]] ContactScene face_face_outside_scene();
/// The same with pi(x_0) inside H (Fig. 4 right).
[[nodiscard]] ContactScene face_face_inside_scene();

[[nodiscard]] PartReport contacts_part();

}  // namespace haptic::sim
