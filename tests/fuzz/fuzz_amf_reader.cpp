// SPDX-License-Identifier: Apache-2.0
/// Any bytes as AMF, in this process: a mesh with finite corners and indices in range, or refused
/// with InputError.
#include <span>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/amf_reader.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace haptic::tools;
  try {
    const ImportedMesh read = read_amf({reinterpret_cast<const char*>(data), size}, "fuzz");
    const RawMesh said = mesh_of_message(message_of(read), "fuzz").mesh;
    haptic::fuzz::check_raw_mesh(said);
    haptic::fuzz::check_parts(said);
  } catch (const InputError& error) {
    haptic::fuzz::check_refusal(error.what());
  }
  return 0;
}
