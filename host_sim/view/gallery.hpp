// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The gallery: scenes of this project, each with one idea, that are opened by their number. Their
/// files are part of the program, so that it works wherever it lies; graph_compiler, next to it,
/// compiles them.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::sim {

struct GalleryScene {
  std::string_view name;   ///< its folder in host_sim/scenes
  std::string_view title;  ///< a few words
  std::string_view about;  ///< two sentences
};

/// In the order of their numbers, which begin at 1.
[[nodiscard]] std::span<const GalleryScene> gallery();

/// The scene of a number. @throws tools::UsageError  there is none; the text lists all.
[[nodiscard]] const GalleryScene& gallery_scene(unsigned number);

/// The number that `word` is; nothing: it is none, or a file of that name exists.
[[nodiscard]] std::optional<unsigned> gallery_number(const std::string& word);

/// The list of all, a line each.
[[nodiscard]] std::string gallery_list();

/// A file of a scene, as text; empty where it has none of that name.
[[nodiscard]] std::string_view gallery_file(std::string_view name, std::string_view file);

struct CompiledGalleryScene {
  tools::SceneBytes bytes;
  std::vector<MotionSample> motion;
};

/// Runs graph_compiler in a folder of its own. @throws tools::InputError  it is not there, or
/// fails; the text says why.
[[nodiscard]] CompiledGalleryScene compile_gallery_scene(const GalleryScene& scene);

}  // namespace haptic::sim
