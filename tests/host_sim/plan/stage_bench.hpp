// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Assemblies of boxes for the tests of stages, the programs over them, and a hand that goes where
/// the guide leads it.

#include <array>
#include <string>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::sim::test {

/// A box by its lowest and highest corner [mm].
using MillimetreBox = std::array<std::array<double, 3>, 2>;

/// Closed boxes, which may overlap, as one mesh.
void write_boxes(const std::string& path, const std::vector<MillimetreBox>& boxes);

/// A part of a scene file whose mesh in mm is NAME.obj, with further lines.
[[nodiscard]] std::string part_text(const std::string& name, const std::string& role,
                                    const std::string& more = "");

inline const std::string kAssemblyHead =
    "format = 1\nname = \"assembly\"\n[rendering]\nk_f_n_per_m = 800\n";

/// A case in which a block, a pin through it, a cover over them and a bar across it can be put
/// together in this order alone. Each is given where it is in the end.
void write_case(const ScratchFolder& folder);
/// Two links of a chain, which no motion parts, a floor and a brick on it.
void write_chain(const ScratchFolder& folder);

void write_text(const std::string& path, const std::string& text);

/// A light hand without a will of its own at the pose of a part's mesh frame: it goes with what it
/// feels.
class LedHand {
 public:
  LedHand(const SceneView& scene, double length_m);
  /// One tick: `step` takes a pose and gives a result.
  template <typename Step>
  StepResult go(const Step& step) {
    StepInput input;
    input.pose_wa = pose_;
    const StepResult result = step(input);
    follow(result);
    return result;
  }
  [[nodiscard]] const Pose& pose() const { return pose_; }

 private:
  void follow(const StepResult& result);

  Pose pose_;
  Vec3 grip_a_;
  Real per_turn_;  ///< 1 / length^2
};

}  // namespace haptic::sim::test
