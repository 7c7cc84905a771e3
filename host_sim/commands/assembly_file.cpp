// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/assembly_file.hpp"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "tools/common/error.hpp"
#include "tools/common/toml_file.hpp"

namespace haptic::sim {
namespace {

/// A scene file is no larger [bytes].
constexpr std::size_t kMostBytes = std::size_t{1} << 20;

void set_place(toml::table& table, const PartPlace& place) {
  const double* const p = place.p_wa_m;
  const double* const q = place.q_wa_xyzw;
  table.insert_or_assign("position_m", toml::array{p[0], p[1], p[2]});
  toml::table turn{{"w", q[3]}, {"x", q[0]}, {"y", q[1]}, {"z", q[2]}};
  turn.is_inline(true);
  table.insert_or_assign("quaternion", std::move(turn));
}

}  // namespace

AssemblyFile::AssemblyFile(const std::string& path, const PartScenes& parts) : path_(path) {
  if (!std::filesystem::exists(path)) {
    throw tools::InputError(path +
                            ": no such file; name the scene file that the scene was compiled from "
                            "with --scene-file");
  }
  table_ = tools::read_toml_file(path, kMostBytes, "the scene file");
  std::vector<std::string> names;
  if (const toml::array* const tables = table_["part"].as_array()) {
    for (const toml::node& node : *tables)
      if (const toml::table* const part = node.as_table())
        names.push_back((*part)["name"].value_or(std::string()));
  }
  bool is_same = names.size() == parts.count();
  for (std::uint32_t k = 0; k < parts.count(); ++k)
    is_same = is_same && std::ranges::find(names, parts.name(k)) != names.end();
  if (!is_same) {
    throw tools::InputError(path +
                            ": has other parts than the compiled scene; name the scene file that "
                            "it was compiled from with --scene-file, or compile it again");
  }
}

std::string AssemblyFile::with_order(const std::vector<OrderedPart>& order, bool has_plans) const {
  toml::table scene = table_;
  const std::filesystem::path folder = std::filesystem::absolute(path_).parent_path();
  for (toml::node& node : *scene["part"].as_array()) {
    toml::table& part = *node.as_table();
    for (const char* const key : {"mesh", "link"}) {
      const auto file = part[key].value<std::string>();
      if (file) part.insert_or_assign(key, (folder / *file).lexically_normal().string());
    }
    const std::string name = part["name"].value_or(std::string());
    const std::string role = part["role"].value_or(std::string());
    if (role == "hand") part.insert_or_assign("role", "placed");
    if (name == order.front().name) part.insert_or_assign("role", "hand");
    const auto of = std::ranges::find(order, name, &OrderedPart::name);
    if (of != order.end()) set_place(part, of->start);
  }
  if (toml::table* const bodies = scene["bodies"].as_table()) bodies->erase("assembled");
  toml::array stages;
  for (std::size_t k = 0; k < order.size(); ++k) {
    toml::table stage{{"part", order[k].name}};
    set_place(stage, order[k].goal);
    if (has_plans) stage.insert_or_assign("plan", std::to_string(k + 1) + ".plan");
    stages.push_back(std::move(stage));
  }
  scene.insert_or_assign("stage", std::move(stages));
  std::ostringstream text;
  text << scene << "\n";
  return text.str();
}

}  // namespace haptic::sim
