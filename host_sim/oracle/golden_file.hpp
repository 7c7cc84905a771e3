// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Golden vectors as they stand in their JSON files (format: tests/golden/FORMAT.md): decimals are
/// parsed in long double.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/oracle/wide.hpp"

namespace haptic::sim {

struct GoldenBody {
  std::string name;
  std::vector<WideVec> vertices;                  ///< [m]
  std::vector<std::vector<std::uint32_t>> loops;  ///< counter-clockwise seen from outside
};

/// One configuration; what a file leaves out is empty.
struct GoldenCase {
  std::string id;
  WideVec x;                               ///< position of A's frame in W [m]
  std::array<Wide, 4> q_wxyz{1, 0, 0, 0};  ///< not normalised
  bool separated = false, touching = false;
  Wide d_near_m = 0;
  std::vector<std::uint32_t> near;  ///< ascending
  bool near_coplanar = true;
  std::optional<Wide> gap_to_next_m, min_violation_of_rejected_m;
  std::optional<WideVec> near_normal;
  std::optional<Wide> ratio_max;
  std::optional<std::uint32_t> applicable_closed, applicable_strict;
  std::vector<std::pair<std::uint32_t, Wide>>
      depth_by_node;                                        ///< ascending by node; empty: not given
  std::optional<std::vector<std::uint32_t>> contact_nodes;  ///< ascending
  std::optional<WideVec> scp, force_n, torque_nm;
  std::optional<Wide> margin_m;  ///< not given: no change of decision nearby
  std::uint32_t other_results =
      0;  ///< results of rules that are not rendered, e.g. of a single node of several
};

struct GoldenFile {
  std::string path, family;
  Wide k_f_n_per_m = 0;
  GoldenBody a, b;
  std::uint32_t node_count = 0;
  bool is_path = false;  ///< cases are consecutive ticks of one motion
  std::vector<GoldenCase> cases;
};

/// @throws tools::InputError with file and place (line, or JSON pointer) on malformed JSON, a
/// missing field, a field of
///         the wrong type or a number that is not one.
[[nodiscard]] GoldenFile read_golden_file(const std::string& path);

}  // namespace haptic::sim
