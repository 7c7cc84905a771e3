// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A blind square hole and an L-shaped pocket, each in several convex divisions that share their
/// planes to the last bit, and the paths of a part in them. The force must not depend on
/// the division.

#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {

/// One division of both bodies of a scene.
struct Division {
  std::string name;
  tools::Body moving, fixed;
};

/// Contact of the device on a path, and so how closely two divisions must agree.
enum class DivisionContact {
  kFace,    ///< pressed flat on one plane or several in every tick of the path
  kMixed,   ///< edges and vertices too, contacts come and go
  kJammed,  ///< pulled hard against edges that leave a freedom: energies near the least are many
  kRelease  ///< a hold is really lost: when, depends on the way of the iteration
};

/// One scene in several divisions, the first of which is the one to compare with, and a path.
struct DivisionCase {
  std::string name;   ///< for files: letters, digits, underscores
  std::string title;  ///< what happens on it
  DivisionContact contact = DivisionContact::kFace;
  std::vector<Division> divisions;
  CoupledScene scene;  ///< its coupling; bodies are those of a division
  TimedPath path;
  /// Why the mean force need not be the paper's; empty: it must. In the first division every face
  /// of the part is one face of one piece, so where faces touch the paper's sum over pairs counts
  /// none twice.
  std::string other_strength;

  [[nodiscard]] CoupledScene divided(const Division& division) const;
};

/// The square hole of the peg cases, 40 mm deep: walls as strips with one floor; walls as a
/// pinwheel with the floor in two; strips cut through walls and floor by three planes, two of them
/// aslant.
[[nodiscard]] std::vector<tools::Body> square_hole_divisions(double half_width_m);

/// L-shaped pocket, 16 mm deep, its arms 8 mm wide and 24 mm long, as slabs across x, as slabs
/// across y with the floor in three, and the former cut by two planes aslant. The inner corner of
/// the L stands at (-4, -4) mm, the outer one at (-12, -12) mm.
[[nodiscard]] std::vector<tools::Body> ell_pocket_divisions();

/// The L that fits into the pocket with `clearance_m` all round, 10 mm high, its origin in the
/// knee: cut along x, and along y.
[[nodiscard]] std::vector<tools::Body> ell_insert_divisions(double clearance_m);

/// Every path with its divisions; the coupling is that of the peg cases.
[[nodiscard]] std::vector<DivisionCase> hole_division_cases();

}  // namespace haptic::sim
