// SPDX-License-Identifier: Apache-2.0
/// Any bytes as COLLADA before assimp reads it: the text that it gets is XML, with all that it
/// needs in it already, or refused with InputError.
#include <cmath>
#include <string>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/collada_text.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace haptic::tools;
  using haptic::fuzz::require;
  ColladaText first;
  try {
    first = collada_text({reinterpret_cast<const char*>(data), size}, "fuzz");
  } catch (const InputError& error) {
    haptic::fuzz::check_refusal(error.what());
    return 0;
  }
  require(std::isfinite(first.unit_m) && first.unit_m > 0.0, "the unit is a length");
  if (first.changed.empty()) return 0;
  const ColladaText second = collada_text(first.changed, "fuzz");
  require(second.unit_m == first.unit_m, "the unit stays");
  require(second.changed.empty() && second.warnings.empty(), "one change is enough");
  return 0;
}
