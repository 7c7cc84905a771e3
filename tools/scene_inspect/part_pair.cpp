// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/part_pair.hpp"

#include <utility>

#include "rt_core/scene/part_scenes.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

std::string known_parts(const PartScenes& parts) {
  std::string text;
  for (std::uint32_t k = 0; k < parts.count(); ++k)
    text += (text.empty() ? "" : ", ") + std::string(parts.name(k));
  return text;
}

std::uint32_t part_named(const PartScenes& parts, const std::string& name) {
  for (std::uint32_t k = 0; k < parts.count(); ++k)
    if (parts.name(k) == name) return k;
  throw UsageError("--pair: no part is called '" + name + "'; the parts are " + known_parts(parts));
}

/// "start" is where the part starts, not the scene.
Pose part_pose(const SceneView& scene, const PartScenes& parts, std::uint32_t part,
               const std::string& option, const std::string& text) {
  const Pose start = pose_of(parts.start_of(part));
  if (text == "start") return start;
  Pose pose = pose_from_text(scene, option, text);
  bool has_turn = false;
  for (std::size_t at = 0, commas = 0; at < text.size(); ++at) {
    commas += text[at] == ',' ? 1u : 0u;
    has_turn = commas > 2;
  }
  if (!has_turn) pose.q_wa = start.q_wa;
  return pose;
}

}  // namespace

PartPair part_pair_of(const SceneView& scene, const std::string& names, const std::string& pose_a,
                      const std::string& pose_b) {
  PartScenes parts;
  if (PartScenes::open(scene, parts) != RtStatus::kOk || parts.count() == 0)
    throw UsageError("--pair: one part moves in this scene; leave it out");
  const std::size_t comma = names.find(',');
  if (comma == std::string::npos)
    throw UsageError("--pair '" + names + "': give two names, such as peg,socket; the parts are " +
                     known_parts(parts));
  std::uint32_t a = part_named(parts, names.substr(0, comma));
  std::uint32_t b = part_named(parts, names.substr(comma + 1));
  Pose at_a = part_pose(scene, parts, a, "--cspace", pose_a);
  Pose at_b = part_pose(scene, parts, b, "--other", pose_b);
  std::span<const std::byte> bytes = parts.pair_scene(a, b);
  if (bytes.empty()) {
    std::swap(a, b);
    std::swap(at_a, at_b);
    bytes = parts.pair_scene(a, b);
  }
  if (bytes.empty()) {
    throw UsageError("--pair '" + names +
                     "': these two never move at once; leave it out for the part of the first hand "
                     "among what stands");
  }
  PartPair pair;
  pair.a = parts.name(a);
  pair.b = parts.name(b);
  pair.bytes = SceneBytes(bytes);
  const RtStatus opened = SceneView::open(std::as_const(pair.bytes).span(), pair.view);
  if (opened != RtStatus::kOk)
    throw InputError("the scene of '" + pair.a + "' and '" + pair.b + "': " + to_text(opened));
  pair.a_seen_from_b.q_wa = (at_b.q_wa.conjugate() * at_a.q_wa).normalized();
  pair.a_seen_from_b.p_wa = at_b.q_wa.conjugate() * (at_a.p_wa - at_b.p_wa);
  return pair;
}

}  // namespace haptic::tools
