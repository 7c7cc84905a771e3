// SPDX-License-Identifier: Apache-2.0
/// Any bytes as what a 3MF archive holds, in this process: a mesh with finite corners and indices
/// in range, or refused with InputError. The archive is packed here, so that its check sums are
/// right.
#include <string>

#include "tests/fuzz/mesh_judge.hpp"
#include "tests/tools/import/import_files.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"
#include "tools/graph_compiler/import/threemf_reader.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace haptic::tools;
  std::string rest(reinterpret_cast<const char*>(data), size);
  std::vector<std::pair<std::string, std::string>> files;
  for (const char* name : {"3D/3dmodel.model", "a.model", "Metadata/Slic3r_PE_model.config",
                           "Metadata/model_settings.config"}) {
    const std::size_t end = rest.find('\0');
    files.emplace_back(name, rest.substr(0, end));
    if (end == std::string::npos) break;
    rest.erase(0, end + 1);
  }
  const std::string archive = test::zip_of(files);
  try {
    const ImportedMesh read = read_3mf(archive, "fuzz");
    const ImportedMesh said = mesh_of_message(message_of(read), "fuzz");
    haptic::fuzz::check_raw_mesh(said.mesh);
    haptic::fuzz::check_parts(said.mesh);
    haptic::fuzz::require(said.mesh.warnings == read.mesh.warnings, "warnings come through");
  } catch (const InputError& error) {
    haptic::fuzz::check_refusal(error.what());
  }
  return 0;
}
