// SPDX-License-Identifier: Apache-2.0
#pragma once
/// C-space at one pose: the part as a point, and in front of it the C-obstacles of the nearest
/// pairs of pieces as polyhedra (paper Sec. II). As a drawing, as an OBJ file, and as a table of
/// all basic contacts of these pairs.

#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/c_space/c_obstacle.hpp"

namespace haptic::tools {

/// Obstacles of a drawing at most, and basic contacts that one of them may have.
inline constexpr std::size_t kMostObstacles = 8;
inline constexpr std::uint32_t kMostContacts = 20'000;

/// One basic contact at the pose.
struct ContactAtPose {
  std::uint32_t node = 0;  ///< the paper's number
  ContactType type = ContactType::kA;
  std::uint32_t of_a = 0, of_b = 0;  ///< feature of the piece of A, of B
  double depth_m = 0;                ///< the point over its plane; meaningful where it applies
  bool applicable = false;
  bool hidden = false;  ///< applicable, and can only separate
  std::int32_t face = -1;
};

struct DrawnObstacle {
  PairIndex pair = 0;
  std::uint32_t piece_a = 0, piece_b = 0;  ///< within their bodies
  std::string body;                        ///< of B
  CObstacle obstacle;
  std::vector<ContactAtPose> contacts;  ///< all, by number
  std::size_t applicable = 0, hidden_faces = 0;
  double distance_m = 0;  ///< of the point from the nearest of the planes; < 0: the pieces overlap
};

struct CSpaceView {
  std::string scene;
  std::string a = "the part";  ///< what is the point
  std::string axes;            ///< the part in whose mesh frame all is; empty: W
  Pose pose_wa;
  Vector point{0, 0, 0};                 ///< the grip point in W, which stands for the part
  std::vector<DrawnObstacle> obstacles;  ///< nearest first
  std::size_t pairs = 0;                 ///< of the scene
  std::size_t too_large = 0;             ///< near, left out: more than kMostContacts
};

/// @throws UsageError  the part never turns, and the pose has another orientation.
/// Cost: as ObstacleSearch.
[[nodiscard]] CSpaceView c_space_view(const SceneView& view, const Pose& pose_wa);

/// SVG 1.1, self-contained; the same bytes for the same scene and pose.
[[nodiscard]] std::string c_space_svg(const CSpaceView& space);
/// Metres, in W; a group for each pair, a material for each type, the point as a point.
/// `material_file` as the OBJ names it.
[[nodiscard]] std::string c_space_obj(const CSpaceView& space, const std::string& material_file);
[[nodiscard]] std::string c_space_mtl();
/// One line for each basic contact of the pairs.
[[nodiscard]] std::string c_space_csv(const CSpaceView& space);
/// The pairs in words, for the terminal.
[[nodiscard]] std::string c_space_text(const CSpaceView& space);

}  // namespace haptic::tools
