// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/surface_fuzz/surface_scene.hpp"

#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/shard_run.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/part_mesh.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;

constexpr double kStiffness_n_per_m = 1000;
constexpr std::uint64_t kMeshSeed = 71;

/// A folder that is removed with all that lies in it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "haptic_surface_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::system_error(errno, std::generic_category(), "mkdtemp " + name);
    }
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

FuzzMesh named(FuzzMesh mesh, const std::string& name) {
  mesh.name = name;
  return mesh;
}

SurfaceScene pair_of(FuzzMesh part, FuzzMesh around, double share = 1) {
  SurfaceScene scene;
  scene.name = part.name + ", " + around.name;
  scene.part = std::move(part);
  scene.around = std::move(around);
  scene.share = share;
  return scene;
}

SurfaceScene with_way(SurfaceScene scene, const Vector& at, const Vector& axis) {
  scene.through_at = at;
  scene.through_axis = axis.normalized();
  return scene;
}

std::vector<SurfaceScene> fixed_pairs() {
  const FuzzMesh box = box_mesh_of({0.02, 0.015, 0.01});
  const FuzzMesh blade = named(box_mesh_of({0.012, 0.004, 0.03}), "blade");
  const FuzzMesh peg = named(cylinder_mesh(16, 0.0095, 0.03), "peg of 16");
  const FuzzMesh ball = sphere_mesh(0.012, 1);
  const FuzzMesh ell = ell_mesh(0.04, 0.012, 0.01);
  const FuzzMesh drawer = drawer_mesh({0.04, 0.03, 0.02}, 0.003);
  const FuzzMesh slot = slotted_mesh(0.05, 0.015, 0.006, 0);
  const FuzzMesh plate = slotted_mesh(0.05, 0.015, 0.006, 0.002);
  const FuzzMesh tube = tube_mesh(24, 0.01, 0.02, 0.02);
  const FuzzMesh sheet = named(wavy_mesh(0.02, 2, 0, 1), "sheet");
  const FuzzMesh tray = tray_mesh({0.03, 0.025, 0.015});
  const FuzzMesh tray_part = named(tray_mesh({0.015, 0.012, 0.008}), "small tray");
  return {
      pair_of(box, ell),
      pair_of(ell, drawer),
      pair_of(blade, plate),
      with_way(pair_of(peg, tube), {0, 0, 0}, {0, 0, 1}),
      pair_of(ball, tube),
      pair_of(box, sphere_mesh(0.03, 1)),
      with_way(pair_of(tube_mesh(12, 0.015, 0.02, 0.01), ell), {0.01, -0.014, 0}, {1, 0, 0}),
      pair_of(ball, drawer),
      pair_of(box, slot),
      pair_of(blade, slot),
      pair_of(ball, torn_mesh(0.04, 8, kMeshSeed)),
      pair_of(blade, torn_mesh(0.04, 8, kMeshSeed + 1)),
      pair_of(box, wavy_mesh(0.05, 24, 0.003, 2), 0.5),
      pair_of(box, soup_mesh(60, 0.04, 0.02, kMeshSeed + 2)),
      pair_of(box, tray),
      pair_of(sheet, plate),
      pair_of(sheet, named(wavy_mesh(0.03, 3, 0, 1), "larger sheet")),
      pair_of(tray_part, ell),
      pair_of(ball, crossed_mesh(0.04)),
      pair_of(soup_mesh(20, 0.015, 0.01, kMeshSeed + 3), soup_mesh(30, 0.03, 0.02, kMeshSeed + 4)),
  };
}

/// A mesh of about `size` at random.
FuzzMesh drawn_mesh(Seeded& random, double size, bool closed_only) {
  const auto length = [&](double low, double high) { return size * random.uniform(low, high); };
  switch (random.below(closed_only ? 6 : 11)) {
    case 0:
      return box_mesh_of({length(0.2, 1), length(0.2, 1), length(0.02, 1)});
    case 1:
      return cylinder_mesh(3 + random.below(30), length(0.2, 1), length(0.1, 1));
    case 2: {
      const double outer = length(0.5, 1);
      return tube_mesh(6 + random.below(20), outer * random.uniform(0.4, 0.9), outer,
                       length(0.1, 1));
    }
    case 3: {
      const double arm = length(0.8, 1.6);
      return ell_mesh(arm, arm * random.uniform(0.1, 0.5), length(0.1, 0.6));
    }
    case 4:
      return drawer_mesh({length(0.6, 1), length(0.5, 1), length(0.3, 0.7)}, length(0.03, 0.1));
    case 5:
      return sphere_mesh(length(0.3, 0.8), random.below(2));
    case 6:
      return slotted_mesh(size, length(0.2, 0.5), length(0.1, 0.3), 0);
    case 7:
      return torn_mesh(size, 4 + 2 * random.below(4), random.below(1000));
    case 8:
      return wavy_mesh(size, 4 + random.below(10), length(0.02, 0.1), 1 + random.below(2));
    case 9:
      return soup_mesh(8 + random.below(40), length(0.4, 0.8), length(0.2, 0.5),
                       random.below(1000));
    default:
      return tray_mesh({length(0.5, 1), length(0.5, 1), length(0.2, 0.6)});
  }
}

bool usable(const SurfaceScene& scene, bool closed_only) { return scene.closed() || !closed_only; }

/// Fans over the polygons of a part as given, placed.
void add_triangles(const tools::ScenePart& part, const std::string& scene_file, bool placed,
                   std::vector<Triangle>& out) {
  const tools::PartMesh source = tools::read_part_mesh(part, scene_file);
  const tools::RawMesh& raw = source.mesh;
  const auto& q = part.quaternion_wxyz;
  const WideRotation r = rotation_of(widen(q[0]), widen(q[1]), widen(q[2]), widen(q[3]));
  const auto& at = part.position_m;
  const WideVec p{widen(at[0]), widen(at[1]), widen(at[2])};
  const auto corner = [&](std::uint32_t v) {
    const tools::Point3& file = raw.vertices[v];
    // As the compiler scales: in double.
    const auto& scale = source.scale_to_m;
    const WideVec x{widen(file[0] * scale[0]), widen(file[1] * scale[1]),
                    widen(file[2] * scale[2])};
    return placed ? p + r * x : x;
  };
  for (const tools::RawFace& face : raw.faces) {
    for (std::size_t k = 2; k < face.vertices.size(); ++k) {
      out.push_back(
          {corner(face.vertices[0]), corner(face.vertices[k - 1]), corner(face.vertices[k])});
    }
  }
}

/// The largest move of the surface that the compiler reports for a part, but for its shift of
/// origin.
double moved_m(const tools::PartReport& report) {
  double moved = report.largest_move_m;
  for (const tools::CleaningStep& step : report.steps) {
    if (step.name == "weld") moved += step.largest_move_m;
  }
  if (report.surface) moved += report.surface->largest_weld_move_m;
  if (report.collapsed) moved += report.collapsed->hausdorff_m();
  if (report.simplified) moved += report.simplified->hausdorff_m;
  return moved;
}

constexpr const char* kBystander_obj = "v -0.01 0.2 0\nv 0.01 0.2 0\nv 0 0.2 0.01\nf 1 2 3\n";

/// The line of a scene file that says how a part is taken.
std::string as_line(PartKind kind) { return "as = \"" + std::string(to_text(kind)) + "\"\n"; }

}  // namespace

const char* to_text(PartKind kind) { return kind == PartKind::kSolid ? "solid" : "surface"; }

std::size_t fixed_surface_scenes(bool closed_only) {
  const std::vector<SurfaceScene> pairs = fixed_pairs();
  return static_cast<std::size_t>(std::ranges::count_if(
      pairs, [&](const SurfaceScene& scene) { return usable(scene, closed_only); }));
}

std::vector<SurfaceScene> surface_scenes(std::size_t count, std::uint64_t seed, bool closed_only) {
  std::vector<SurfaceScene> scenes;
  for (SurfaceScene& scene : fixed_pairs()) {
    if (scenes.size() < count && usable(scene, closed_only)) scenes.push_back(std::move(scene));
  }
  for (std::uint64_t k = 0; scenes.size() < count; ++k) {
    Seeded random(seed_of(seed, 1000 + k));
    SurfaceScene scene = pair_of(drawn_mesh(random, random.uniform(0.008, 0.025), closed_only),
                                 drawn_mesh(random, random.uniform(0.02, 0.05), closed_only));
    scene.name += ", drawn " + std::to_string(k);
    scene.through_axis = random.direction();
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

std::string scene_text(const SurfaceScene& scene, double friction, std::uint32_t passes) {
  std::string text = "# SPDX-License-Identifier: Apache-2.0\nformat = 1\n";
  append_line(text, "name = \"%s\"", scene.name.c_str());
  text +=
      "[moving]\nmesh = \"part.obj\"\nscale_to_m = 1\ngrip_m = [0, 0, 0]\nposition_m = [0, 0, "
      "0.2]\n";
  text += "material = \"part\"\n" + as_line(scene.part_as);
  text += "[[static]]\nmesh = \"around.obj\"\nscale_to_m = 1\nmaterial = \"around\"\n" +
          as_line(scene.around_as);
  if (scene.has_bystander) {
    text += "[[static]]\nmesh = \"bystander.obj\"\nscale_to_m = 1\n" + as_line(PartKind::kSurface);
  }
  append_line(text, "[rendering]\nk_f_n_per_m = %g", kStiffness_n_per_m);
  append_line(text, "[coupling]\npasses = %u", passes);
  append_line(text, "[[friction]]\nmaterials = [\"part\", \"around\"]\nmu = %.17g", friction);
  return text;
}

CompiledSurface compiled_surface(const tools::SceneFile& file) {
  if (file.parameters.law != LawId::kProxy) {
    throw tools::InputError(file.file + ": its law is not proxy; only that holds a part outside");
  }
  const tools::CompiledScene scene = tools::compile_scene(file, {});
  CompiledSurface result;
  result.name = file.name;
  result.blob = scene.bytes;
  add_triangles(file.moving, file.file, false, result.moving);
  double largest_fixed = 0;
  for (std::size_t k = 0; k < scene.parts.size(); ++k) {
    if (k == 0) {
      result.moved_m = moved_m(scene.parts[0]);
      continue;
    }
    add_triangles(file.statics[k - 1], file.file, true, result.fixed);
    largest_fixed = std::max(largest_fixed, moved_m(scene.parts[k]));
  }
  result.moved_m += largest_fixed;
  const auto& p = file.moving.position_m;
  result.start = Vector(p[0], p[1], p[2]);
  return result;
}

CompiledSurface compiled_surface(const SurfaceScene& scene, double friction, std::uint32_t passes) {
  const ScratchFolder folder;
  const auto put = [&](const char* name, const std::string& text) {
    write_whole_file((folder.path() / name).string(), text);
  };
  put("part.obj", obj_text(scene.part));
  put("around.obj", obj_text(scene.around));
  if (scene.has_bystander) put("bystander.obj", kBystander_obj);
  const std::string text = scene_text(scene, friction, passes);
  return compiled_surface(tools::parse_scene_file(text, scene.name, folder.path()));
}

CompiledSurface compiled_surface(const std::string& scene_file,
                                 std::optional<std::uint32_t> passes) {
  tools::SceneFile file = tools::read_scene_file(scene_file);
  if (passes) file.coupling.passes = passes;
  return compiled_surface(file);
}

}  // namespace haptic::sim
