// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/library/block_on_plate.hpp"

#include <doctest/doctest.h>

#include <cstdlib>

namespace haptic::test {

BoxArrays box_arrays(double half_x, double half_y, double half_z) {
  BoxArrays box;
  for (std::size_t k = 0; k < 8; ++k) {
    box.vertices[3 * k] = (k & 1u) != 0 ? half_x : -half_x;
    box.vertices[3 * k + 1] = (k & 2u) != 0 ? half_y : -half_y;
    box.vertices[3 * k + 2] = (k & 4u) != 0 ? half_z : -half_z;
  }
  box.triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                   2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return box;
}

haptic_part part_of(const BoxArrays& box) {
  haptic_part part = HAPTIC_PART_INIT;
  part.vertices = box.vertices.data();
  part.vertex_count = 8;
  part.triangles = box.triangles.data();
  part.triangle_count = 12;
  part.scale_to_m = 0.001;
  return part;
}

BlockOnPlate::BlockOnPlate()
    : block(box_arrays(10, 10, 10)),
      plate(box_arrays(50, 50, 5)),
      moving(part_of(block)),
      fixed(part_of(plate)),
      input(HAPTIC_COMPILE_INPUT_INIT) {
  moving.pose[2] = 0.035;
  input.name = "block on plate";
  input.moving = &moving;
  input.fixed = &fixed;
  input.fixed_count = 1;
  input.stiffness_n_per_m = 500;
}

CompiledHandle compiled(const haptic_compile_input& input) {
  haptic_compiled* handle = nullptr;
  REQUIRE(haptic_compile(&input, &handle) == HAPTIC_OK);
  return CompiledHandle(handle);
}

std::span<const std::byte> bytes_of(const CompiledHandle& compiled) {
  const void* bytes = nullptr;
  std::size_t count = 0;
  REQUIRE(haptic_compiled_bytes(compiled.get(), &bytes, &count) == HAPTIC_OK);
  return {static_cast<const std::byte*>(bytes), count};
}

std::span<const std::byte> block_scene() {
  static const CompiledHandle scene = compiled(BlockOnPlate().input);
  return bytes_of(scene);
}

void CoreBench::Free::operator()(void* p) const { std::free(p); }

CoreBench::CoreBench(std::span<const std::byte> scene) {
  haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
  REQUIRE(haptic_scene_read(scene.data(), scene.size(), &info) == HAPTIC_OK);
  const std::size_t bytes = (info.memory_bytes + 63) / 64 * 64;
  memory_.reset(std::aligned_alloc(HAPTIC_ALIGNMENT, bytes));
  REQUIRE(haptic_core_create(scene.data(), scene.size(), memory_.get(), bytes, &core_) ==
          HAPTIC_OK);
}

}  // namespace haptic::test
