// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scene of these tests: a block of 20 mm, 20 mm above a plate, 500 N/m.

#include <haptic.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace haptic::test {

/// A box about its centre in millimetres.
struct BoxArrays {
  std::array<double, 24> vertices;
  std::array<std::uint32_t, 36> triangles;
};
[[nodiscard]] BoxArrays box_arrays(double half_x, double half_y, double half_z);
[[nodiscard]] haptic_part part_of(const BoxArrays& box);

/// The request with what it points to.
struct BlockOnPlate {
  BlockOnPlate();
  BlockOnPlate(const BlockOnPlate&) = delete;
  BlockOnPlate& operator=(const BlockOnPlate&) = delete;
  BoxArrays block, plate;
  haptic_part moving, fixed;
  haptic_compile_input input;
};

struct FreeCompiled {
  void operator()(haptic_compiled* compiled) const { (void)haptic_compiled_free(&compiled); }
};
using CompiledHandle = std::unique_ptr<haptic_compiled, FreeCompiled>;

[[nodiscard]] CompiledHandle compiled(const haptic_compile_input& input);
/// As long as the handle lives.
[[nodiscard]] std::span<const std::byte> bytes_of(const CompiledHandle& compiled);

/// The scene, compiled once for the program.
[[nodiscard]] std::span<const std::byte> block_scene();

/// A core for it, and its memory.
class CoreBench {
 public:
  explicit CoreBench(std::span<const std::byte> scene = block_scene());
  [[nodiscard]] haptic_core* core() const { return core_; }

 private:
  struct Free {
    void operator()(void* p) const;
  };
  std::unique_ptr<void, Free> memory_;
  haptic_core* core_ = nullptr;
};

}  // namespace haptic::test
