// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_zip_entry: the 3MF files of the tests, stored, deflated and with wide sizes, and
/// an archive with nothing that is looked for.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/tools/import/import_files.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  using namespace haptic::tools::test;
  return {{"stored", archive_of_3mf(model_of_3mf())},
          {"deflated", archive_of_3mf(model_of_3mf("unit=\"inch\""), Packing::kDeflated)},
          {"wide", archive_of_3mf(model_of_3mf(), Packing::kWide)},
          {"small", zip_of({{"a.model", "<model/>"}}, Packing::kDeflated)},
          {"other", zip_of({{"a.txt", "x"}})}};
}

}  // namespace haptic::fuzz
