// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Lays tables out as the sections of a compiled scene (rt_core/scene/scene_format.hpp): header,
/// table of sections, sections at multiples of kSceneAlignment, zeros between them.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

class BlobBuilder {
 public:
  /// Appends a section; sections appear in the blob in the order of the calls.
  template <typename T>
  void add(SectionId id, const std::vector<T>& elements) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(id, sizeof(T), elements.size(), std::as_bytes(std::span(elements)));
  }
  void add_bytes(SectionId id, std::uint32_t element_bytes, std::uint64_t count,
                 std::span<const std::byte> bytes);

  /// The blob with its content hash. May be called again with another capacity.
  [[nodiscard]] std::vector<std::byte> finish(const SceneCapacity& capacity) const;

 private:
  struct Section {
    SectionId id;
    std::uint32_t element_bytes;
    std::uint64_t count;
    std::vector<std::byte> bytes;
  };
  std::vector<Section> sections_;
};

}  // namespace haptic::tools
