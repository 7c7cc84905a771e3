// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/pruning/pruned_scene.hpp"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/pruning/exposure.hpp"

namespace haptic::tools::test {
namespace {

PreparedBody put_together(const FlatBody& body, const Decomposition& pieces,
                          const std::vector<PieceExposure>& exposure, const std::string& name) {
  PreparedBody result;
  std::vector<std::size_t> order;
  result.placed.body = to_body(body, pieces, name, &order);
  for (const std::size_t k : order) result.exposure.push_back(exposure[k]);
  return result;
}

std::string shared_folder() { return std::string(HAPTIC_SHARED_DIR) + "/data/"; }

PreparedBody shared_body(const nlohmann::json& part, const std::string& folder) {
  CleaningOptions options;
  const nlohmann::json& scale = part["scale_to_m"];
  for (std::size_t k = 0; k < 3; ++k) {
    options.scale_to_m[k] = scale.is_array() ? scale[k].get<double>() : scale.get<double>();
  }
  const std::string file = part["file"].get<std::string>();
  FlatBody body = flatten(clean_surface(read_mesh(folder + file), options), {});
  return prepared(body, file);
}

}  // namespace

PreparedBody prepared(FlatBody& body, const std::string& name) {
  const Decomposition pieces = decompose(body, name, {});
  return put_together(body, pieces, exposure_of(body, pieces.pieces), name);
}

PreparedBody prepared_pieces(const FlatBody& body, const std::vector<Solid>& pieces,
                             const std::string& name, const std::vector<Solid>& seen) {
  Decomposition decomposition;
  decomposition.pieces = pieces;
  std::vector<PieceExposure> exposure = exposure_of(body, seen.empty() ? pieces : seen);
  exposure.resize(pieces.size());
  return put_together(body, decomposition, exposure, name);
}

SceneDescription scene_of(const PreparedBody& moving, const PreparedBody& fixed) {
  SceneDescription description;
  description.name = "sample";
  description.moving = moving.placed;
  description.statics = {fixed.placed};
  for (std::size_t k = 0; k < 3; ++k) {
    description.grip_m[k] = moving.placed.body.centre_of_volume_m[k];
  }
  description.exposure = moving.exposure;
  description.exposure.insert(description.exposure.end(), fixed.exposure.begin(),
                              fixed.exposure.end());
  return description;
}

std::vector<std::string> shared_names() {
  if (!std::filesystem::exists(shared_folder())) return {};
  return {"square_peg",     "cube_in_cup", "octagon_peg", "rect_peg_16mm",
          "corner_bracket", "ell_fixture", "plug_socket", "prism_stack"};
}

SceneDescription shared_scene(const std::string& name) {
  const std::string folder = shared_folder() + name + "/";
  std::ifstream stream(folder + "task.json");
  const nlohmann::json task = nlohmann::json::parse(stream);
  SceneDescription description =
      scene_of(shared_body(task["moving"], folder), shared_body(task["static"], folder));
  const nlohmann::json& pose = task["assembled_pose"];
  description.moving.position_m = pose["position_m"].get<std::array<double, 3>>();
  description.moving.quaternion_wxyz = pose["quaternion_wxyz"].get<std::array<double, 4>>();
  return description;
}

PrunedScene pruned(SceneDescription description) {
  PrunedScene scene;
  scene.account = prune_scene(description);
  const std::size_t moving = description.moving.body.pieces.size();
  const PieceExposure* exposure = description.exposure.data();
  scene.moving =
      piece_shapes(description.moving, &description.grip_m, exposure, description.orientation);
  scene.fixed = piece_shapes(description.statics[0], nullptr, exposure + moving, std::nullopt);
  scene.description = std::move(description);
  return scene;
}

OrientationEnvelope about_start(const SceneDescription& description, double max_angle_rad) {
  const std::array<double, 4>& q = description.moving.quaternion_wxyz;
  return {{q[1], q[2], q[3], q[0]}, max_angle_rad};
}

}  // namespace haptic::tools::test
