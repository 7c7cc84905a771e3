// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/compiler/part_scenes.hpp"

#include <fstream>

namespace haptic::test {

std::vector<std::string> compilable_parts() {
  return {"prism_stack", "square_peg",  "cube_in_cup",   "corner_bracket",
          "octagon_peg", "ell_fixture", "rect_peg_16mm", "plug_socket"};
}

std::vector<std::string> refused_parts() { return {"brick_stack", "gear_on_shaft"}; }

std::string shared_part(const std::string& name) {
  return std::string(HAPTIC_SHARED_DIR) + "/data/" + name;
}

nlohmann::json read_json(const std::string& path) {
  std::ifstream stream(path);
  return nlohmann::json::parse(stream);
}

std::string write_part_scene(const std::string& name, const sim::test::ScratchFolder& folder) {
  const nlohmann::json task = read_json(shared_part(name) + "/task.json");
  const auto part = [&](const char* role) {
    return "mesh = \"" + shared_part(name) + "/" + task[role]["file"].get<std::string>() +
           "\"\nscale_to_m = " + task[role]["scale_to_m"].dump() + "\nas = \"solid\"\n";
  };
  const nlohmann::json& start = task["start_pose"];
  const nlohmann::json& q = start["quaternion_wxyz"];
  const std::string path = folder.file("scene.toml");
  std::ofstream(path) << "format = 1\nname = \"" << name << "\"\n[moving]\n"
                      << part("moving") << "position_m = " << start["position_m"].dump()
                      << "\nquaternion = { w = " << q[0].dump() << ", x = " << q[1].dump()
                      << ", y = " << q[2].dump() << ", z = " << q[3].dump() << " }\n[[static]]\n"
                      << part("static") << "[rendering]\nk_f_n_per_m = 1000.0\n";
  return path;
}

void write_cube(const std::string& path, double offset) {
  std::ofstream out(path);
  for (int k = 0; k < 8; ++k) {
    out << "v " << offset + (k & 1) << ' ' << offset + ((k >> 1) & 1) << ' '
        << offset + ((k >> 2) & 1) << '\n';
  }
  out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

void write_cubes(const std::string& path, int count) {
  constexpr int kFaces[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                                {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
  std::ofstream out(path);
  for (int c = 0; c < count; ++c) {
    for (int k = 0; k < 8; ++k) {
      out << "v " << 2 * c + (k & 1) << ' ' << ((k >> 1) & 1) << ' ' << ((k >> 2) & 1) << '\n';
    }
    for (const auto& face : kFaces) {
      out << 'f';
      for (const int v : face) out << ' ' << 8 * c + v;
      out << '\n';
    }
  }
}

}  // namespace haptic::test
