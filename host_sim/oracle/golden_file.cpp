// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/golden_file.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::json;

/// A JSON value that knows where it stands, for messages.
struct Place {
  const Json& json;
  std::string file, pointer;

  [[noreturn]] void fail(const std::string& defect) const {
    throw tools::InputError(file + ": " + (pointer.empty() ? "/" : pointer) + ": " + defect);
  }
  [[nodiscard]] bool has(const char* key) const {
    return json.is_object() && json.contains(key) && !json.at(key).is_null();
  }
  [[nodiscard]] Place at(const char* key) const {
    if (!json.is_object()) fail("an object is expected here");
    if (!json.contains(key)) fail(std::string("field '") + key + "' is missing; add it");
    return {json.at(key), file, pointer + "/" + key};
  }
  [[nodiscard]] Place at(std::size_t index) const {
    return {json.at(index), file, pointer + "/" + std::to_string(index)};
  }
  [[nodiscard]] std::size_t array_size() const {
    if (!json.is_array()) fail("an array is expected here");
    return json.size();
  }
};

Wide number(const Place& p) {
  if (p.json.is_number_integer()) return static_cast<Wide>(p.json.get<std::int64_t>());
  if (p.json.is_number()) return widen(p.json.get<double>());
  if (!p.json.is_string()) p.fail("a number or a decimal string is expected here");
  const std::string text = p.json.get<std::string>();
  char* end = nullptr;
  const Wide value = std::strtold(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value))
    p.fail("'" + text + "' is not a finite decimal");
  return value;
}

WideVec vector3(const Place& p) {
  if (p.array_size() != 3) p.fail("three numbers are expected here");
  return {number(p.at(std::size_t{0})), number(p.at(std::size_t{1})), number(p.at(std::size_t{2}))};
}

/// A vector given directly or as {"dec": ..., "rat": ...}.
WideVec decimal_vector(const Place& p) { return vector3(p.json.is_object() ? p.at("dec") : p); }

bool boolean(const Place& p) {
  if (!p.json.is_boolean()) p.fail("true or false is expected here");
  return p.json.get<bool>();
}

std::uint32_t index_number(const Place& p) {
  if (!p.json.is_number_unsigned() || p.json.get<std::uint64_t>() > UINT32_MAX) {
    p.fail("a whole number of 0 or more is expected here");
  }
  return p.json.get<std::uint32_t>();
}

std::vector<std::uint32_t> index_list(const Place& p) {
  std::vector<std::uint32_t> list;
  for (std::size_t i = 0; i < p.array_size(); ++i) list.push_back(index_number(p.at(i)));
  return list;
}

GoldenBody body(const Place& p) {
  GoldenBody out;
  if (p.has("name") && p.at("name").json.is_string())
    out.name = p.at("name").json.get<std::string>();
  const Place vertices = p.at("vertices_dec");
  for (std::size_t i = 0; i < vertices.array_size(); ++i)
    out.vertices.push_back(vector3(vertices.at(i)));
  const Place faces = p.at("faces_ccw_outward");
  for (std::size_t i = 0; i < faces.array_size(); ++i) {
    out.loops.push_back(index_list(faces.at(i)));
    if (out.loops.back().size() < 3) faces.at(i).fail("a face needs three vertices or more");
    for (const std::uint32_t v : out.loops.back()) {
      if (v >= out.vertices.size())
        faces.at(i).fail("vertex " + std::to_string(v) + " does not exist");
    }
  }
  return out;
}

/// An object of numbers by node.
std::vector<std::pair<std::uint32_t, Wide>> numbers_by_node(const Place& p) {
  if (!p.json.is_object()) p.fail("an object of node numbers is expected here");
  std::vector<std::pair<std::uint32_t, Wide>> numbers;
  for (const auto& [key, value] : p.json.items()) {
    char* end = nullptr;
    const unsigned long node = std::strtoul(key.c_str(), &end, 10);
    if (key.empty() || *end != '\0' || node > UINT32_MAX)
      p.fail("'" + key + "' is not a node number");
    numbers.emplace_back(static_cast<std::uint32_t>(node),
                         number({value, p.file, p.pointer + "/" + key}));
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

void read_forces(const Place& p, GoldenCase& c) {
  if (p.has("SCP")) c.scp = decimal_vector(p.at("SCP"));
  if (p.has("single_node_torque")) ++c.other_results;
  if (!p.has("paper")) return;
  const Place paper = p.at("paper");
  if (paper.has("force")) c.force_n = decimal_vector(paper.at("force"));
  if (paper.has("torque")) c.torque_nm = decimal_vector(paper.at("torque"));
  if (paper.has("info") && paper.at("info").has("margin_m"))
    c.margin_m = number(paper.at("info").at("margin_m"));
}

void read_tables(const Place& p, GoldenCase& c) {
  if (p.has("n_applicable_closed")) c.applicable_closed = index_number(p.at("n_applicable_closed"));
  if (p.has("n_applicable_strict")) c.applicable_strict = index_number(p.at("n_applicable_strict"));
  if (p.has("ratio_max")) {
    const Place ratio = p.at("ratio_max");
    c.ratio_max = number(ratio.json.is_object() ? ratio.at("dec") : ratio);
  }
  if (p.has("contact_nodes")) {
    c.contact_nodes = index_list(p.at("contact_nodes"));
    std::sort(c.contact_nodes->begin(), c.contact_nodes->end());
  }
  if (p.has("depth_by_node")) c.depth_by_node = numbers_by_node(p.at("depth_by_node"));
}

GoldenCase golden_case(const Place& p) {
  GoldenCase c;
  const Place id = p.at("id");
  if (!id.json.is_string()) id.fail("a text is expected here");
  c.id = id.json.get<std::string>();
  c.x = decimal_vector(p.at("x"));
  const Place q = p.at("quat_wxyz_int");
  if (q.array_size() != 4) q.fail("four numbers are expected here");
  Wide squares = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    c.q_wxyz[i] = number(q.at(i));
    squares += c.q_wxyz[i] * c.q_wxyz[i];
  }
  if (squares == 0) q.fail("a quaternion must not be zero");
  c.separated = boolean(p.at("separated"));
  c.touching = boolean(p.at("touching"));
  c.d_near_m = number(p.at("D_near"));
  c.near = index_list(p.at("near"));
  std::sort(c.near.begin(), c.near.end());
  if (p.has("near_coplanar")) c.near_coplanar = boolean(p.at("near_coplanar"));
  if (p.has("gap_to_next")) c.gap_to_next_m = number(p.at("gap_to_next"));
  if (p.has("min_violation_of_rejected")) {
    c.min_violation_of_rejected_m = number(p.at("min_violation_of_rejected"));
  }
  if (p.has("near_normal")) c.near_normal = decimal_vector(p.at("near_normal"));
  read_tables(p, c);
  read_forces(p, c);
  return c;
}

}  // namespace

GoldenFile read_golden_file(const std::string& path) {
  tools::note_input(path, "the golden file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw tools::InputError(path + ": cannot be opened; check the name");
  const std::string text((std::istreambuf_iterator<char>(stream)),
                         std::istreambuf_iterator<char>());
  Json root;
  try {
    root = Json::parse(text);
  } catch (const Json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    const auto line = 1 + std::count(text.begin(), end, '\n');
    throw tools::InputError(path + ":" + std::to_string(line) + ": byte " +
                            std::to_string(error.byte) + ": not JSON here; fix the syntax");
  }
  const Place top{root, path, ""};
  GoldenFile file;
  file.path = path;
  const Place family = top.at("family");
  if (!family.json.is_string()) family.fail("a text is expected here");
  file.family = family.json.get<std::string>();
  file.is_path = file.family.starts_with("path_");
  file.k_f_n_per_m = number(top.at("k_F"));
  if (!(file.k_f_n_per_m > 0)) top.at("k_F").fail("must be positive");
  file.a = body(top.at("A"));
  file.b = body(top.at("B"));
  file.node_count = index_number(top.at("node_count"));
  const Place cases = top.at("cases");
  for (std::size_t i = 0; i < cases.array_size(); ++i)
    file.cases.push_back(golden_case(cases.at(i)));
  if (file.cases.empty()) cases.fail("there are no cases");
  return file;
}

}  // namespace haptic::sim
