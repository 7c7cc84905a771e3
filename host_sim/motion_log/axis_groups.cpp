// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/axis_groups.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace haptic::sim {

std::vector<AxisGroup> axis_groups(std::span<const ColumnName> names, std::string_view axes,
                                   std::optional<int> (*rank_of)(std::string_view)) {
  std::map<std::string, std::map<char, std::vector<std::size_t>>> stems;
  for (std::size_t k = 0; k < names.size(); ++k)
    if (names[k].axis != 0) stems[names[k].stem][names[k].axis].push_back(k);
  std::vector<AxisGroup> groups;
  const std::string_view numbers = std::string_view("0123").substr(0, axes.size());
  for (const auto& [stem, columns] : stems) {
    const std::optional<int> rank = rank_of(stem);
    if (!rank) continue;
    for (const std::string_view wanted : {axes, numbers}) {
      AxisGroup group{stem, *rank, {}, wanted == numbers, false};
      for (const char axis : wanted) {
        const auto found = columns.find(axis);
        if (found == columns.end()) break;
        group.columns.push_back(found->second.front());
        group.twice = group.twice || found->second.size() > 1;
      }
      if (group.columns.size() != wanted.size()) continue;
      // More numbers than a place or a quaternion has: joints.
      if (group.numbered && columns.contains(static_cast<char>('0' + wanted.size()))) continue;
      if (group.numbered) group.rank += 5;
      groups.push_back(std::move(group));
    }
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const AxisGroup& a, const AxisGroup& b) { return a.rank < b.rank; });
  return groups;
}

std::string owner_of(std::string stem) {
  for (const std::string_view end : {"position", "translation", "pos", "orientation", "rotation",
                                     "quaternion", "quat", "rot", "q", "p"}) {
    if (!stem.ends_with(end)) continue;
    stem.erase(stem.size() - end.size());
    break;
  }
  return stem;
}

}  // namespace haptic::sim
