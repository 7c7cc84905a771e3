// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_draft.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "rt_core/proxy/proxy_law.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/program/assembly.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/draft_mesh.hpp"
#include "tools/graph_compiler/program/odd_sizes.hpp"
#include "tools/graph_compiler/program/solid_places.hpp"
#include "tools/graph_compiler/program/unit_guess.hpp"

namespace haptic::tools {
namespace {

/// Between the boxes of the parts at the start, as a share of the moving part.
constexpr double kStartMargin = 0.1;
/// Share of the moving part's size: a clearance larger than this is not measured.
constexpr double kFarApart = 0.1;
constexpr int kSamples = 200;        ///< of a way out
constexpr int kSurfaceSamples = 50;  ///< of one where a part is a surface: each costs milliseconds

/// In metres, of meshes in file units.
DraftBox box_in_m(std::span<const DraftMesh> meshes, double scale_to_m) {
  DraftBox all = meshes.front().box();
  bool is_first = true;
  for (const DraftMesh& mesh : meshes) {
    const double scale = mesh.has_unit ? 1.0 : scale_to_m;
    const DraftBox box = mesh.box();
    for (std::size_t k = 0; k < 3; ++k) {
      all.low[k] = is_first ? scale * box.low[k] : std::min(all.low[k], scale * box.low[k]);
      all.high[k] = is_first ? scale * box.high[k] : std::max(all.high[k], scale * box.high[k]);
    }
    is_first = false;
  }
  return all;
}

/// Exact answers at any place of the part, its axes as filed.
class Places {
 public:
  /// @param filed_m  from where the shapes of `compiled` have the part to where the files have it
  Places(const CompiledScene& compiled, const Point3& filed_m)
      : filed_m_(filed_m),
        fixed_(compiled.start_shapes.begin() + 1, compiled.start_shapes.end()),
        surfaces_(compiled.start_shapes[0], fixed_) {
    const SceneBytes bytes{compiled.bytes};
    SceneView view;
    if (SceneView::open(bytes.span(), view) != RtStatus::kOk)
      throw std::logic_error("the scene just written does not open");
    // The tolerance up to which the core treats an overlap as free.
    touching_m_ = static_cast<double>(proxy_scale(view).tolerance_m);
    for (const PartReport& part : compiled.parts) has_surface_ |= part.is_surface();
    if (!has_surface_) solids_.emplace(view, touching_m_);
  }

  [[nodiscard]] bool has_surface() const { return has_surface_; }

  /// Parts overlap; those that touch do not.
  [[nodiscard]] bool collides(const Point3& p) const {
    return solids_ ? solids_->overlaps(p) : collision(p).has_value();
  }
  [[nodiscard]] std::optional<StartCollision> collision(const Point3& p) const {
    return surfaces_.collision(vec::add(filed_m_, p), touching_m_);
  }
  /// Depth of an overlap; for solids alone.
  [[nodiscard]] double depth_m(const Point3& p) const {
    return solids_ ? solids_->depth_m(p) : 0.0;
  }
  /// Distance between parts that do not overlap.
  [[nodiscard]] double distance_m(const Point3& p, double most_m) const {
    return surfaces_.distance_m(vec::add(filed_m_, p), most_m);
  }
  [[nodiscard]] double touching_m() const { return touching_m_; }
  [[nodiscard]] int samples() const { return has_surface_ ? kSurfaceSamples : kSamples; }

  [[nodiscard]] const StartShape& fixed(std::size_t index) const { return fixed_[index]; }

 private:
  Point3 filed_m_;
  bool has_surface_ = false;
  double touching_m_ = 0.0;
  std::vector<StartShape> fixed_;
  StartPlaces surfaces_;
  std::optional<SolidPlaces> solids_;
};

/// A straight way along an axis, until the boxes are apart.
struct WayOut {
  std::array<int, 3> direction{};
  double apart_m = 0.0;  ///< at which the boxes are apart; negative: they are already
  int collisions = 0;    ///< of Places::samples() places on it
};

/// All six, the best first: fewest collisions, then upwards, then the shortest.
std::vector<WayOut> ways_out(const DraftBox& moving, const DraftBox& fixed, Places& places,
                             const std::function<void(double fraction)>& tell) {
  constexpr std::array<std::array<int, 3>, 6> kDirections{
      {{0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, -1}}};
  std::vector<WayOut> ways;
  for (const std::array<int, 3>& direction : kDirections) {
    WayOut way;
    way.direction = direction;
    const auto axis = static_cast<std::size_t>(
        std::ranges::find_if(direction, [](int x) { return x != 0; }) - direction.begin());
    way.apart_m = direction[axis] > 0 ? fixed.high[axis] - moving.low[axis]
                                      : moving.high[axis] - fixed.low[axis];
    for (int k = 0; k < places.samples(); ++k) {
      Point3 p{};
      p[axis] = direction[axis] * std::max(0.0, way.apart_m) * k / places.samples();
      way.collisions += places.collides(p) ? 1 : 0;
      tell((static_cast<double>(ways.size()) + static_cast<double>(k) / places.samples()) /
           static_cast<double>(kDirections.size()));
    }
    ways.push_back(way);
  }
  std::ranges::stable_sort(
      ways, [](const WayOut& a, const WayOut& b) { return a.collisions < b.collisions; });
  return ways;
}

/// To two digits, so that a person can read it.
double rounded_up(double length_m) {
  if (!(length_m > 0.0)) return 0.0;
  const double step_m = std::pow(10.0, std::floor(std::log10(length_m)) - 1.0);
  return std::ceil(length_m / step_m) * step_m;
}

std::string way_text(const std::array<int, 3>& direction) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (direction[k] != 0) return std::string(direction[k] > 0 ? "+" : "-") + "xyz"[k];
  }
  return {};
}

/// In quotes, as TOML has it: control characters, such as a line break, by their numbers.
std::string quoted(const std::string& text) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      out += std::string("\\u00") + kDigits[byte >> 4] + kDigits[byte & 15U];
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

/// A name that a scene may have: blanks in place of control characters.
std::string scene_name(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, ' ');
  return text;
}

std::string mesh_path(const std::filesystem::path& mesh, const std::filesystem::path& folder) {
  return std::filesystem::proximate(mesh, folder.empty() ? "." : folder).generic_string();
}

SizedPart sized(const DraftMesh& mesh, double scale_to_m) {
  if (mesh.has_unit) return {mesh.name, mesh.diagonal(), {}};
  return {mesh.name, mesh.diagonal() * scale_to_m, scale_to_m};
}

ScenePart part_of(const DraftMesh& mesh, double scale) {
  ScenePart part;
  part.mesh = mesh.name;
  part.path = mesh.path;
  part.link = mesh.link;
  part.link_frame = mesh.in_robot ? LinkFrame::kRobot : LinkFrame::kLink;
  part.node = mesh.node;
  part.given = mesh.mesh;
  part.scale_to_m.fill(mesh.has_unit ? 1.0 : scale);
  return part;
}

/// The table [device], with what it makes of the stiffness asked for.
std::string device_table(double stiffness_n_per_m, double radius_m) {
  SceneParameters p{};
  p.law = LawId::kProxy;
  p.rate_hz = 1000.0;
  p.k_f_n_per_m = stiffness_n_per_m;
  p.device = drafted_device();
  const CouplingParameters felt = choose_coupling(p, {}, radius_m).coupling;
  const DeviceParameters& d = p.device;
  std::string text;
  const auto line = [&text](const char* key, double value, const std::string& means) {
    std::string row = std::string(key) + " = " + short_number(value, 6);
    if (!means.empty()) row.append(std::max<std::size_t>(row.size() + 1, 33) - row.size(), ' ');
    text += row + (means.empty() ? "" : "# " + means) + "\n";
  };
  text +=
      "\n[device]  # what the device can do: the reference device; give the numbers of your own\n";
  line("mass_kg", d.mass_kg, "that moves in the hand");
  line("damping_ns_per_m", d.damping_ns_per_m,
       "its own; the stiffness is at most half of what it holds: " +
           short_number(felt.k_t_n_per_m, 3) + " N/m");
  line("rotor_inertia_kg_m2", d.rotor_inertia_kg_m2[0], "that turns with the handle");
  line("rotor_damping_nms_per_rad", d.rotor_damping_nms_per_rad[0],
       "likewise: " + short_number(felt.k_r_nm_per_rad, 3) + " N m/rad are felt");
  line("encoder_step_m", d.encoder_step_m, "");
  line("encoder_step_rad", d.encoder_step_rad, "");
  line("delay_s", d.delay_s, "from sensing to acting: one period of the loop");
  line("max_force_n", d.max_force_n, "the pull grows no further");
  line("max_torque_nm", d.max_torque_nm, "");
  line("max_force_rate_n_per_s", d.max_force_rate_n_per_s, "");
  line("max_torque_rate_nm_per_s", d.max_torque_rate_nm_per_s, "");
  line("max_damping_ns_per_m", d.max_damping_ns_per_m,
       "of the coupling: none, its own holds the stiffness");
  return text;
}

std::string text_of(const DraftRequest& request, const SceneDraft& draft, const FileUnit& unit,
                    const std::vector<DraftMesh>& meshes, double radius_m) {
  const auto number = [](double x) { return short_number(x == 0.0 ? 0.0 : x, 9); };
  const auto lines_of = [&](const DraftMesh& mesh) {
    const std::string path = mesh_path(mesh.path, request.folder);
    if (mesh.link) {
      return "link = " + quoted(path + "#" + *mesh.link) + "\n" +
             (mesh.in_robot
                  ? "frame = \"robot\"         # it stands where the joints at 0 have it\n"
                  : "");
    }
    const std::string line = "mesh = " + quoted(mesh.node ? path + "#" + *mesh.node : path) + "\n";
    if (mesh.has_unit) return line;
    return line + "scale_to_m = " + number(draft.scale_to_m) +
           (request.scale_to_m ? "\n"
                               : std::string("  # guessed from the size: ") + unit.name +
                                     other_units_text(mesh.diagonal(), unit) + "\n");
  };
  std::string text =
      "# What each key means, and the others: SCENE_FILE.md. Units are SI.\n"
      "format = 1\nname = " +
      quoted(scene_name(request.name)) + "\n\n[moving]                # the part in the hand\n" +
      lines_of(meshes[0]) + "position_m = [" + number(draft.start_m[0]) + ", " +
      number(draft.start_m[1]) + ", " + number(draft.start_m[2]) +
      "]  # where it starts; [0, 0, 0] is where the file has it\n"
      "# grip_m = [0.0, 0.0, 0.0]   # where the hand holds it, in its mesh frame; default: centre "
      "of volume\n"
      "# tolerance_m = 0.0005       # simplify the part; its surface moves by less than this\n";
  for (std::size_t k = 1; k < meshes.size(); ++k) {
    text += "\n[[static]]              # a fixed part\n" + lines_of(meshes[k]);
  }
  return text + "\n[rendering]\nk_f_n_per_m = " + number(request.stiffness_n_per_m) +
         "     # stiffness that the hand feels, where the device holds it\n" +
         device_table(request.stiffness_n_per_m, radius_m) +
         "\n# [loop]\n# rate_hz = 1000         # ticks per second\n"
         "\n# [[friction]]           # give the parts a `material` too\n"
         "# materials = [\"steel\", \"pom\"]\n# mu = 0.2\n";
}

/// How the parts lie to each other where the files have them.
std::string filed_text(const Places& places, double size_m) {
  constexpr Point3 kFiled{0.0, 0.0, 0.0};
  constexpr const char* kWhy =
      "; a part that is larger than its hole, or was not drawn in its place, cannot go there";
  if (places.has_surface()) {
    if (const auto found = places.collision(kFiled)) {
      return "where the files have it the part " +
             collision_place_text(*found, places.fixed(found->fixed)) + kWhy;
    }
  } else if (const double depth_m = places.depth_m(kFiled); depth_m > 0.0) {
    return "where the files have them the parts overlap by " + spoken_length(depth_m) + kWhy;
  }
  const double most_m = kFarApart * size_m;
  const double distance_m = places.distance_m(kFiled, most_m);
  if (distance_m <= places.touching_m())
    return "where the files have them the parts touch, and are free";
  return "where the files have them the parts are " +
         std::string(distance_m < most_m ? "" : "more than ") + spoken_length(distance_m) +
         " apart";
}

}  // namespace

DeviceParameters drafted_device() {
  DeviceParameters d{};
  d.given = 1;
  d.mass_kg = 0.1;
  d.damping_ns_per_m = 1.0;
  std::ranges::fill(d.rotor_inertia_kg_m2, 1e-4);
  std::ranges::fill(d.rotor_damping_nms_per_rad, 1e-3);
  d.encoder_step_m = 1e-6;
  d.encoder_step_rad = 1e-5;
  d.delay_s = 1e-3;
  d.max_force_n = 12.0;
  d.max_torque_nm = 0.3;
  d.max_force_rate_n_per_s = 2000.0;
  d.max_torque_rate_nm_per_s = 40.0;
  d.max_damping_ns_per_m = 1e-6;
  return d;
}

namespace {

/// The meshes of the draft, the moving part first, and their unit.
struct DraftMeshes {
  std::vector<DraftMesh> meshes;
  FileUnit unit;
};

DraftMeshes read_meshes(const DraftRequest& request, std::vector<std::string>& remarks) {
  if (request.fixed.empty()) {
    Assembly assembly = read_assembly({request.moving, request.hand, request.scale_to_m});
    remarks = std::move(assembly.remarks);
    return {std::move(assembly.parts), assembly.unit};
  }
  if (request.hand) {
    throw UsageError("--hand " + *request.hand +
                     ": is for one file with several nodes; leave out the other files, or name "
                     "the node as FILE#NODE");
  }
  std::vector<DraftMesh> meshes{read_draft_mesh(request.moving)};
  for (const std::filesystem::path& path : request.fixed) meshes.push_back(read_draft_mesh(path));
  const FileUnit unit = unit_of(meshes);
  return {std::move(meshes), unit};
}

/// Says the same thing once.
void add_remark(std::vector<std::string>& remarks, const std::string& remark) {
  if (std::ranges::find(remarks, remark) == remarks.end()) remarks.push_back(remark);
}

}  // namespace

SceneDraft draft_scene(const DraftRequest& request) {
  SceneDraft draft;
  const auto [meshes, unit] = read_meshes(request, draft.remarks);
  draft.scale_to_m = request.scale_to_m.value_or(unit.scale_to_m);
  const auto unitless = std::ranges::find(meshes, false, &DraftMesh::has_unit);
  const bool has_unitless = unitless != meshes.end();
  if (has_unitless && !request.scale_to_m) {
    const double diagonal = unitless->diagonal();
    draft.remarks.push_back("unit: " + std::string(unit.name) + ", guessed, so that " +
                            unitless->name + " is " + spoken_length(diagonal * unit.scale_to_m) +
                            " across" + other_units_text(diagonal, unit) +
                            "; if that is wrong, give --scale METRES_PER_UNIT");
  }
  if (!has_unitless && request.scale_to_m) {
    draft.remarks.push_back("--scale has no use: every file states its unit");
  }
  for (const DraftMesh& mesh : meshes) {
    for (const std::string& warning : mesh.mesh->warnings) {
      add_remark(draft.remarks, mesh.path.string() + ": " + warning);
    }
    for (const std::string& note : mesh.mesh->notes) add_remark(draft.remarks, "note: " + note);
  }
  const DraftBox moving_box = box_in_m(std::span(meshes).first(1), draft.scale_to_m);
  const DraftBox fixed_box = box_in_m(std::span(meshes).subspan(1), draft.scale_to_m);
  const double size_m = moving_box.diagonal();
  if (size_m < kLeastHeld_m || size_m > kMostHeld_m) {
    draft.remarks.push_back(meshes[0].name + " is " + spoken_length(size_m) +
                            " across, which no hand holds; check the unit");
  }
  for (std::size_t k = 1; k < meshes.size(); ++k) {
    if (meshes[k].path == meshes[0].path) continue;  // one file, one unit
    const std::string remark =
        odd_sizes_text(sized(meshes[0], draft.scale_to_m), sized(meshes[k], draft.scale_to_m));
    if (!remark.empty()) draft.remarks.push_back(remark);
  }

  SceneFile scene;
  scene.file = scene.name = request.name;
  scene.parameters.k_f_n_per_m = request.stiffness_n_per_m;
  scene.parameters.goal_contact = 0;  // nothing is asked of the core
  scene.moving = part_of(meshes[0], draft.scale_to_m);
  // Clear of the others, as every start must be; the places asked about are others.
  scene.moving.position_m[2] = std::max(0.0, fixed_box.high[2] - moving_box.low[2] + size_m);
  for (std::size_t k = 1; k < meshes.size(); ++k)
    scene.statics.push_back(part_of(meshes[k], draft.scale_to_m));
  CompileOptions options;
  options.for_questions = true;
  options.progress = request.progress;
  const CompiledScene compiled = compile_scene(scene, options);
  Places places(compiled, vec::scaled(scene.moving.position_m, -1.0));

  const WayOut way = ways_out(moving_box, fixed_box, places, [&](double fraction) {
                       if (request.progress)
                         request.progress(request.name, "looking for a way out", fraction);
                     }).front();
  draft.way = way.direction;
  const double away_m = rounded_up(std::max(0.0, way.apart_m + kStartMargin * size_m));
  for (std::size_t k = 0; k < 3; ++k) draft.start_m[k] = way.direction[k] * away_m;
  const std::string place =
      away_m > 0 ? spoken_length(away_m) + " along " + way_text(way.direction) + " from where"
                 : std::string("where");
  if (places.collides(draft.start_m)) throw std::logic_error("parts whose boxes are apart overlap");
  draft.remarks.push_back("start: " + place +
                          " the files have the part; free of all fixed parts, " +
                          (places.has_surface() ? "by an exact test of their facets"
                                                : "by the exact verdict of every pair"));
  draft.remarks.push_back(filed_text(places, size_m));
  if (way.collisions > 0) {
    draft.remarks.push_back(
        "no straight way along an axis leads out without a collision; the best "
        "is " +
        way_text(way.direction) + ", with " + std::to_string(way.collisions) + " of " +
        std::to_string(places.samples()) + " places colliding");
  }
  const SceneBytes bytes(compiled.bytes);
  SceneView view;
  if (SceneView::open(bytes.span(), view) != RtStatus::kOk)
    throw std::logic_error("the scene just written does not open");
  draft.toml = text_of(request, draft, unit, meshes, served_size(view).radius_m);
  return draft;
}

}  // namespace haptic::tools
