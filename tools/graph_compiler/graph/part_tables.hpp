// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The tables of a scene whose parts the hand holds one after another (rt_core/scene/
/// part_scenes.hpp).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "rt_core/scene/part_scenes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::tools {

/// The scene in which a part moves and part `b` alone, which moves too, stands at its mesh frame.
struct PairScene {
  std::uint32_t b = 0;
  std::vector<std::byte> bytes;
};

struct HeldPart {
  PartRole role = PartRole::kFixed;
  PartPlace start;
  std::vector<std::byte> scene;       ///< in which it is held; empty: never
  std::vector<std::uint32_t> others;  ///< the parts that are its static bodies, in their order
  std::vector<PairScene> pairs;       ///< with parts that it may meet and that move too
};

/// `scene`, that of the part which is held at first, with what it says of its parts, by body.
/// @param driven  the parts that their owner moves, ascending by part.
/// @throws InputError when the core refuses what it says.
std::vector<std::byte> with_parts(const std::vector<std::byte>& scene,
                                  const std::vector<HeldPart>& parts,
                                  const std::vector<DrivenRecord>& driven = {});

/// `scene`, and in it the scenes of each of its parts, alone and with others that move, as
/// `changed` makes each of them.
/// @throws InputError when the core refuses what comes of it.
SceneBytes with_changed(const SceneView& scene,
                        const std::function<SceneBytes(const SceneView&)>& changed);

/// A stage of an assembly (StageRecord).
struct Stage {
  std::uint32_t part = 0;  ///< its number
  PartPlace goal;          ///< of its mesh frame
};

/// `scene`, which has parts, with the order of its assembly instead of the one that it had.
std::vector<std::byte> with_stages(const SceneView& scene, const std::vector<Stage>& stages);

/// The stages of a scene; none: it has no such order.
/// @throws InputError where they are not of parts that the hand may take, each once.
std::vector<Stage> stages_of(const SceneView& scene);

/// `scene`, and in it the scenes in which parts are held that have a guide in `guides`, by part,
/// with that guide instead of the one that they had.
std::vector<std::byte> with_guides(const SceneView& scene,
                                   const std::vector<std::optional<GuideTables>>& guides);

}  // namespace haptic::tools
