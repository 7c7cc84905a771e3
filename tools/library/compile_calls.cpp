// SPDX-License-Identifier: Apache-2.0
// Group compile: meshes and numbers to the bytes of a scene, by the same steps as graph_compiler.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rt_core/scene/part_scenes.hpp"
#include "rt_core/scene/scene_format.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/memory_budget.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/library/call.hpp"
#include "tools/library/message_record.hpp"

using namespace haptic::tools;

struct haptic_compiled {
  std::uint64_t magic;
  std::optional<SceneBytes> bytes;  ///< absent: the compilation failed
  std::vector<MessageRecord> messages;
};

namespace {

constexpr std::uint64_t kCompiledMagic = 0x636f6d70696c6564;
constexpr std::size_t kMostFixed = 10'000;

int check_handle(const haptic_compiled* compiled) noexcept {
  if (compiled == nullptr) return HAPTIC_ERROR_NULL;
  return compiled->magic == kCompiledMagic ? HAPTIC_OK : HAPTIC_ERROR_HANDLE;
}

int check_part(const haptic_part* part) noexcept {
  if (const int error = check_structure(part); error != HAPTIC_OK) return error;
  if (part->file == nullptr) {
    if (part->vertices == nullptr || part->triangles == nullptr) return HAPTIC_ERROR_NULL;
    if (part->vertex_count == 0 || part->triangle_count == 0 ||
        part->vertex_count > kMaxMeshVertices || part->triangle_count > kMaxMeshFaces)
      return HAPTIC_ERROR_SIZE;
  }
  if (!is_within(part->scale_to_m, 1e-12, 1e12) || !is_within(part->simplify_m, 0, 1e6) ||
      part->may_be_held > HAPTIC_LOOSE)
    return HAPTIC_ERROR_NUMBER;
  return is_pose(part->pose) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
}

int check_input(const haptic_compile_input* input) noexcept {
  if (const int error = check_structure(input); error != HAPTIC_OK) return error;
  if (input->scene_file != nullptr) return HAPTIC_OK;
  if (input->moving == nullptr || input->fixed == nullptr) return HAPTIC_ERROR_NULL;
  if (input->fixed_count == 0 || input->fixed_count > kMostFixed) return HAPTIC_ERROR_SIZE;
  if (const int error = check_part(input->moving); error != HAPTIC_OK) return error;
  for (std::size_t k = 0; k < input->fixed_count; ++k) {
    if (const int error = check_part(input->fixed + k); error != HAPTIC_OK) return error;
  }
  const auto is_place = [](double x) { return is_within(x, -1e5, 1e5); };
  const bool numbers = is_within(input->stiffness_n_per_m, haptic::kMinStiffness_n_per_m,
                                 haptic::kMaxStiffness_n_per_m) &&
                       is_within(input->friction, 0, haptic::kMaxFriction) &&
                       is_within(input->rate_hz, 1, 1e5) &&
                       (input->has_grip == 0 || std::ranges::all_of(input->grip_m, is_place));
  return numbers ? HAPTIC_OK : HAPTIC_ERROR_NUMBER;
}

/// Places of messages are counted from 1: "moving:12: .." is about triangle 12.
std::shared_ptr<const RawMesh> mesh_of_arrays(const haptic_part& part, const std::string& name) {
  auto mesh = std::make_shared<RawMesh>();
  mesh->file = name;
  mesh->indexed = true;
  mesh->vertices.resize(part.vertex_count);
  mesh->vertex_places.resize(part.vertex_count);
  for (std::size_t v = 0; v < part.vertex_count; ++v) {
    mesh->vertex_places[v] = v + 1;
    std::copy_n(part.vertices + 3 * v, 3, mesh->vertices[v].begin());
    if (!std::ranges::all_of(mesh->vertices[v], [](double x) { return std::isfinite(x); })) {
      throw InputError(name + ": vertex " + std::to_string(v) +
                       " is not finite; give three numbers for each vertex");
    }
  }
  mesh->faces.resize(part.triangle_count);
  for (std::size_t t = 0; t < part.triangle_count; ++t) {
    RawFace& face = mesh->faces[t];
    face.vertices.assign(part.triangles + 3 * t, part.triangles + 3 * t + 3);
    face.source_place = t + 1;
    const std::uint32_t largest = *std::ranges::max_element(face.vertices);
    if (largest >= part.vertex_count) {
      throw InputError(name + ":" + std::to_string(t + 1) + ": names vertex " +
                       std::to_string(largest) + " of " + std::to_string(part.vertex_count) +
                       "; vertices are counted from 0");
    }
  }
  return mesh;
}

ScenePart scene_part(const haptic_part& given, const std::string& role) {
  ScenePart part;
  part.path = given.file != nullptr ? given.file : role;
  part.mesh = given.name != nullptr && *given.name != '\0' ? given.name
              : given.file != nullptr                      ? given.file
                                                           : role;
  if (given.file == nullptr) {
    part.path = part.mesh;
    part.given = mesh_of_arrays(given, part.mesh);
  }
  part.scale_to_m.fill(given.scale_to_m);
  std::copy_n(given.pose, 3, part.position_m.begin());
  const double* q = given.pose + 3;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  part.quaternion_wxyz = {q[3] / length, q[0] / length, q[1] / length, q[2] / length};
  if (given.simplify_m > 0) part.tolerance_m = given.simplify_m;
  return part;
}

/// The widest limits: those that a call which drives it states are as tight, or tighter.
haptic::tools::DrivenRequest fastest_driven() {
  haptic::tools::DrivenRequest driven;
  driven.fastest_m_per_s = kMostFrame_m_per_s;
  driven.fastest_rad_per_s = kMostFrame_rad_per_s;
  driven.late_s = kMostFrame_late_s;
  return driven;
}

/// The hand may hold some of them one after another, and owners move others, by their names.
void name_parts(std::span<const haptic_part> fixed, SceneFile& scene) {
  if (fixed.size() >= haptic::kMostParts)
    throw InputError("the scene has " + std::to_string(fixed.size() + 1) +
                     " parts, and one whose parts may be held has at most " +
                     std::to_string(haptic::kMostParts));
  scene.moving.name = scene.moving.mesh;
  scene.moving.role = haptic::PartRole::kHand;
  std::vector<std::string> names{scene.moving.name};
  for (std::size_t k = 0; k < fixed.size(); ++k) {
    ScenePart& part = scene.statics[k];
    part.name = part.mesh;
    if (fixed[k].may_be_held == HAPTIC_PLACED) part.role = haptic::PartRole::kPlaced;
    if (fixed[k].may_be_held == HAPTIC_LOOSE) part.role = haptic::PartRole::kLoose;
    if (fixed[k].may_be_held == HAPTIC_HAND2) part.role = haptic::PartRole::kHand2;
    if (fixed[k].may_be_held == HAPTIC_DRIVEN) {
      part.role = haptic::PartRole::kDriven;
      part.driven = fastest_driven();
    }
    if (std::ranges::find(names, part.name) != names.end())
      throw InputError(part.name + ": is the name of another part too; give each its own");
    names.push_back(part.name);
  }
  const auto count = [&](std::uint32_t role) {
    return std::ranges::count(fixed, role, &haptic_part::may_be_held);
  };
  if (count(HAPTIC_HAND2) + count(HAPTIC_LOOSE) == 0) return;
  if (count(HAPTIC_HAND2) > 1)
    throw InputError("two parts are for a second hand, which holds one; give one of them");
  if (count(HAPTIC_PLACED) > 0)
    throw InputError(
        "a scene with two hands or loose parts, where hands hold their parts all the time, has no "
        "part that may be held after another; make it fixed");
  if (count(HAPTIC_HAND2) == 0) return;
  // The second hand's part is the first one behind that of the first.
  const auto second = std::ranges::find(scene.statics, haptic::PartRole::kHand2, &ScenePart::role);
  std::rotate(scene.statics.begin(), second, second + 1);
}

/// The scene file with the same parts and numbers.
SceneFile scene_of(const haptic_compile_input& input) {
  SceneFile scene;
  scene.name = input.name != nullptr && *input.name != '\0' ? input.name : "scene";
  scene.file = scene.name;
  if (scene.name.size() > 200)
    throw InputError("the scene's name is longer than 200 bytes; cut it");
  scene.moving = scene_part(*input.moving, "moving");
  for (std::size_t k = 0; k < input.fixed_count; ++k)
    scene.statics.push_back(scene_part(input.fixed[k], "fixed " + std::to_string(k)));
  scene.parameters.k_f_n_per_m = input.stiffness_n_per_m;
  scene.parameters.rate_hz = input.rate_hz;
  scene.parameters.goal_contact = 0;
  if (input.has_grip != 0) {
    scene.moving.grip_m.emplace();
    std::copy_n(input.grip_m, 3, scene.moving.grip_m->begin());
  }
  if (input.friction > 0) {
    // Each part that may be held may rub on each other.
    scene.friction.push_back({{"part", "part"}, input.friction, input.friction});
    scene.moving.material = "part";
    for (ScenePart& part : scene.statics) part.material = "part";
  }
  const std::span fixed(input.fixed, input.fixed_count);
  if (std::ranges::any_of(fixed,
                          [](const haptic_part& p) { return p.may_be_held != HAPTIC_FIXED; }))
    name_parts(fixed, scene);
  return scene;
}

/// Names that a message may begin with, as far as the scene is known.
std::vector<std::string> file_names(const haptic_compile_input& input) {
  if (input.scene_file != nullptr) return {input.scene_file};
  std::vector<std::string> names;
  const auto add = [&](const haptic_part& part, const std::string& role) {
    names.push_back(role);
    for (const char* name : {part.file, part.name}) {
      if (name != nullptr) names.emplace_back(name);
    }
  };
  add(*input.moving, "moving");
  for (std::size_t k = 0; k < input.fixed_count; ++k)
    add(input.fixed[k], "fixed " + std::to_string(k));
  return names;
}
void add_file_names(const SceneFile& scene, std::vector<std::string>& names) {
  names.push_back(scene.file);
  for (const std::span<const ScenePart> parts :
       {std::span(&scene.moving, 1), std::span<const ScenePart>(scene.statics)}) {
    for (const ScenePart& part : parts) {
      names.push_back(part.mesh);
      names.push_back(part.path.string());
    }
  }
}

void compile_into(const haptic_compile_input& input, haptic_compiled& out,
                  std::vector<std::string>& files) {
  files = file_names(input);
  const SceneFile scene =
      input.scene_file != nullptr ? read_scene_file(input.scene_file) : scene_of(input);
  // Nothing is written here that could replace an input.
  forget_file_roles();
  add_file_names(scene, files);
  const CompiledScene compiled = compile_scene(scene, {});
  for (const std::string& warning : warnings_of(compiled))
    out.messages.push_back(message_record(HAPTIC_WARNING, warning, files));
  for (const std::string& note : compiled.notes)
    out.messages.push_back(message_record(HAPTIC_NOTE, note, files));
  out.bytes.emplace(std::span(compiled.bytes));
}

}  // namespace

int haptic_compile(const haptic_compile_input* input, haptic_compiled** compiled) {
  if (compiled == nullptr) return HAPTIC_ERROR_NULL;
  *compiled = nullptr;
  if (const int error = check_input(input); error != HAPTIC_OK) return error;
  return guarded([&] {
    auto out = std::make_unique<haptic_compiled>();
    out->magic = kCompiledMagic;
    std::vector<std::string> files;
    const auto failed = [&](int error, const char* text) {
      out->messages.push_back(message_record(HAPTIC_SEVERE, text, files));
      *compiled = out.release();
      return error;
    };
    try {
      compile_into(*input, *out, files);
    } catch (const BudgetError& error) {
      return failed(HAPTIC_ERROR_LIMIT, error.what());
    } catch (const LimitError& error) {
      return failed(HAPTIC_ERROR_LIMIT, error.what());
    } catch (const InputError& error) {
      return failed(HAPTIC_ERROR_INPUT, error.what());
    } catch (const UsageError& error) {
      return failed(HAPTIC_ERROR_INPUT, error.what());
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::runtime_error& error) {
      return failed(HAPTIC_ERROR_SYSTEM, error.what());
    } catch (const std::exception& error) {
      return failed(HAPTIC_ERROR_INTERNAL, error.what());
    }
    *compiled = out.release();
    return int{HAPTIC_OK};
  });
}

int haptic_compiled_bytes(const haptic_compiled* compiled, const void** bytes, size_t* count) {
  if (bytes == nullptr || count == nullptr) return HAPTIC_ERROR_NULL;
  *bytes = nullptr;
  *count = 0;
  if (const int error = check_handle(compiled); error != HAPTIC_OK) return error;
  if (!compiled->bytes) return HAPTIC_ERROR_SIZE;
  *bytes = compiled->bytes->span().data();
  *count = compiled->bytes->span().size();
  return HAPTIC_OK;
}

int haptic_compiled_message_count(const haptic_compiled* compiled, size_t* count) {
  if (count == nullptr) return HAPTIC_ERROR_NULL;
  *count = 0;
  if (const int error = check_handle(compiled); error != HAPTIC_OK) return error;
  *count = compiled->messages.size();
  return HAPTIC_OK;
}

int haptic_compiled_message(const haptic_compiled* compiled, size_t index,
                            haptic_message* message) {
  if (const int error = check_structure(message); error != HAPTIC_OK) return error;
  *message = HAPTIC_MESSAGE_INIT;
  if (const int error = check_handle(compiled); error != HAPTIC_OK) return error;
  if (index >= compiled->messages.size()) return HAPTIC_ERROR_NUMBER;
  const MessageRecord& record = compiled->messages[index];
  message->severity = record.severity;
  message->file = record.file.c_str();
  message->place = record.place.c_str();
  message->cause = record.cause.c_str();
  message->remedy = record.remedy.c_str();
  message->text = record.text.c_str();
  return HAPTIC_OK;
}

int haptic_compiled_free(haptic_compiled** compiled) {
  if (compiled == nullptr) return HAPTIC_ERROR_NULL;
  if (*compiled == nullptr) return HAPTIC_OK;
  if (const int error = check_handle(*compiled); error != HAPTIC_OK) return error;
  (*compiled)->magic = 0;
  delete *compiled;
  *compiled = nullptr;
  return HAPTIC_OK;
}
