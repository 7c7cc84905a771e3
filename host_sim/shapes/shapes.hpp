// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The bodies that the reproduction of the paper needs, made here without meshes, and scenes of
/// them. Lengths in m; faces as vertex loops, counter-clockwise seen from outside.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/scene/capacity.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

using Vector = Eigen::Vector3d;
using Rotation = Eigen::Quaterniond;

/// A convex polyhedron.
struct Solid {
  std::string name;
  std::vector<Vector> vertices;
  std::vector<std::vector<std::uint32_t>> loops;
};

/// The draws that poses need. Same seed, same numbers, on every platform.
class Seeded {
 public:
  explicit Seeded(std::uint64_t seed) : random_(seed) {}
  [[nodiscard]] double uniform(double low, double high);
  [[nodiscard]] std::uint32_t below(std::uint32_t count);
  [[nodiscard]] Vector direction();   ///< uniform over the unit sphere
  [[nodiscard]] Rotation rotation();  ///< uniform over the rotations

 private:
  tools::SplitMix64 random_;
};

/// Box with corners `low` and `high`; vertex k has `high` in axis i where bit i of k is set.
[[nodiscard]] Solid box_solid(const std::string& name, const Vector& low, const Vector& high);
/// Box centred at the origin.
[[nodiscard]] Solid centred_box(const std::string& name, double half_x, double half_y,
                                double half_z);
/// The manipulated body of the pair that stands for the paper's: 4 faces, 4 vertices, 6 edges.
/// Face 3 is the one across from vertex 0.
[[nodiscard]] Solid paper_tetrahedron();
/// The obstacle of that pair: 6 faces, 8 vertices, 12 edges; vertices numbered so that the edges at
/// vertex 3 are 7, 8 and 9 and face 0 (the top) holds edge 8.
[[nodiscard]] Solid paper_box();
/// Upright regular prism about z.
[[nodiscard]] Solid prism_solid(std::uint32_t sides, double radius, double height);
/// Its lower edge lies along x from -0.05 to 0.03 at y = 0.02, z = -0.05.
[[nodiscard]] Solid wedge_solid();
/// Convex hull of `count` seeded points on an ellipsoid: all of them vertices, faces triangles.
/// Every triple is tried, which is exact enough for points in general position. Cost: O(count^3)
/// triples, most of them refused after a few points.
[[nodiscard]] Solid ellipsoid_hull(std::uint32_t count, const Vector& half_axes,
                                   std::uint64_t seed);

/// Four walls and a floor around a square hole whose rim is at z = 0: five convex pieces that tile
/// a block of 50 x 50 x 50 mm with a hole of depth 40 mm.
[[nodiscard]] std::vector<Solid> five_piece_hole(double half_width_m);
/// Square peg 20 x 20 x 60 mm, origin in its middle.
[[nodiscard]] Solid square_peg();

/// A part and what it is pressed against; its grip point is its origin.
struct PartAmongSolids {
  Solid part;
  std::vector<Solid> around;
  double radius_m = 0;  ///< of the part about its grip point
  Vector start;         ///< of the part
};
/// A cube of 20 mm, its lower face `gap_m` over a wall whose top is at z = 50 mm.
[[nodiscard]] PartAmongSolids cube_over_wall(double gap_m);
/// The square peg upright in its hole of five pieces, `clearance_m` on every side, `depth_m` deep.
[[nodiscard]] PartAmongSolids peg_in_hole(double clearance_m, double depth_m);

/// One body of convex pieces; faces whose planes agree to the last bit share one plane.
[[nodiscard]] tools::Body united_body(std::span<const Solid> pieces);

/// Compiled scene of A over one static body made of `pieces`; grip point at A's origin;
/// D_near exact up to `exact_band_m` of separation, by default at any distance, as figures need it.
/// A tick visits at most `max_pair_visits` pairs. @throws tools::InputError when a solid is not
/// closed.
[[nodiscard]] std::vector<std::byte> scene_of(const Solid& a, std::span<const Solid> pieces,
                                              double k_f_n_per_m, double epsilon_m,
                                              LawId law = LawId::kPaper,
                                              double exact_band_m = kMaxSceneLength_m,
                                              std::uint32_t max_pair_visits = kDefaultPairVisits);

[[nodiscard]] Pose pose_at(const Vector& p, const Rotation& q);
/// The shortest turn that takes `from` along `to`; neither is zero. Opposite to each other, about
/// some axis across.
[[nodiscard]] Rotation turn_between(const Vector& from, const Vector& to);
[[nodiscard]] MotionSample sample_at(double t_s, const Vector& p, const Rotation& q);

// Scenes of the bodies made here, with every parameter of the rendering chosen by the caller.

/// Compiled scene of A over one static body made of `pieces`; grip point at A's origin.
/// A tick visits at most `max_pair_visits` pairs. `guide`: of a plan that is proved for the scene
/// without it.
/// @throws tools::InputError when a solid is not closed or a parameter is refused.
[[nodiscard]] std::vector<std::byte> scene_with(const Solid& a, std::span<const Solid> pieces,
                                                const SceneParameters& parameters,
                                                std::uint32_t max_pair_visits = kDefaultPairVisits,
                                                const tools::GuideTables* guide = nullptr);

}  // namespace haptic::sim
