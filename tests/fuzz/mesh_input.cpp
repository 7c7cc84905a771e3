// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/mesh_input.hpp"

#include <span>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"

namespace haptic::fuzz {
std::optional<tools::RawMesh> parse_input(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return std::nullopt;
  }
  constexpr tools::MeshFormat kFormats[] = {tools::MeshFormat::kObj, tools::MeshFormat::kStl,
                                            tools::MeshFormat::kOff, tools::MeshFormat::kPly};
  const std::span<const char> bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    tools::RawMesh mesh = tools::parse_mesh(bytes, kFormats[data[0] % 4], "fuzz");
    check_raw_mesh(mesh);
    check_parts(mesh);
    return mesh;
  } catch (const tools::InputError& error) {
    check_refusal(error.what());
    return std::nullopt;
  }
}

}  // namespace haptic::fuzz
