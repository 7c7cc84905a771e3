// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene file with parts, written again with the order of their assembly.

#include <toml++/toml.h>
#include <string>
#include <vector>

#include "rt_core/scene/part_scenes.hpp"

namespace haptic::sim {

/// A part that is brought from where it lies to its goal.
struct OrderedPart {
  std::string name;
  PartPlace start, goal;
};

class AssemblyFile {
 public:
  /// @throws tools::InputError where it cannot be read, or is of other parts than `parts`.
  AssemblyFile(const std::string& path, const PartScenes& parts);

  /// The file with these stages, each part where it lies at first; the hand holds that of the first
  /// stage. Meshes are named by whole paths. `has_plans`: stage k is led along k.plan.
  [[nodiscard]] std::string with_order(const std::vector<OrderedPart>& order, bool has_plans) const;

 private:
  std::string path_;
  toml::table table_;
};

}  // namespace haptic::sim
