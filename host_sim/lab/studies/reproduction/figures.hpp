// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The figures of the paper as the core makes them.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/studies/reproduction/drawing.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/motion_script.hpp"
#include "host_sim/session/tick_csv.hpp"
#include "rt_core/contact/contact_situation.hpp"

namespace haptic::sim {

// Fig. 1 of the paper: an assembly task in C-space, with the contact force and the guidance force
// of a motion planned there, down a harmonic function along a channel of cells (the paper's [14]).

[[nodiscard]] PartReport guidance_part();

// One contact of two bodies as the core renders it, with everything that Figs. 3 and 4 of the
// paper show: application points, contact region, contact frame, force and torque.

/// An application point and its own torque.
struct ApplicationPoint {
  std::vector<std::uint32_t> nodes;      ///< basic contacts with this point
  std::string types;                     ///< their types, "B" or "C"
  Vector app_w = Vector::Zero();         ///< [m]
  Vector torque_frame = Vector::Zero();  ///< eq. (3) in the contact frame [N m]
};

/// Force and torque come from a tick of the core; frame and points are worked out here from the
/// basic contacts that it names.
struct ContactScene {
  Solid a, b;
  Vector x = Vector::Zero();  ///< HIP, orientation of A: identity
  ContactSituation situation = ContactSituation::kNone;
  double d_near_m = 0;
  std::vector<ApplicationPoint> points;  ///< numbered round H; the first two on its x edge
  std::vector<Vector> region;            ///< H
  Vector normal = Vector::Zero();        ///< of the contact plane
  Vector pi = Vector::Zero();            ///< contact reference point
  bool pi_inside = false;                ///< of H (face-face)
  Vector axis_x = Vector::Zero(), axis_y = Vector::Zero();  ///< of the contact frame, W axes
  Vector force_n = Vector::Zero(), torque_nm = Vector::Zero();
};

/// k_F 1000 N/m, epsilon 0.1 mm.
[[nodiscard]] ContactScene touch(const Solid& a, const Solid& b, const Vector& x);

/// Draws the scene; A translucent so that the contact region shows. Arrow of a force of 1 N:
/// `force_m_per_n` long.
struct ArrowScale {
  double axis_m = 0.03, force_m_per_n = 0.025, torque_m_per_nm = 0.6;
};
void draw_contact(SvgPage& page, const Camera& camera, const ContactScene& scene,
                  const ArrowScale& scale);

/// Lines of text with the numbers of the scene.
[[nodiscard]] std::vector<std::string> contact_lines(const ContactScene& scene);

// Figs. 3 and 4: force and torque at an edge-face and at two face-face contacts, with geometry
// whose numbers can be derived by hand.

/// Edge-face, one type-B and one type-C contact (Fig. 3).
[[nodiscard]] ContactScene edge_face_scene();
/// Face-face with two type-C, one type-A and one type-B contact, pi(x_0) outside H (Fig. 4 left).
[[nodiscard]] ContactScene face_face_outside_scene();
/// The same with pi(x_0) inside H (Fig. 4 right).
[[nodiscard]] ContactScene face_face_inside_scene();

[[nodiscard]] PartReport contacts_part();

// Fig. 5 of the paper: force and torque while the contacts of Fig. 4 (left) are attained one after
// the other.

struct ForceRun {
  std::vector<TickRecord> ticks;           ///< 1 kHz
  std::vector<std::uint32_t> contacts;     ///< K per tick
  std::vector<ContactSituation> sequence;  ///< situations in their order, changes only
};

/// No contact, App_1 (a vertex of B under a face of A), (App_1, App_2) with the edge of B in the
/// face, then face-face. A turns about App_1 at a constant depth of 2 mm.
[[nodiscard]] ForceRun make_force_run();

[[nodiscard]] PartReport forces_part();

// Fig. 6 of the paper: a peg and a hole of five convex pieces, in physical space and in C-space.

/// Hole of the pictures: wide enough for the channel in C-space to be seen.
inline constexpr double kPictureHoleHalf_m = 0.014;

/// The insertion at 1 kHz: over the hole, tilted at the rim, along a wall, on the floor.
[[nodiscard]] std::vector<MotionSample> insertion_motion(double half_width_m);

[[nodiscard]] PartReport insertion_part();

// Fig. 2 of the paper: four instants of a motion in physical space and in C-space, with the near
// C-face lit, and the sequence of near nodes that the core reports on the way.

/// A motion of the tetrahedron over four C-faces of the box's C-obstacle, from each to a neighbor
/// of it.
struct FaceWalk {
  std::vector<MotionSample> motion;       ///< 1 kHz
  std::array<std::size_t, 4> instants{};  ///< ticks at which x_0 stands over the middle of a C-face
  std::vector<std::uint32_t> sequence;  ///< the near node whenever it is a single one, changes only
  std::uint32_t relocalised = 0;        ///< ticks after the first that needed a second search
};

/// The nodes of the walk: types B, C, A, C, each a G-neighbor of the one before.
inline constexpr std::array<std::uint32_t, 4> kWalkNodes = {44, 124, 27, 113};

[[nodiscard]] FaceWalk make_face_walk();

[[nodiscard]] PartReport motion_part();

// Fig. 8 of the paper: a type-B basic contact and some of its G-neighbors.

[[nodiscard]] PartReport neighbors_part();

}  // namespace haptic::sim
