// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One cell of the fault matrix, run: the whole stack over a simulated device, a cube that a
/// simulated hand presses on a wall. The state is reached, the fault comes, its cause goes, and the
/// operator takes force again.

#include <cstddef>
#include <span>
#include <vector>

#include "host_sim/device/device_stack.hpp"
#include "host_sim/lab/faults/fault_case.hpp"
#include "host_sim/lab/faults/fault_script.hpp"

namespace haptic::sim {

struct FaultSettings {
  StackCarrier carrier = StackCarrier::kUsb;
  bool report_clocked = false;
  /// Of the stack; what is judged are the reference device's own (reference_stack).
  double slew_factor = 1;
  double ramp_in_factor = 1;
};

/// What part of a scene a script plays on: D's z axis points off the wall that the part is pressed
/// on, and the part touches at kTouchHeight_m.
struct FaultPlace {
  WorkspaceMap map;
  MotionEnvelope envelope;  ///< what "workspace left" and "envelope left" leave
};
/// Of fault_scene().
[[nodiscard]] FaultPlace fault_place();
/// In another scene: from its start pose straight to the nearest fixed part. The part must not
/// touch at the start, and have room to slide sideways. @throws tools::InputError  nothing is
/// touched that way.
[[nodiscard]] FaultPlace fault_place(CoreSession& session);

/// The reference device in a firm hand, for a script at that place.
[[nodiscard]] StackSettings fault_stack(const FaultSettings& settings, const FaultPlace& place);

/// Compiled scene of all cells: the cube and the wall.
[[nodiscard]] std::vector<std::byte> fault_scene();

/// Same arguments, same bits. `scene`: fault_scene(). @throws tools::InputError  the state is not
/// reached, or the fault needs a bus that the carrier is not.
[[nodiscard]] FaultTrace run_fault(std::span<const std::byte> scene, const FaultCase& cell,
                                   const FaultSettings& settings);

}  // namespace haptic::sim
