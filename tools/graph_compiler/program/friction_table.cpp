// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/friction_table.hpp"

#include "rt_core/scene/scene_format.hpp"
#include "tools/common/toml_table.hpp"

namespace haptic::tools {

std::vector<FrictionPair> read_friction(const TomlTable& top) {
  std::vector<FrictionPair> pairs;
  for (const TomlTable& t : top.tables("friction", {"materials", "mu"})) {
    FrictionPair pair;
    const auto materials = t.word_pair("materials");
    if (!materials) t.fail_missing("materials", "name two, as in [\"steel\", \"pom\"]");
    pair.materials = *materials;
    const auto mu = t.number("mu", {0.0, kMaxFriction});
    if (!mu) t.fail_missing("mu", "give the Coulomb coefficient, from 0 to 2");
    pair.mu = *mu;
    if (friction_of(pairs, pair.materials[0], pair.materials[1])) {
      t.fail("materials", "'" + pair.materials[0] + "' and '" + pair.materials[1] +
                              "' have a coefficient already; keep one of the two tables");
    }
    pairs.push_back(pair);
  }
  return pairs;
}

std::optional<double> friction_of(const std::vector<FrictionPair>& pairs, const std::string& a,
                                  const std::string& b) {
  for (const FrictionPair& pair : pairs) {
    if (pair.is_of(a, b)) return pair.mu;
  }
  return std::nullopt;
}

}  // namespace haptic::tools
