// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A compiled scene in memory of the alignment that SceneView::open asks for; std::vector gives
/// less.

#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <span>

#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

/// Owns `size` bytes, the first at a multiple of kSceneAlignment (kStateAlignment is the same, so
/// it also serves as memory of a HapticCore).
class SceneBytes {
 public:
  SceneBytes() = default;
  explicit SceneBytes(std::size_t size) : bytes_(allocate(size)), size_(size) {}
  explicit SceneBytes(std::span<const std::byte> source) : SceneBytes(source.size()) {
    if (!source.empty()) std::memcpy(bytes_.get(), source.data(), source.size());
  }

  [[nodiscard]] std::span<std::byte> span() noexcept { return {bytes_.get(), size_}; }
  [[nodiscard]] std::span<const std::byte> span() const noexcept { return {bytes_.get(), size_}; }

 private:
  struct Free {
    void operator()(std::byte* p) const noexcept {
      ::operator delete (p, std::align_val_t{kSceneAlignment});
    }
  };
  static std::byte* allocate(std::size_t size) {
    auto* p = static_cast<std::byte*>(
        ::operator new (size == 0 ? 1 : size, std::align_val_t{kSceneAlignment}));
    std::memset(p, 0, size);
    return p;
  }

  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_ = 0;
};

}  // namespace haptic::tools
