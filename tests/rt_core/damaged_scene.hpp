// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Compiled scenes that a test damages, with the hash recomputed, and opens.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "tests/support/counter_bounds.hpp"
#include "tests/support/shapes.hpp"

namespace haptic::test {

struct alignas(64) CacheLine {
  std::byte bytes[64];
};

/// A copy of a blob in aligned memory that a test may damage.
class DamagedCopy {
 public:
  explicit DamagedCopy(const std::vector<std::byte>& blob, std::size_t size)
      : lines_((size + 63) / 64 + 1), size_(size) {
    std::memcpy(lines_.data(), blob.data(), std::min(size, blob.size()));
  }
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(lines_.data()), size_}; }
  SceneHeader& header() { return *reinterpret_cast<SceneHeader*>(lines_.data()); }
  void rehash() { header().content_hash = scene_content_hash(bytes()); }
  RtStatus open(SceneView& view) { return SceneView::open(bytes(), view); }
  RtStatus open() {
    SceneView view;
    return open(view);
  }

 private:
  std::vector<CacheLine> lines_;
  std::size_t size_;
};

/// Opens the blob with one section changed and the hash recomputed; `change` gets its first
/// element.
template <typename Element, typename Change>
RtStatus changed_section(const std::vector<std::byte>& blob, SectionId id, const Change& change) {
  DamagedCopy copy(blob, blob.size());
  const auto* sections =
      reinterpret_cast<SectionEntry*>(copy.bytes().data() + copy.header().section_table);
  for (std::uint32_t s = 0; s < copy.header().section_count; ++s) {
    if (sections[s].id != id) continue;
    change(reinterpret_cast<Element*>(copy.bytes().data() + sections[s].offset));
  }
  copy.rehash();
  return copy.open();
}

/// A few ticks over anything that has been accepted, down into the static bodies; the sanitizers
/// see what is read. The results, none where no core was made.
inline std::vector<StepResult> step_a_little(const SceneView& view) {
  std::vector<StepResult> results;
  const std::size_t bytes = HapticCore::state_bytes(view);
  std::vector<CacheLine> memory(bytes / 64 + 1);
  HapticCore* core = nullptr;
  if (HapticCore::create({reinterpret_cast<std::byte*>(memory.data()), bytes}, view, core) !=
      RtStatus::kOk)
    return results;
  for (int t = 0; t < 8; ++t) {
    StepInput input;
    input.pose_wa.p_wa =
        Vec3(0.01_r * static_cast<Real>(t - 4), 0, 0.04_r - 0.01_r * static_cast<Real>(t));
    const StepResult& r = results.emplace_back(core->step(input));
    CHECK(r.status == RtStatus::kOk);
    CHECK(std::isfinite(r.d_near_m));
    CHECK(r.wrench_w.force_w.allFinite());
    CHECK(r.wrench_w.torque_w.allFinite());
    CHECK(over_bound(r.counters, view.header().capacity) == "");
  }
  return results;
}

inline std::vector<std::byte> tetra_box_blob() {
  return tools::write_scene(scene_of(
      tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06}),
      {box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0})}));
}

}  // namespace haptic::test
