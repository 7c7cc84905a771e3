// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene of drawn meshes compiled in this process by the compiler's defaults, and motions through
/// it: what the studies of single kinds of faults are made of.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/lab/strangers/stranger_judge.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/replay.hpp"

namespace haptic::sim {

class TriedScene {
 public:
  /// `text`: the scene file; `files`: the meshes beside it, by name.
  /// @throws tools::InputError from the compiler.
  TriedScene(const std::string& text, const std::vector<OutputText>& files);

  [[nodiscard]] std::span<const std::byte> blob() const { return blob_; }
  [[nodiscard]] CoreSession& session() { return *session_; }
  [[nodiscard]] HandSprings springs() const;
  /// From a forgotten contact history. `felt` of every tick is the pose in which the part is shown.
  [[nodiscard]] std::vector<PlayedTick> play(const std::vector<MotionSample>& motion);

 private:
  std::vector<std::byte> blob_;
  std::unique_ptr<CoreSession> session_;
};

/// The scene file of a pair as `init` begins it, unit, start and places put in; mesh files beside
/// it.
[[nodiscard]] std::string scene_of_pair(const StrangerPair& pair, double friction);
[[nodiscard]] std::vector<OutputText> files_of_pair(const StrangerPair& pair);

}  // namespace haptic::sim
