// SPDX-License-Identifier: Apache-2.0
/// Any text as a scene file: read, or refused with InputError that names file, line and column.
/// Meshes are only looked for, never opened; shapes that are not too fine are built.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace {

using haptic::fuzz::require;

/// Beyond these a single run is too slow to find anything.
constexpr std::uint32_t kMostSegments = 64;

void check_part(const haptic::tools::ScenePart& part) {
  double square = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    require(std::isfinite(part.scale_to_m[i]) && part.scale_to_m[i] > 0.0, "scales are positive");
    require(std::isfinite(part.position_m[i]), "positions are finite");
  }
  for (const double x : part.quaternion_wxyz) {
    square += x * x;
  }
  if (part.shape && haptic::tools::segments_of(*part.shape) <= kMostSegments) {
    const haptic::tools::RawMesh mesh = haptic::tools::shape_mesh(*part.shape, "fuzz");
    require(mesh.faces.size() >= 4, "a shape is a solid");
    for (const haptic::tools::Point3& p : mesh.vertices) {
      require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]),
              "corners are finite");
    }
  }
  require(std::abs(square - 1.0) < 1e-12, "quaternions have length 1");
}

void check_scene(const haptic::tools::SceneFile& scene) {
  require(!scene.name.empty() && !scene.statics.empty(), "a scene has a name and a fixed part");
  check_part(scene.moving);
  for (const haptic::tools::ScenePart& part : scene.statics) {
    check_part(part);
  }
  const haptic::SceneParameters& p = scene.parameters;
  for (const double x : {p.k_f_n_per_m, p.epsilon_m, p.rate_hz}) {
    require(std::isfinite(x) && x > 0.0, "parameters are positive");
  }
  for (const auto& x : {scene.coupling.k_t_n_per_m, scene.coupling.k_r_nm_per_rad,
                        scene.coupling.length_m, scene.coupling.max_window_s}) {
    require(!x || (std::isfinite(*x) && *x > 0.0), "gains of the coupling are positive");
  }
  for (const haptic::tools::FrictionPair& pair : scene.friction) {
    require(pair.mu >= 0.0 && pair.mu <= pair.mu_static && pair.mu_static <= 2.0,
            "coefficients lie from 0 to 2, the static one above");
  }
}

/// "fuzz.toml:LINE:COLUMN: ..." with whole numbers above 0.
bool has_place(std::string_view text) {
  constexpr std::string_view kFile = "fuzz.toml:";
  constexpr std::string_view kDigits = "0123456789";
  if (!text.starts_with(kFile)) {
    return false;
  }
  text.remove_prefix(kFile.size());
  for (int i = 0; i < 2; ++i) {
    const std::size_t end = text.find(':');
    if (end == 0 || end == std::string_view::npos || text[0] == '0' ||
        text.substr(0, end).find_first_not_of(kDigits) != std::string_view::npos) {
      return false;
    }
    text.remove_prefix(end + 1);
  }
  return true;
}

/// The whole file is of another kind: no place in it is wrong.
bool is_of_other_kind(std::string_view text) {
  return text.starts_with("fuzz.toml: is a compiled scene; ") ||
         text.starts_with("fuzz.toml: is a motion script; ");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    check_scene(haptic::tools::parse_scene_file(text, "fuzz.toml", HAPTIC_FUZZ_MESH_DIR));
  } catch (const haptic::tools::InputError& error) {
    require(has_place(error.what()) || is_of_other_kind(error.what()),
            "a refusal begins with file:line:column");
  }
  return 0;
}
