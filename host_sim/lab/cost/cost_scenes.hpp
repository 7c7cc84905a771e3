// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scenes on which the cost of a tick is compared between two builds: each with its meshes, its
/// scene file and its motion script as text. Neither meshes nor motions depend on the core.

#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/motion_script.hpp"

namespace haptic::sim {

/// A folder of files as `graph_compiler` and `host_sim motion` read them: scene.toml, its two
/// meshes and motion.toml.
struct CostScene {
  std::string name;   ///< for files: letters, digits, underscores
  std::string words;  ///< what it is, for tables
  std::vector<OutputText> files;
};

/// Names of all scenes, in the order of the tables. Those that are not `by_default` are made only
/// when they are named.
struct CostSceneName {
  const char* name;
  bool by_default;
};
[[nodiscard]] const std::vector<CostSceneName>& cost_scene_names();

/// @throws tools::UsageError: no scene of that name; the text lists the names.
[[nodiscard]] CostScene cost_scene(const std::string& name);

/// A prism of `sides` sides, origin in the middle of its lower end, as an OBJ file in millimetres,
/// and the tube around it: a hole through a ring, as deep as the prism is long, its rim at z = 0.
/// Half widths are across the flats. One mesh each: the compiler cuts the ring into one piece per
/// side.
[[nodiscard]] std::string prism_mesh(std::uint32_t sides, double half_width_mm, double length_mm);
[[nodiscard]] std::string ring_mesh(std::uint32_t sides, double half_width_mm, double ring_mm,
                                    double depth_mm);

/// A box of a mesh of boxes [mm].
struct MeshBox {
  double low_mm[3], high_mm[3];
};
/// Each box as a closed shell of its own, hence as a piece of its own.
[[nodiscard]] std::string box_mesh(const std::string& name, const std::vector<MeshBox>& boxes);

}  // namespace haptic::sim
