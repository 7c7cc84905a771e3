// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene file to begin with: from meshes alone. The unit of files that state none is guessed from
/// the size, and the part in the hand starts where the exact verdict finds it free of all fixed
/// parts.

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
namespace haptic::tools {

struct DraftRequest {
  std::filesystem::path moving;              ///< each as draft_source has it (draft_mesh.hpp)
  std::vector<std::filesystem::path> fixed;  ///< none: `moving` is an assembly (assembly.hpp)
  std::optional<std::string> hand;           ///< of an assembly: the node in the hand
  std::optional<double> scale_to_m;          ///< of files that state no unit; absent: guessed
  double stiffness_n_per_m = 800.0;
  std::filesystem::path folder;  ///< of the scene file: paths of meshes count from it
  std::string name;
  /// As of CompileOptions.
  std::function<void(const std::string& mesh, const char* step, double fraction)> progress;
};

/// The device that a draft names until a person names another: the reference device of
/// hal/drivers/PROTOCOL.md with a rotor as `host_sim run` has it, in a loop by the timer, which is
/// a period late, without damping of the
/// coupling: the wrench is the spring's alone.
[[nodiscard]] DeviceParameters drafted_device();

struct SceneDraft {
  std::string toml;
  std::vector<std::string> remarks;  ///< for people: what was guessed, and what is odd
  double scale_to_m = 1.0;
  std::array<double, 3> start_m{};
  std::array<int, 3> way{};  ///< unit vector along an axis: from the parts as filed to the start
};

/// @throws InputError as compile_scene does: a mesh that cannot be used is no scene. UsageError:
/// the request makes no scene, see assembly.hpp. Cost: that of a compilation, and some thousand
/// ticks.
[[nodiscard]] SceneDraft draft_scene(const DraftRequest& request);

}  // namespace haptic::tools
