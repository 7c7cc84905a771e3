// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where a scene that does not open is damaged: byte, table and element, in words.

#include <cstddef>
#include <span>
#include <string>

#include "rt_core/base/status.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// "table 'pieces', element 3 (byte 1 472): vertices, edges and faces ..."; with the stated and the
/// found value where the header is at fault. `status` and `fault` as SceneView::open gave them for
/// `bytes`. Any byte sequence is safe.
std::string damage_text(std::span<const std::byte> bytes, RtStatus status, const SceneFault& fault);

}  // namespace haptic::tools
