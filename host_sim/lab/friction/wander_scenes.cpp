// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/friction/wander_scenes.hpp"

namespace haptic::sim {
namespace {

std::string tube_text(const char* as) {
  return tools::formatted(
      "[moving]\nshape = \"cylinder\"\nradius_m = 0.005\nheight_m = 0.04\nsegments = 24\nas = "
      "\"%s\"\nposition_m = [0, 0, 0]\nmaterial = \"a\"\n[[static]]\nshape = \"tube\"\n"
      "inner_radius_m = 0.0051\nouter_radius_m = 0.012\nheight_m = 0.03\nsegments = 24\nas = "
      "\"%s\"\nmaterial = \"b\"\n",
      as, as);
}

}  // namespace

std::vector<WanderScene> wander_scenes() {
  const auto fit = [](const char* name, FitKind kind, double clearance_m, const Vector& home_m,
                      const Vector& wander_m, double wander_rad) {
    const FitScene scene = fit_scene(kind, clearance_m);
    return WanderScene{name, scene.text, scene.files, home_m, wander_m, wander_rad};
  };
  std::vector<WanderScene> scenes{
      fit("V groove 45", FitKind::kVee45, 0, {0, 0, -8e-4}, {8e-4, 5e-3, 8e-4}, 0.03),
      fit("slot 10 um", FitKind::kSlot, 1e-5, {0, 0, 0}, {8e-4, 4e-3, 4e-3}, 0.03),
      fit("slot 0.1 mm", FitKind::kSlot, 1e-4, {0, 0, 0}, {8e-4, 4e-3, 4e-3}, 0.03),
      fit("square hole 10 um", FitKind::kHole, 1e-5, {0, 0, 0}, {8e-4, 8e-4, 4e-3}, 0.03),
      fit("square hole 1 mm", FitKind::kHole, 1e-3, {0, 0, 0}, {2e-3, 2e-3, 4e-3}, 0.06),
      fit("dovetail 10 um", FitKind::kDovetail, 1e-5, {0, 0, 0}, {5e-4, 4e-3, 8e-4}, 0.02)};
  scenes.push_back({"block on a plate",
                    box_text(true, {0.04, 0.03, 0.02}, Vector::Zero()) +
                        box_text(false, {0.2, 0.2, 0.02}, {0, 0, -0.0201}),
                    {},
                    {0, 0, -5e-4},
                    {4e-3, 4e-3, 1e-3},
                    0.05});
  scenes.push_back({"corner of three",
                    box_text(true, {0.01, 0.02, 0.01}, Vector::Zero()) +
                        box_text(false, {0.02, 0.3, 0.04}, {0.01501, 0, 0}) +
                        box_text(false, {0.06, 0.3, 0.02}, {0, 0, -0.01501}) +
                        box_text(false, {0.06, 0.02, 0.06}, {0, 0.02001, 0}),
                    {},
                    {5e-4, 5e-4, -5e-4},
                    {8e-4, 8e-4, 8e-4},
                    0.03});
  const Vector in_tube_m(6e-4, 6e-4, 3e-3);
  scenes.push_back({"tube, solids", tube_text("solid"), {}, Vector::Zero(), in_tube_m, 0.03});
  scenes.push_back({"tube, surfaces", tube_text("surface"), {}, Vector::Zero(), in_tube_m, 0.03});
  scenes.push_back({"nut M10",
                    "[moving]\nshape = \"nut\"\nmaterial = \"a\"\nsize = \"M10\"\nclearance_m = "
                    "1e-4\n[[static]]\nshape = \"thread\"\nmaterial = \"b\"\nsize = \"M10\"\nturns "
                    "= 8\nclearance_m = 1e-4\n",
                    {},
                    Vector::Zero(),
                    {3e-4, 3e-4, 5e-4},
                    0.05});
  return scenes;
}

}  // namespace haptic::sim
