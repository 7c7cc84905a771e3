// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Materials of the parts and `[[friction]]`, the coefficients of their pairs.

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace haptic::tools {

class TomlTable;

/// One `[[friction]]` table: Coulomb coefficient between two materials, in either order.
struct FrictionPair {
  std::array<std::string, 2> materials;
  double mu = 0.0;

  [[nodiscard]] bool is_of(const std::string& a, const std::string& b) const {
    return (materials[0] == a && materials[1] == b) || (materials[0] == b && materials[1] == a);
  }
};

/// @throws InputError with the place: two names and mu, no pair twice.
std::vector<FrictionPair> read_friction(const TomlTable& top);

/// Coefficient of two materials; absent when the table does not know the pair or a name is empty.
std::optional<double> friction_of(const std::vector<FrictionPair>& pairs, const std::string& a,
                                  const std::string& b);

}  // namespace haptic::tools
