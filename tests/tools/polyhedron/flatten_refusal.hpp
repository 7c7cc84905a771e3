// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What flattening says of a surface that it refuses.

#include <string>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools::parts {

inline std::string refusal(const Surface& s, const FlattenLimits& limits = {}) {
  try {
    flatten(s, limits);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

inline bool contains(const std::string& text, const std::string& piece) {
  return text.find(piece) != std::string::npos;
}

}  // namespace haptic::tools::parts
