// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_file.hpp"
#include "rt_core/scene/laws.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <string>

#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/formed_pairs.hpp"
#include "rt_core/scene/part_scenes.hpp"
#include "rt_core/scene/scene_format.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/named_file.hpp"
#include "tools/common/toml_file.hpp"
#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/graph/coupling_defaults.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/program/node_name.hpp"
#include "tools/graph_compiler/program/plausible_values.hpp"
#include "tools/graph_compiler/program/shape_table.hpp"

namespace haptic::tools {
namespace {

constexpr Range kStiffness{0.0, kMaxStiffness_n_per_m, true};
constexpr Range kRotaryStiffness{0.0, kMaxStiffness_n_per_m* kMaxSceneLength_m* kMaxSceneLength_m,
                                 true};
constexpr Range kLength{0.0, kMaxSceneLength_m, true};
constexpr Range kClimb{0.0, kMaxSceneLength_m};
constexpr Range kDamping{0.0, kMaxCouplingDamping_ns_per_m};
constexpr Range kShare{0.0, 1.0};
constexpr Range kRotation{0.0, kMaxRotationError_rad, true};
constexpr Range kWindow{0.0, kMaxWindow_s};

/// Reads `[coupling]`, which may be absent; `device` is that of the scene.
CouplingRequest read_coupling(const TomlTable& top, const DeviceParameters& device) {
  CouplingRequest request;
  const auto t =
      top.table("coupling",
                {"k_t_n_per_m", "k_r_nm_per_rad", "length_m", "damping_ns_per_m", "damping_share",
                 "max_rotation_error_rad", "max_translation_error_m", "min_window_s",
                 "max_window_s", "passivity", "allow_active", "passes", "tolerance_m", "climb_m"});
  if (!t) return request;
  request.k_t_n_per_m = t->number("k_t_n_per_m", kStiffness);
  request.k_r_nm_per_rad = t->number("k_r_nm_per_rad", kRotaryStiffness);
  request.length_m = t->number("length_m", kLength);
  if (request.k_r_nm_per_rad && request.length_m) {
    t->fail("length_m", "k_r_nm_per_rad is given too, which is k_t times its square; keep one");
  }
  request.damping_ns_per_m = t->number("damping_ns_per_m", kDamping);
  request.damping_share = t->number("damping_share", kShare);
  request.max_rotation_error_rad = t->number("max_rotation_error_rad", kRotation);
  request.max_translation_error_m = t->number("max_translation_error_m", kLength);
  request.min_window_s = t->number("min_window_s", kWindow);
  request.max_window_s = t->number("max_window_s", {0.0, kMaxWindow_s, true});
  const double least = request.min_window_s.value_or(kDefaultMinWindow_s);
  if (request.max_window_s && *request.max_window_s < least) {
    t->fail("max_window_s", "is below min_window_s (default 0.001); give at least that");
  }
  request.passivity = t->flag("passivity");
  if (request.passivity.value_or(false) && !(device.mass_kg > 0.0)) {
    t->fail("passivity", "its damping is limited by the mass of the device; give [device] mass_kg");
  }
  if (const auto passes = t->integer("passes")) {
    if (*passes < 1 || *passes > kMaxProxyPasses) {
      t->fail("passes", "is " + std::to_string(*passes) + "; give a whole number from 1 to " +
                            std::to_string(kMaxProxyPasses));
    }
    request.passes = static_cast<std::uint32_t>(*passes);
  }
  request.tolerance_m = t->number("tolerance_m", kLength);
  request.climb_m = t->number("climb_m", kClimb);
  request.allow_active = t->flag("allow_active").value_or(false);
  request.k_t_at = t->place("k_t_n_per_m");
  request.k_r_at = t->place(request.length_m ? "length_m" : "k_r_nm_per_rad");
  request.damping_at = t->place("damping_ns_per_m");
  return request;
}

/// Two names and mu each, no pair twice.
std::vector<FrictionPair> read_friction(const TomlTable& top) {
  std::vector<FrictionPair> pairs;
  for (const TomlTable& t : top.tables("friction", {"materials", "mu", "mu_static"})) {
    FrictionPair pair;
    const auto materials = t.word_pair("materials");
    if (!materials) t.fail_missing("materials", "name two, as in [\"steel\", \"pom\"]");
    pair.materials = *materials;
    pair.at = t.place("materials");
    const auto mu = t.number("mu", {0.0, kMaxFriction});
    if (!mu) t.fail_missing("mu", "give the Coulomb coefficient, from 0 to 2");
    pair.mu = *mu;
    pair.mu_static = t.number("mu_static", {0.0, kMaxFriction}).value_or(pair.mu);
    if (pair.mu_static < pair.mu) {
      t.fail("mu_static", "is below mu, the coefficient while the parts slide; give at least that");
    }
    if (friction_of(pairs, pair.materials[0], pair.materials[1])) {
      t.fail("materials", "'" + pair.materials[0] + "' and '" + pair.materials[1] +
                              "' have a coefficient already; keep one of the two tables");
    }
    pairs.push_back(pair);
  }
  return pairs;
}

// `[motion_limits]` of a scene file: how fast the hand moves, and where it takes the part.

constexpr Range kSpeed{0.0, std::numeric_limits<double>::infinity(), true};
/// A half turn reaches every orientation; more is taken for degrees.
constexpr Range kAngle{0.0, 3.1416};
constexpr Range kComponent{-2.0, 2.0};
constexpr Range kPlace{-1e5, 1e5};

std::array<double, 4> to_xyzw(const std::array<double, 4>& wxyz) {
  return {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
}

/// `about`: "start" or [w, x, y, z] of unit length.
std::array<double, 4> read_about(const TomlTable& t, ScenePart& moving) {
  if (!t.has("about")) return to_xyzw(moving.quaternion_wxyz);
  if (t.is_text("about")) {
    if (*t.text("about") != "start") {
      t.fail("about", "is '" + *t.text("about") + "'; give \"start\" or four numbers [w, x, y, z]");
    }
    return to_xyzw(moving.quaternion_wxyz);
  }
  std::array<double, 4> q = *t.vector4("about", kComponent);
  t.normalise("about", q, &moving.notes);
  return to_xyzw(q);
}

OrientationEnvelope read_orientation(const TomlTable& t, ScenePart& moving) {
  OrientationEnvelope envelope;
  envelope.about_xyzw = read_about(t, moving);
  const auto angle = t.number("max_angle_rad", kAngle);
  if (!angle) t.fail_missing("max_angle_rad", "give the largest tilt from `about` in radians");
  envelope.max_angle_rad = std::min(*angle, std::numbers::pi);
  return envelope;
}

WorkspaceBox read_workspace(const TomlTable& t) {
  const auto low = t.vector3("min_m", kPlace), high = t.vector3("max_m", kPlace);
  if (!low) t.fail_missing("min_m", "give the lowest x, y and z of the grip point in W");
  if (!high) t.fail_missing("max_m", "give the highest x, y and z of the grip point in W");
  for (std::size_t k = 0; k < 3; ++k) {
    if (!((*low)[k] <= (*high)[k])) {
      t.fail("max_m", std::string("is below min_m in ") + "xyz"[k] + "; exchange the two");
    }
  }
  return {*low, *high};
}

void read_speeds(const TomlTable& limits, SceneParameters& p) {
  const auto linear = limits.number("linear_m_per_s", kSpeed);
  const auto angular = limits.number("angular_rad_per_s", kSpeed);
  const bool ranges_alone = limits.has("orientation") || limits.has("workspace");
  if (!linear && !angular && ranges_alone) return;
  if (!linear) limits.fail_missing("linear_m_per_s", "give the largest speed of the hand");
  if (!angular) limits.fail_missing("angular_rad_per_s", "give the largest turning speed");
  p.motion_limits_given = 1;
  p.max_linear_speed_m_per_s = *linear;
  p.max_angular_speed_rad_per_s = *angular;
}

/// Reads speeds (both or neither), `orientation` and `workspace` of the scene, whose start pose has
/// been read. Nothing changes where the table is absent.
/// @throws InputError "file:line:column: defect; fix".
void read_motion_table(const TomlTable& top, SceneFile& scene) {
  const auto limits = top.table(
      "motion_limits", {"linear_m_per_s", "angular_rad_per_s", "orientation", "workspace"});
  if (!limits) return;
  read_speeds(*limits, scene.parameters);
  if (const auto orientation = limits->table("orientation", {"about", "max_angle_rad"})) {
    scene.orientation = read_orientation(*orientation, scene.moving);
  }
  if (const auto workspace = limits->table("workspace", {"min_m", "max_m"})) {
    scene.workspace = read_workspace(*workspace);
  }
}

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
/// Positions beyond this are taken for a wrong unit; doubles resolve 1e-11 m there.
constexpr Range kPosition{-1e5, 1e5};
constexpr Range kPositive{0.0, kNoLimit, true};
constexpr Range kNotNegative{0.0, kNoLimit};
constexpr Range kContactStiffness{0.0, kMaxStiffness_n_per_m, true};
/// The paper's epsilon is a width of a set of nearly equal depths, not a size of a part.
constexpr Range kEpsilon{0.0, 0.1, true};
constexpr Range kBand{0.0, kMaxSceneLength_m, true};
constexpr Range kRate{1.0, 1e5};
constexpr Range kHeldMass{0.0, kMaxHeldMass_kg, true};
constexpr Range kGravity{-kMaxGravity_m_per_s2, kMaxGravity_m_per_s2};
constexpr std::array<double, 3> kStandardGravity_m_per_s2{0.0, 0.0, -9.81};
constexpr std::int64_t kMaxPairVisits = 1 << 20;

/// Reads a pose; true when one of its keys is there.
bool read_pose(const TomlTable& t, ScenePart& part) {
  const auto position = t.vector3("position_m", kPosition);
  const auto quaternion = t.quaternion_wxyz("quaternion", &part.notes);
  if (position) part.position_m = *position;
  if (quaternion) part.quaternion_wxyz = *quaternion;
  return position || quaternion;
}

PartKind read_kind(const TomlTable& t) {
  const auto as = t.text("as");
  if (!as) return PartKind::kAny;
  if (*as == "solid") return PartKind::kSolid;
  if (*as != "surface") t.fail("as", "is '" + *as + "'; give \"solid\" or \"surface\"");
  return PartKind::kSurface;
}

/// Keys of `[moving]` and `[[static]]`.
std::vector<std::string_view> part_keys() {
  std::vector<std::string_view> keys{"mesh",       "link",       "frame",    "scale_to_m",
                                     "position_m", "quaternion", "material", "tolerance_m",
                                     "simplify_m", "disjoint",   "as",       "deflection_m"};
  keys.insert(keys.end(), shape_keys().begin(), shape_keys().end());
  return keys;
}

constexpr const char* kMeshPath =
    "give the path of a mesh file (STL, OBJ, OFF, PLY, 3MF, STEP, ...)";

/// Checks that `name` is a file; the mesh itself is read later.
void find_part_file(const TomlTable& t, std::string_view key, const std::string& name,
                    const std::filesystem::path& folder, ScenePart& part) {
  std::error_code error;
  if (!name.empty() && std::filesystem::is_directory(folder / name, error)) {
    t.fail(key, "'" + name + "' is a folder; " + kMeshPath);
  }
  std::optional<FoundFile> found;
  try {
    found = named_file(folder, name);
  } catch (const InputError& several) {
    t.fail(key, several.what());
  }
  if (!found) {
    t.fail(key, "no file '" + name + "'; " +
                    (is_windows_path(name) ? "this is a path of another system; give the one on "
                                             "this machine, counted from the scene file's folder"
                                           : "the path counts from the scene file's folder"));
  }
  part.path = found->path;
  if (!found->note.empty()) part.notes.push_back(found->note);
  note_input(part.path, "a mesh of the scene");
}

/// Links have a key of their own.
void check_no_description(const TomlTable& t, const std::string& name,
                          const std::filesystem::path& folder) {
  const std::string file = split_node(folder, name).file;
  if (!is_description(plain_name(file))) return;
  t.fail("mesh", "'" + name + "' is of a robot description; give link = \"" + file +
                     "#LINK\" instead, without scale_to_m" + links_told(folder / file));
}

void read_mesh_file(const TomlTable& t, const std::filesystem::path& folder, ScenePart& part) {
  part.mesh = *t.path("mesh");
  check_no_description(t, part.mesh, folder);
  const NodeName name = split_node(folder, part.mesh);
  if (!name.node && name.file != part.mesh) {
    t.fail("mesh", "'" + part.mesh + "' has nothing behind #; give the name of a node, as in \"" +
                       name.file + "#shaft\", or leave out #");
  }
  find_part_file(t, "mesh", name.file, folder, part);
  part.node = name.node;
  const auto scale = t.scale3("scale_to_m", kPositive);
  // The other formats state their unit.
  if (!scale && !import_format_of(part.path)) {
    t.fail_missing("scale_to_m",
                   "give metres per file unit: 0.001 for millimetres, 1.0 for metres");
  }
  if (!scale) return;
  part.scale_to_m = *scale;
  part.scale_at = t.place("scale_to_m");
}

/// "robot.urdf#link": robot descriptions are in metres.
void read_link(const TomlTable& t, const std::filesystem::path& folder, ScenePart& part) {
  part.mesh = *t.path("link");
  const NodeName name = split_node(folder, part.mesh);
  if (is_mesh_file(plain_name(name.file))) {
    t.fail("link",
           "'" + part.mesh + "' is of a mesh file; give mesh = \"" + part.mesh + "\" instead");
  }
  if (!name.node) {
    t.fail("link", "is '" + part.mesh +
                       "'; give a robot description and a link of it, as in "
                       "\"robot.urdf#gripper\"" +
                       links_told(folder / name.file));
  }
  part.link = name.node;
  find_part_file(t, "link", name.file, folder, part);
  const auto frame = t.text("frame");
  if (!frame || *frame == "link") return;
  if (*frame != "robot") {
    t.fail("frame", "is '" + *frame +
                        "'; give \"link\", the link's own, or \"robot\": where the joints at 0 "
                        "have it");
  }
  part.link_frame = LinkFrame::kRobot;
}

/// Reads one of `mesh`, `shape` and `link`.
void read_part_source(const TomlTable& t, const std::filesystem::path& folder, ScenePart& part) {
  constexpr const char* kSources[] = {"mesh", "shape", "link"};
  const char* source = nullptr;
  for (const char* key : kSources) {
    if (!t.has(key)) continue;
    if (source != nullptr) t.fail(key, std::string(source) + " is given too; keep one of the two");
    source = key;
  }
  if (source == nullptr) {
    t.fail_missing("mesh", std::string(kMeshPath) + ", or a shape without a file");
  }
  const std::string_view word = source;
  if (word != "shape") {
    for (const std::string_view key : shape_keys()) {
      if (t.has(key)) t.fail(key, "belongs to a part with shape; leave it out");
    }
  }
  if (word != "mesh" && t.has("scale_to_m")) {
    t.fail("scale_to_m", "the part is in metres already; leave it out");
  }
  if (word != "link" && t.has("frame")) t.fail("frame", "is of a link; leave it out");
  static_cast<void>(t.text(source));  // refuses what is no text
  if (word == "mesh") read_mesh_file(t, folder, part);
  if (word == "link") read_link(t, folder, part);
  if (word == "shape") {
    part.mesh = *t.text("shape");
    part.shape = read_shape(t);
  }
}

ScenePart read_part(const TomlTable& t, const std::filesystem::path& folder, bool& posed) {
  ScenePart part;
  read_part_source(t, folder, part);
  posed = read_pose(t, part);
  if (const auto material = t.text("material")) {
    if (material->empty()) t.fail("material", "is empty; give a name, as [[friction]] has it");
    part.material = *material;
  }
  part.deflection_m = t.number("deflection_m", kPositive);
  if (part.deflection_m && (part.link || import_format_of(part.path) != ImportFormat::kStep)) {
    t.fail("deflection_m", "is for STEP files, whose round faces become facets; leave it out");
  }
  // Scene files had simplify_m before surfaces could be simplified.
  const char* tolerance = t.has("tolerance_m") ? "tolerance_m" : "simplify_m";
  if (t.has("tolerance_m") && t.has("simplify_m")) {
    t.fail("simplify_m", "is the former name of tolerance_m, which is given too; leave it out");
  }
  part.tolerance_m = t.number(tolerance, kPositive);
  part.disjoint = t.flag("disjoint").value_or(false);
  part.kind = read_kind(t);
  if (part.kind == PartKind::kSurface && t.has("disjoint")) {
    t.fail("disjoint", "needs a solid, and as = \"surface\" makes none; keep one of them");
  }
  return part;
}

/// Mass and gravity; the rest of the held part follows from the solid.
void read_held_part(const TomlTable& moving, HeldPartParameters& held) {
  const auto mass = moving.number("mass_kg", kHeldMass);
  const auto gravity = moving.vector3("gravity_m_per_s2", kGravity);
  if (gravity && !mass) {
    moving.fail("gravity_m_per_s2", "acts on a part without mass; give mass_kg too");
  }
  if (!mass) return;
  held.mass_kg = *mass;
  std::ranges::copy(gravity.value_or(kStandardGravity_m_per_s2), held.gravity_m_per_s2);
}

/// Keys of a part that the hand may hold.
std::vector<std::string_view> held_keys() {
  std::vector<std::string_view> keys = part_keys();
  keys.insert(keys.end(), {"grip_m", "mass_kg", "gravity_m_per_s2"});
  return keys;
}

void read_moving(const TomlTable& top, const std::filesystem::path& folder, SceneFile& scene) {
  const std::vector<std::string_view> keys = held_keys();
  const auto moving = top.table("moving", keys);
  if (!moving) top.fail_missing("moving", "add the table [moving] with the part in the hand");
  bool posed = false;
  scene.moving = read_part(*moving, folder, posed);
  scene.moving.grip_m = moving->vector3("grip_m", kPosition);
  read_held_part(*moving, scene.moving.held);
  scene.parameters.held = scene.moving.held;
  const auto start = top.table("start", {"position_m", "quaternion"});
  if (!start) return;
  if (posed) {
    top.fail("start", "[moving] has a pose too, which is the start pose; keep one of the two");
  }
  read_pose(*start, scene.moving);
}

PartRole read_role(const TomlTable& t) {
  const auto role = t.text("role");
  if (!role)
    t.fail_missing("role",
                   "give \"hand\", \"hand2\", \"placed\", \"fixed\", \"driven\" or \"loose\"");
  if (*role == "hand") return PartRole::kHand;
  if (*role == "hand2") return PartRole::kHand2;
  if (*role == "placed") return PartRole::kPlaced;
  if (*role == "fixed") return PartRole::kFixed;
  if (*role == "driven") return PartRole::kDriven;
  if (*role == "loose") return PartRole::kLoose;
  t.fail("role",
         "is '" + *role +
             "'; give \"hand\" for the part that is held at first, \"hand2\" for that of a "
             "second hand, "
             "\"placed\" for one that may be held and stays where it is let go, \"fixed\" "
             "for one that never moves, "
             "\"driven\" for one that its owner moves, \"loose\" for one that what moves pushes");
}

/// Keys of a part that its owner moves.
constexpr const char* kDrivenKeys[] = {"fastest_m_per_s", "fastest_rad_per_s", "late_s", "push_n"};

DrivenRequest read_driven(const TomlTable& t) {
  const auto linear = t.number("fastest_m_per_s", kPositive);
  const auto angular = t.number("fastest_rad_per_s", kPositive);
  if (!linear) t.fail_missing("fastest_m_per_s", "give the largest speed at which the part moves");
  if (!angular)
    t.fail_missing("fastest_rad_per_s", "give the largest speed at which the part turns");
  DrivenRequest driven;
  driven.fastest_m_per_s = *linear;
  driven.fastest_rad_per_s = *angular;
  driven.late_s = t.number("late_s", {0.0, kLatestDriven_s, true}).value_or(kDefaultLate_s);
  driven.push_n = t.number("push_n", kPositive);
  driven.push_at = t.place("push_n");
  return driven;
}

/// Keys of a part that others push.
constexpr const char* kLooseKeys[] = {"yield_n", "weight_n", "fall_m_per_s"};

LooseRequest read_loose(const TomlTable& t) {
  LooseRequest loose;
  loose.yield_n = t.number("yield_n", kPositive);
  loose.weight_n = t.number("weight_n", kPositive);
  const auto fall = t.number("fall_m_per_s", kPositive);
  if (loose.yield_n && loose.weight_n)
    t.fail("yield_n", "is the force of an anchor, and weight_n is given too; keep one of the two");
  if (fall && !loose.weight_n)
    t.fail("fall_m_per_s",
           "is the speed at which a part with weight_n sinks; give that too, or "
           "leave it out");
  if (fall) loose.fall_m_per_s = *fall;
  return loose;
}

ScenePart read_named_part(const TomlTable& t, const std::filesystem::path& folder) {
  const auto name = t.text("name");
  if (!name || name->empty())
    t.fail_missing("name", "give the part a name, as the hand's commands have it");
  const PartRole role = read_role(t);
  bool posed = false;
  ScenePart part = read_part(t, folder, posed);
  part.name = *name;
  part.role = role;
  if (role != PartRole::kDriven) {
    for (const char* key : kDrivenKeys)
      if (t.has(key)) t.fail(key, "is of a part with role = \"driven\"; leave it out");
  }
  if (role != PartRole::kLoose) {
    for (const char* key : kLooseKeys)
      if (t.has(key)) t.fail(key, "is of a part with role = \"loose\"; leave it out");
  }
  if (role == PartRole::kFixed || role == PartRole::kDriven || role == PartRole::kLoose) {
    for (const char* key : {"grip_m", "mass_kg", "gravity_m_per_s2"})
      if (t.has(key)) t.fail(key, "is of a part that the hand may hold; leave it out");
    if (role == PartRole::kDriven) part.driven = read_driven(t);
    if (role == PartRole::kLoose) part.loose = read_loose(t);
    return part;
  }
  part.grip_m = t.vector3("grip_m", kPosition);
  read_held_part(t, part.held);
  return part;
}

/// `[[part]]`: the hand holds one after another.
void read_parts(const TomlTable& top, const std::filesystem::path& folder, SceneFile& scene) {
  std::vector<std::string_view> keys = held_keys();
  keys.insert(keys.end(), {"name", "role"});
  keys.insert(keys.end(), std::begin(kDrivenKeys), std::end(kDrivenKeys));
  keys.insert(keys.end(), std::begin(kLooseKeys), std::end(kLooseKeys));
  for (const char* key : {"moving", "static", "start"}) {
    if (!top.has(key)) continue;
    top.fail(key,
             "is of a scene with one moving part, and [[part]] is given too; write it as a "
             "[[part]] with name and role, or leave out [[part]]");
  }
  bool has_hand = false;
  std::uint32_t driven = 0, loose = 0;
  std::vector<std::string> names;
  for (const TomlTable& t : top.tables("part", keys)) {
    ScenePart part = read_named_part(t, folder);
    if (std::ranges::find(names, part.name) != names.end())
      t.fail("name", "'" + part.name + "' is the name of another part; give each its own");
    names.push_back(part.name);
    if (names.size() > kMostParts)
      t.fail("name", "is that of part " + std::to_string(names.size()) + "; a scene has at most " +
                         std::to_string(kMostParts));
    driven += part.role == PartRole::kDriven ? 1 : 0;
    loose += part.role == PartRole::kLoose ? 1 : 0;
    if (driven + loose > kMostDriven)
      t.fail("role", "makes " + std::to_string(driven + loose) +
                         " parts that are driven or loose; a scene has at most " +
                         std::to_string(kMostDriven) + ": make one fixed, or leave one out");
    if (part.role == PartRole::kHand2) {
      if (scene.has_second_hand())
        t.fail("role", "is \"hand2\" of another part already; each hand holds one");
      scene.statics.insert(scene.statics.begin(), std::move(part));
      continue;
    }
    if (part.role != PartRole::kHand) {
      scene.statics.push_back(std::move(part));
      continue;
    }
    if (has_hand)
      t.fail("role", "is \"hand\" of another part already; the hand holds one at a time");
    has_hand = true;
    scene.moving = std::move(part);
    scene.parameters.held = scene.moving.held;
  }
  if (!has_hand)
    top.fail("part", "none has role = \"hand\"; give it to the part that is held at first");
  if (scene.statics.empty()) top.fail("part", "is one alone; add the parts that it meets");
  const std::uint32_t always = driven + (scene.has_second_hand() ? 2 : 1);
  const std::uint32_t most = kMostMoving - (loose > 0 ? 1 : 0);
  if (always > most)
    top.fail("part", "has " + std::to_string(always) +
                         " parts in hands or driven, which move all the time; give at most " +
                         std::to_string(most) + (loose > 0 ? " beside loose ones" : "") +
                         ": make one fixed, or leave one out");
  if (scene.has_second_hand() && driven + loose == kMostDriven)
    top.fail("part", "has two hands and " + std::to_string(kMostDriven) +
                         " driven or loose parts; give at most " + std::to_string(kMostDriven - 1) +
                         " with two hands: make one fixed, or leave one out");
  const auto stays = [](const ScenePart& part) {
    return part.role == PartRole::kHand2 || part.role == PartRole::kLoose;
  };
  if (std::ranges::none_of(scene.statics, stays)) return;
  for (const ScenePart& part : scene.statics)
    if (part.role == PartRole::kPlaced)
      top.fail("part",
               "has two hands or loose parts, where hands hold their parts all the time, and '" +
                   part.name +
                   "' is \"placed\"; make it fixed, or leave \"hand2\" and \"loose\" out");
}

constexpr std::string_view kGuideKeys[] = {"plan", "pull_n", "hold_n", "let_go_m", "ramp_s"};

/// The guide of a table that has `plan`.
SceneGuide read_guide(const TomlTable& t, const std::filesystem::path& folder) {
  SceneGuide guide;
  guide.plan = folder / t.path("plan").value_or("");
  guide.pull_n = t.number("pull_n", kPositive);
  guide.hold_n = t.number("hold_n", kPositive);
  guide.let_go_m = t.number("let_go_m", kPositive);
  guide.ramp_s = t.number("ramp_s", kPositive);
  return guide;
}

/// Names the part that a stage brings to its goal. @throws InputError
std::string read_staged_part(const TomlTable& t, const SceneFile& scene) {
  const auto part = t.text("part");
  if (!part) t.fail_missing("part", "name the part that the stage brings to its goal");
  std::vector<std::string_view> movable;
  for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
    const ScenePart& known = numbered_part(scene, k);
    const bool may_move = known.role == PartRole::kHand || known.role == PartRole::kPlaced;
    if (may_move) movable.push_back(known.name);
    if (known.name != *part) continue;
    if (!may_move)
      t.fail("part", "'" + *part +
                         "' is fixed and stands already; leave this table out, or give the part "
                         "role = \"placed\"");
  }
  if (std::ranges::find(movable, *part) == movable.end()) {
    const std::string near = nearest_word(*part, movable);
    t.fail("part", "no part has the name '" + *part + "'; " +
                       (near.empty() ? "name a [[part]]" : "did you mean '" + near + "'?"));
  }
  for (const SceneStage& stage : scene.stages) {
    if (stage.part == *part)
      t.fail("part", "'" + *part + "' has a stage already, in line " +
                         std::to_string(stage.at.line) + "; a part is brought to its goal once");
  }
  return *part;
}

/// `[[stage]]`: the order of the assembly.
void read_stages(const TomlTable& top, const std::filesystem::path& folder, SceneFile& scene) {
  std::vector<std::string_view> keys{"part", "position_m", "quaternion"};
  keys.insert(keys.end(), std::begin(kGuideKeys), std::end(kGuideKeys));
  for (const TomlTable& t : top.tables("stage", keys)) {
    for (const ScenePart& part : scene.statics) {
      if (part.role == PartRole::kPlaced || part.role == PartRole::kFixed) continue;
      t.fail("part", "the scene has '" + part.name +
                         "' with role \"hand2\", \"driven\" or \"loose\", and stages are of "
                         "parts that one hand takes one after another; leave [[stage]] out");
    }
    SceneStage stage;
    stage.part = read_staged_part(t, scene);
    stage.at = t.place("part");
    ScenePart goal;
    if (!t.has("position_m"))
      t.fail_missing("position_m", "give the part's goal, where its mesh frame is in the end");
    static_cast<void>(read_pose(t, goal));
    stage.position_m = goal.position_m;
    stage.quaternion_wxyz = goal.quaternion_wxyz;
    scene.warnings.insert(scene.warnings.end(), goal.notes.begin(), goal.notes.end());
    if (t.has("plan")) {
      stage.guide = read_guide(t, folder);
    } else {
      for (const std::string_view key : kGuideKeys)
        if (t.has(key)) t.fail(key, "is of the guide along a plan; give plan too, or leave it out");
    }
    scene.stages.push_back(std::move(stage));
  }
}

/// `[bodies]`: pairs of parts that are not compiled, and whether parts are given assembled.
void read_bodies(const TomlTable& top, SceneFile& scene) {
  const auto bodies = top.table("bodies", {"never", "assembled"});
  if (!bodies) return;
  scene.assembled = bodies->flag("assembled").value_or(false);
  if (scene.assembled) {
    if (top.has("stage"))
      bodies->fail("assembled",
                   "makes a stage of each part's pose, and [[stage]] is given too; keep one of the "
                   "two");
    for (const ScenePart& part : scene.statics) {
      if (part.role != PartRole::kPlaced && part.role != PartRole::kFixed)
        bodies->fail("assembled", "is of parts that one hand takes one after another, and '" +
                                      part.name + "' is none; leave it out");
    }
  }
  scene.never = bodies->word_pairs("never");
  for (const auto& pair : scene.never) {
    for (const std::string& name : pair) {
      const bool is_known = name == scene.moving.name ||
                            std::ranges::any_of(scene.statics, [&](const ScenePart& part) {
                              return part.name == name;
                            });
      if (!is_known) bodies->fail("never", "names '" + name + "', and no part has that name");
    }
    if (pair[0] == pair[1])
      bodies->fail("never", "names '" + pair[0] + "' twice in one pair; name two parts");
  }
  for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
    const ScenePart& part = numbered_part(scene, k);
    const bool may_be_held = part.role != PartRole::kFixed && part.role != PartRole::kDriven;
    if (may_be_held && parts_met(scene, k).empty())
      bodies->fail("never", "leaves '" + part.name + "' nothing to meet; take a pair out");
  }
}

/// Refuses what a scene of one moving part may say, and one of several may not.
void check_parts(const TomlTable& top, const SceneFile& scene) {
  if (!scene.has_parts()) return;
  if (scene.orientation || scene.workspace)
    top.fail("motion_limits",
             "orientation and workspace are of one moving part; leave them out in a "
             "scene with [[part]]");
  if (scene.guide)
    top.fail("guide",
             "leads one moving part; in a scene with [[part]] give the plan of each part in its "
             "[[stage]]");
  if (scene.parameters.law != LawId::kProxy || has_goal_contact(scene.parameters))
    top.fail("rendering", "[[part]] asks for law = \"proxy\" without goal_contact");
}

/// Returns the place of the stiffness.
FilePlace read_rendering(const TomlTable& top, SceneParameters& p) {
  const auto rendering =
      top.table("rendering", {"law", "k_f_n_per_m", "epsilon_m", "exact_band_m", "goal_contact"});
  if (!rendering) {
    top.fail_missing("rendering", "add the table [rendering] with k_f_n_per_m, the stiffness");
  }
  const std::string law = rendering->text("law").value_or(kLaws[0].name);
  const LawRow* const row = find_law(law.c_str());
  if (row == nullptr) {
    std::string names;
    for (const LawRow& known : kLaws)
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    rendering->fail("law", "no law '" + law + "'; the laws are: " + names);
  }
  p.law = row->id;
  const auto stiffness = rendering->number("k_f_n_per_m", kContactStiffness);
  if (!stiffness) rendering->fail_missing("k_f_n_per_m", "give the stiffness k_F in N/m");
  p.k_f_n_per_m = *stiffness;
  p.epsilon_m = rendering->number("epsilon_m", kEpsilon).value_or(kDefaultEpsilon_m);
  p.exact_band_m = rendering->number("exact_band_m", kBand).value_or(kDefaultExactBand_m);
  // Under law proxy it serves checks and pictures alone, and takes most of the memory.
  const bool goal_contact = rendering->flag("goal_contact").value_or(p.law != LawId::kProxy);
  if (!goal_contact && p.law != LawId::kProxy) {
    rendering->fail("goal_contact", "law '" + law + "' is made of it; leave the line out");
  }
  p.goal_contact = goal_contact ? 1 : 0;
  p.rate_hz = kDefaultRate_hz;
  if (const auto loop = top.table("loop", {"rate_hz"})) {
    p.rate_hz = loop->number("rate_hz", kRate).value_or(kDefaultRate_hz);
  }
  return rendering->place("k_f_n_per_m");
}

void read_device(const TomlTable& top, SceneParameters& p) {
  DeviceParameters& d = p.device;
  const std::pair<std::string_view, double DeviceParameters::*> fields[] = {
      {"mass_kg", &DeviceParameters::mass_kg},
      {"damping_ns_per_m", &DeviceParameters::damping_ns_per_m},
      {"coulomb_friction_n", &DeviceParameters::coulomb_friction_n},
      {"encoder_step_m", &DeviceParameters::encoder_step_m},
      {"coulomb_torque_nm", &DeviceParameters::coulomb_torque_nm},
      {"encoder_step_rad", &DeviceParameters::encoder_step_rad},
      {"max_force_n", &DeviceParameters::max_force_n},
      {"max_torque_nm", &DeviceParameters::max_torque_nm},
      {"max_force_rate_n_per_s", &DeviceParameters::max_force_rate_n_per_s},
      {"max_torque_rate_nm_per_s", &DeviceParameters::max_torque_rate_nm_per_s},
      {"max_stiffness_n_per_m", &DeviceParameters::max_stiffness_n_per_m},
      {"max_damping_ns_per_m", &DeviceParameters::max_damping_ns_per_m},
      {"max_rotary_stiffness_nm_per_rad", &DeviceParameters::max_rotary_stiffness_nm_per_rad},
      {"delay_s", &DeviceParameters::delay_s}};
  std::vector<std::string_view> known;
  for (const auto& field : fields) known.push_back(field.first);
  known.push_back("rotor_inertia_kg_m2");
  known.push_back("rotor_damping_nms_per_rad");
  const auto device = top.table("device", known);
  if (!device) return;
  d.given = 1;
  for (const auto& [key, member] : fields)
    d.*member = device->number(key, kNotNegative).value_or(0);
  if (const auto inertia = device->scale3("rotor_inertia_kg_m2", kPositive)) {
    std::ranges::copy(*inertia, d.rotor_inertia_kg_m2);
  }
  if (const auto damping = device->scale3("rotor_damping_nms_per_rad", kNotNegative)) {
    if (!device->has("rotor_inertia_kg_m2")) {
      device->fail("rotor_damping_nms_per_rad",
                   "damps a rotor of unknown inertia; give rotor_inertia_kg_m2 too");
    }
    std::ranges::copy(*damping, d.rotor_damping_nms_per_rad);
  }
}

/// True if a part of the one material can meet one of the other.
bool may_meet(const SceneFile& scene, const FrictionPair& pair) {
  const auto meets_any = [&](const ScenePart& held, std::size_t except) {
    for (std::size_t k = 0; k < scene.statics.size(); ++k)
      if (k != except && pair.is_of(held.material, scene.statics[k].material)) return true;
    return false;
  };
  if (meets_any(scene.moving, scene.statics.size())) return true;
  for (std::size_t k = 0; k < scene.statics.size(); ++k)
    if (scene.statics[k].role == PartRole::kPlaced && meets_any(scene.statics[k], k)) return true;
  return false;
}

/// A [[friction]] table whose names are those of no part would be without effect in silence.
/// @throws InputError  a name that no part has as its material.
void check_materials(SceneFile& scene) {
  std::vector<std::string_view> known;
  if (!scene.moving.material.empty()) known.push_back(scene.moving.material);
  for (const ScenePart& part : scene.statics) {
    if (!part.material.empty()) known.push_back(part.material);
  }
  for (const FrictionPair& pair : scene.friction) {
    const std::string at = scene.file + ":" + std::to_string(pair.at.line) + ":" +
                           std::to_string(pair.at.column) + ": [[friction]] materials: ";
    for (const std::string& name : pair.materials) {
      if (std::ranges::find(known, name) != known.end()) continue;
      const std::string near = nearest_word(name, known);
      throw InputError(at + "no part is of '" + name + "'; " +
                       (near.empty() ? "" : "did you mean '" + near + "'? Or ") +
                       "write material = \"" + name +
                       "\" in the table of the part, or leave this table out");
    }
    if (may_meet(scene, pair)) continue;
    scene.warnings.push_back(at + "'" + pair.materials[0] + "' and '" + pair.materials[1] +
                             "' never meet: the part in the hand is " +
                             (scene.moving.material.empty()
                                  ? "without material"
                                  : "of '" + scene.moving.material + "'") +
                             ", and it alone moves");
  }
}

std::optional<BudgetLimit> read_limit(const TomlTable& t, std::string_view key) {
  const auto bytes = t.integer(key);
  if (!bytes) return std::nullopt;
  if (*bytes <= 0) t.fail(key, "is " + std::to_string(*bytes) + "; give a number of bytes above 0");
  const FilePlace place = t.place(key);
  return BudgetLimit{static_cast<std::uint64_t>(*bytes), place.line, place.column};
}

/// Reads `key` as a whole number from `low` to `high`.
std::optional<std::int64_t> read_count(const TomlTable& t, std::string_view key, std::int64_t low,
                                       std::int64_t high) {
  const auto count = t.integer(key);
  if (count && (*count < low || *count > high)) {
    t.fail(key, "is " + std::to_string(*count) + "; give a whole number from " +
                    std::to_string(low) + " to " + std::to_string(high));
  }
  return count;
}

void check_format(const TomlTable& top) {
  const auto format = top.integer("format");
  if (!format) top.fail_missing("format", "write format = 1 at the top");
  if (*format != 1) {
    top.fail("format", "is " + std::to_string(*format) + "; this compiler reads format = 1");
  }
}

std::string read_name(const TomlTable& top) {
  const auto name = top.text("name");
  if (!name) top.fail_missing("name", "give the scene a name");
  if (name->empty() || name->size() > 200) {
    top.fail("name", "has " + std::to_string(name->size()) + " bytes; give 1 to 200");
  }
  for (const char c : *name) {
    if (static_cast<unsigned char>(c) < 0x20) top.fail("name", "holds a control character");
  }
  return *name;
}

SceneFile read_tables(const TomlTable& top, const std::string& file,
                      const std::filesystem::path& folder) {
  SceneFile scene;
  scene.file = file;
  check_format(top);
  scene.name = read_name(top);
  if (top.has("part")) {
    read_parts(top, folder, scene);
    read_bodies(top, scene);
    read_stages(top, folder, scene);
  } else {
    if (top.has("stage"))
      top.fail("stage", "is the order in which [[part]]s are assembled; leave it out");
    if (top.has("bodies")) top.fail("bodies", "is of a scene with [[part]] tables; leave it out");
    read_moving(top, folder, scene);
    for (const TomlTable& t : top.tables("static", part_keys())) {
      bool posed = false;
      scene.statics.push_back(read_part(t, folder, posed));
    }
    if (scene.statics.empty()) {
      top.fail_missing("static", "add at least one [[static]] table with a fixed part");
    }
  }
  const FilePlace k_f_at = read_rendering(top, scene.parameters);
  read_motion_table(top, scene);
  read_device(top, scene.parameters);
  scene.coupling = read_coupling(top, scene.parameters.device);
  scene.coupling.k_f_at = k_f_at;
  scene.friction = read_friction(top);
  check_materials(scene);
  if (const auto cleaning = top.table("cleaning", {"plane_tolerance_m"})) {
    scene.plane_tolerance_m = cleaning->number("plane_tolerance_m", kPositive);
  }
  if (const auto budget = top.table("budget", {"constants_bytes", "state_bytes", "stack_bytes",
                                               "pair_visits", "work_units", "near_pairs"})) {
    scene.budget.constants = read_limit(*budget, "constants_bytes");
    scene.budget.state = read_limit(*budget, "state_bytes");
    scene.budget.stack = read_limit(*budget, "stack_bytes");
    if (const auto visits = read_count(*budget, "pair_visits", 1, kMaxPairVisits)) {
      scene.budget.pair_visits = static_cast<std::uint32_t>(*visits);
    }
    if (const auto units = read_count(*budget, "work_units", kLeastWorkUnits, kMostWorkUnits)) {
      scene.parameters.work_units = static_cast<std::uint32_t>(*units);
    }
    if (const auto pairs = read_count(*budget, "near_pairs", 1, kMostNearPairs)) {
      scene.budget.near_pairs = static_cast<std::uint32_t>(*pairs);
    }
  }
  if (const auto guide = top.table("guide", {std::begin(kGuideKeys), std::end(kGuideKeys)})) {
    if (!guide->has("plan")) guide->fail_missing("plan", "name the plan that host_sim plan wrote");
    scene.guide = read_guide(*guide, folder);
  }
  if (const auto memory = top.table("memory", {"graph_bytes"})) {
    const auto most = static_cast<std::int64_t>(kMaxGraphBytes);
    if (const auto bytes = read_count(*memory, "graph_bytes", 0, most)) {
      scene.graph_bytes = static_cast<std::uint64_t>(*bytes);
    }
  }
  check_parts(top, scene);
  return scene;
}

}  // namespace

std::optional<FrictionPair> friction_of(const std::vector<FrictionPair>& pairs,
                                        const std::string& a, const std::string& b) {
  for (const FrictionPair& pair : pairs) {
    if (pair.is_of(a, b)) return pair;
  }
  return std::nullopt;
}

const ScenePart& numbered_part(const SceneFile& scene, std::size_t part) {
  return part == 0 ? scene.moving : scene.statics[part - 1];
}

std::vector<std::size_t> parts_met(const SceneFile& scene, std::size_t part) {
  const std::string& name = numbered_part(scene, part).name;
  std::vector<std::size_t> met;
  for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
    const std::string& other = numbered_part(scene, k).name;
    const bool is_never = std::ranges::any_of(scene.never, [&](const auto& pair) {
      return (pair[0] == name && pair[1] == other) || (pair[1] == name && pair[0] == other);
    });
    if (k != part && !is_never) met.push_back(k);
  }
  return met;
}

std::vector<std::size_t> parts_standing(const SceneFile& scene, std::size_t part) {
  const std::vector<std::size_t> met = parts_met(scene, part);
  const bool is_loose = numbered_part(scene, part).role == PartRole::kLoose;
  std::vector<std::size_t> standing = met;
  std::erase_if(standing, [&](std::size_t k) {
    const PartRole role = numbered_part(scene, k).role;
    const bool moves = role == PartRole::kDriven || role == PartRole::kLoose;
    // To a loose part all that is held moves.
    const bool is_held = role == PartRole::kHand || role == PartRole::kHand2;
    return moves || (is_held && (scene.has_second_hand() || is_loose));
  });
  return standing.empty() ? met : standing;
}

SceneFile scene_holding(const SceneFile& scene, std::size_t part,
                        const std::vector<std::size_t>& others) {
  SceneFile held = scene;
  held.moving = numbered_part(scene, part);
  held.statics.clear();
  for (const std::size_t other : others) held.statics.push_back(numbered_part(scene, other));
  held.parameters.held = held.moving.held;
  return held;
}

SceneFile parse_scene_file(std::string_view text, const std::string& file,
                           const std::filesystem::path& folder) {
  const toml::table root = parse_toml(text, file);
  const bool is_scene = root.contains("moving") || root.contains("part");
  if (!is_scene && root.contains("waypoint"))
    throw InputError(file + ": is a motion script; make the motion from it with 'host_sim motion " +
                     file + " -o motion.csv', and give a scene file with [moving] here");
  if (!is_scene && root.contains("scene"))
    throw InputError(file + ": is a configuration of run_device, which names a compiled scene; " +
                     "give a scene file with [moving] here");
  const TomlTable top(root, file, "",
                      {"format", "name", "moving", "static", "part", "bodies", "stage", "rendering",
                       "start", "motion_limits", "loop", "device", "coupling", "friction", "budget",
                       "memory", "cleaning", "guide"});
  SceneFile scene = read_tables(top, file, folder);
  std::vector<std::string> odd = implausible_values(root, file);
  scene.warnings.insert(scene.warnings.end(), odd.begin(), odd.end());
  return scene;
}

SceneFile read_scene_file(const std::filesystem::path& path) {
  if (is_description(path))
    throw InputError(path.string() +
                     ": is a robot description; give the scene file (TOML) that names a link of "
                     "it, as link = \"FILE.urdf#LINK\", or make one with graph_compiler init");
  if (is_mesh_file(path))
    throw InputError(path.string() + ": is a mesh; give the scene file (TOML) that names it");
  const std::string text = read_text_file(path, kMaxSceneFileBytes, "the scene file");
  return parse_scene_file(text, path.string(), path.parent_path());
}

}  // namespace haptic::tools
