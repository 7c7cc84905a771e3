// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/acceptance/acceptance.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "host_sim/report/shard_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/limited_child.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/part_mesh.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;
using tools::ChildEnd;
using tools::ChildResult;
using tools::formatted;
using tools::RawMesh;

/// Of the size of the mesh: the box beside it, and its distance.
constexpr double kBoxShare = 0.2;

/// The mesh as the part in the hand, above it a box.
tools::SceneFile scene_around(std::shared_ptr<const RawMesh> mesh, const std::string& name,
                              const std::array<double, 3>& scale_to_m) {
  double high = 0.0, largest = 0.0;
  for (const tools::Point3& p : mesh->vertices) {
    high = std::max(high, p[2] * scale_to_m[2]);
    for (std::size_t k = 0; k < 3; ++k) largest = std::max(largest, std::abs(p[k]) * scale_to_m[k]);
  }
  if (!(std::isfinite(largest) && largest > 0.0)) largest = 1.0;
  const double edge = kBoxShare * largest;
  const double at = std::isfinite(high) ? high + 1.5 * edge : edge;
  const std::string text = formatted(
      "format = 1\nname = \"accept\"\n[moving]\nshape = \"box\"\nsize_m = [1, 1, 1]\n"
      "[[static]]\nshape = \"box\"\nsize_m = [%.17g, %.17g, %.17g]\nposition_m = [0, 0, %.17g]\n"
      "[rendering]\nk_f_n_per_m = 800\n",
      edge, edge, edge, at);
  tools::SceneFile scene = tools::parse_scene_file(text, name, ".");
  scene.moving.shape.reset();
  scene.moving.mesh = name;
  scene.moving.path = mesh->file;
  scene.moving.given = std::move(mesh);
  scene.moving.scale_to_m = scale_to_m;
  return scene;
}

Json statement_json(const Statement& said) {
  return {{"outcome", static_cast<int>(said.outcome)},
          {"said", said.said},
          {"volume_m3", said.volume_m3},
          {"proven", said.proven},
          {"open_edges", said.open_edges}};
}

Json facts_json(const MeshFacts& facts) {
  return {{"triangles", facts.triangles},
          {"with_area", facts.with_area},
          {"open_edges", facts.open_edges},
          {"not_finite", facts.not_finite}};
}

MeshFacts facts_of_json(const Json& json) {
  MeshFacts facts;
  facts.triangles = json["triangles"].get<std::size_t>();
  facts.with_area = json["with_area"].get<std::size_t>();
  facts.open_edges = json["open_edges"].get<std::size_t>();
  facts.not_finite = json["not_finite"].get<std::size_t>();
  return facts;
}

/// What the child writes.
Json compiled_json(const RawMesh& mesh, const std::string& name,
                   const std::array<double, 3>& scale_to_m) {
  Json out;
  Statement said;
  try {
    const tools::CompiledScene compiled = tools::compile_scene(
        scene_around(std::make_shared<const RawMesh>(mesh), name, scale_to_m), {});
    const tools::PartReport& part = compiled.parts[0];
    said.outcome = part.is_surface() ? Outcome::kSurface : Outcome::kSolid;
    said.said = part.reason;
    said.volume_m3 = part.volume_m3;
    said.proven = part.is_surface() || part.certificate.holds();
    if (part.surface) said.open_edges = part.surface->open_edges;
    out["pieces"] = part.is_surface() ? part.surface->facets : part.pieces.size();
    out["scene_bytes"] = compiled.bytes.size();
    const tools::SceneBytes aligned{compiled.bytes};
    SceneView view;
    said.proven = said.proven && SceneView::open(aligned.span(), view) == RtStatus::kOk;
    out["state_bytes"] = view.header().capacity.state_bytes;
    const PressedPair felt = press_pair(aligned.span(), name);
    out["felt"] = {{"air_n", felt.air_force_n},
                   {"press_n", felt.press_force_n},
                   {"touched", felt.touched},
                   {"fault", felt.fault}};
  } catch (const tools::InputError& error) {
    said.outcome = Outcome::kRefused;
    said.said = error.what();
  }
  out.update(statement_json(said));
  return out;
}

ChildResult run_apart(const std::string& mesh, const tools::ChildLimits& limits,
                      const std::function<Json()>& work) {
  return tools::run_in_child(
      mesh, limits, [&] { return work().dump(-1, ' ', false, Json::error_handler_t::replace); });
}

/// What a child says that has not answered.
std::string end_text(const ChildResult& end) {
  switch (end.end) {
    case ChildEnd::kSignal:
      return ::strsignal(end.number);
    case ChildEnd::kThrew:
      return end.text;
    case ChildEnd::kOutOfTime:
      return "more time than allowed";
    case ChildEnd::kOutOfMemory:
      return "more memory than allowed";
    default:
      return "no answer";
  }
}

void judge(const ChildResult& end, const MeshFacts& given, const MeshFacts& good, Acceptance& out) {
  out.memory_bytes = end.memory_bytes;
  const Json json = end.end == ChildEnd::kAnswered ? Json::parse(end.text, nullptr, false) : Json();
  if (!json.is_object()) {
    out.outcome = end.end == ChildEnd::kOutOfTime ? Outcome::kUnended : Outcome::kCrashed;
    out.said = end_text(end);
    return;
  }
  Statement said;
  said.outcome = static_cast<Outcome>(json["outcome"].get<int>());
  said.said = json["said"].get<std::string>();
  said.volume_m3 = json["volume_m3"].get<double>();
  said.proven = json["proven"].get<bool>();
  said.open_edges = json["open_edges"].get<std::size_t>();
  out.outcome = said.outcome;
  out.said = said.said;
  out.pieces = json.value("pieces", std::size_t{0});
  out.scene_bytes = json.value("scene_bytes", std::uint64_t{0});
  out.state_bytes = json.value("state_bytes", std::uint64_t{0});
  if (json.contains("felt")) {
    const Json& felt = json["felt"];
    out.felt = {felt["air_n"].get<double>(), felt["press_n"].get<double>(),
                felt["touched"].get<bool>(), felt["fault"].get<std::string>()};
  }
  out.untrue = defect_of(said, out.damage, given, good);
}

class Clock {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

bool is_mesh_file(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  return tools::import_format_of(path) ||
         std::ranges::any_of(std::array{".obj", ".stl", ".off", ".ply"}, [&](const char* known) {
           return tools::equals_lower(extension, known);
         });
}

std::vector<std::string> mesh_files(const std::string& folder, std::vector<std::string>& skipped) {
  std::vector<std::string> files;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
       at.increment(error)) {
    if (!at->is_regular_file()) continue;
    (is_mesh_file(at->path()) ? files : skipped).push_back(at->path().string());
  }
  if (error) {
    throw tools::InputError(folder + ": the folder cannot be read (" + error.message() +
                            "); check the path");
  }
  if (files.empty()) {
    throw tools::InputError(folder + ": no mesh in the folder; give one with mesh files");
  }
  std::ranges::sort(files);
  std::ranges::sort(skipped);
  return files;
}

std::string csv_of(const AcceptanceResult& result) {
  ReportTable table(
      "mesh,damage,seed,outcome,triangles,pieces,seconds,scene_bytes,state_bytes,memory_bytes,"
      "air_n,press_n,touched,untrue,felt,said");
  for (const auto* list : {&result.whole, &result.damaged}) {
    for (const Acceptance& a : *list) {
      std::string said = a.said;
      std::ranges::replace(said, '"', '\'');
      table.add({quoted(a.mesh), to_text(a.damage), a.seed, to_text(a.outcome), a.triangles,
                 a.pieces, shown_as("%.3f", a.seconds), a.scene_bytes, a.state_bytes,
                 a.memory_bytes, shown_as("%.3g", a.felt.air_force_n),
                 shown_as("%.3g", a.felt.press_force_n), a.felt.touched, quoted(a.untrue),
                 quoted(a.felt.fault), sim::quoted(said)});
    }
  }
  return table.csv();
}

std::string json_of(const AcceptanceResult& result) {
  const auto list = [](const std::vector<Acceptance>& rows) {
    Json all = Json::array();
    for (const Acceptance& a : rows) {
      all.push_back({{"mesh", a.mesh},
                     {"damage", to_text(a.damage)},
                     {"seed", a.seed},
                     {"outcome", to_text(a.outcome)},
                     {"triangles", a.triangles},
                     {"pieces", a.pieces},
                     {"seconds", a.seconds},
                     {"scene_bytes", a.scene_bytes},
                     {"state_bytes", a.state_bytes},
                     {"memory_bytes", a.memory_bytes},
                     {"air_n", a.felt.air_force_n},
                     {"press_n", a.felt.press_force_n},
                     {"touched", a.felt.touched},
                     {"felt", a.felt.fault},
                     {"untrue", a.untrue},
                     {"said", a.said}});
    }
    return all;
  };
  const Json json = {{"meshes", list(result.whole)},
                     {"damaged", list(result.damaged)},
                     {"skipped", result.skipped},
                     {"seed", result.size.seed}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

const char* to_text(Outcome outcome) {
  constexpr const char* kWords[] = {"solid", "surface", "refused", "crashed", "not ended"};
  return kWords[static_cast<std::size_t>(outcome)];
}

std::string defect_of(const Statement& statement, MeshDamage damage, const MeshFacts& given,
                      const MeshFacts& good) {
  const auto says = [&](const char* words) {
    return statement.said.find(words) != std::string::npos;
  };
  switch (statement.outcome) {
    case Outcome::kSolid: {
      if (!statement.proven) return "its certificate does not hold";
      const double difference = std::abs(statement.volume_m3 - std::abs(good.volume));
      // Noise and cracks that are closed move the surface by some of the plane tolerance.
      if (damage != MeshDamage::kNone && difference > 2e-2 * std::abs(good.volume)) {
        return formatted("its volume is %.4g m3, that of the good mesh %.4g m3",
                         statement.volume_m3, std::abs(good.volume));
      }
      if (damage == MeshDamage::kHoles) return "closed, but faces were taken out";
      return "";
    }
    case Outcome::kSurface: {
      if (statement.open_edges > 0 && given.open_edges == 0) {
        return formatted("%zu open edges, but there are none", statement.open_edges);
      }
      const bool exact = damage == MeshDamage::kHoles || damage == MeshDamage::kDuplicates ||
                         damage == MeshDamage::kFlips;
      if (exact && statement.open_edges != given.open_edges) {
        return formatted("%zu open edges, but there are %zu", statement.open_edges,
                         given.open_edges);
      }
      return "";
    }
    case Outcome::kRefused:
      if (!says("; ")) return "a refusal without a way to fix it";
      if (says("no face") || says("holds no")) {
        return given.triangles == 0 ? "" : "there are faces";
      }
      if (says("no triangle has an area")) return given.with_area == 0 ? "" : "there is an area";
      if (says("not finite")) return given.not_finite > 0 ? "" : "all numbers are finite";
      return "a refusal that is not known here";
    default:
      return "";
  }
}

std::size_t AcceptanceResult::failures() const {
  const auto of = [](const std::vector<Acceptance>& list) {
    return static_cast<std::size_t>(
        std::ranges::count_if(list, [](const Acceptance& a) { return a.failed(); }));
  };
  return of(whole) + of(damaged);
}

std::size_t AcceptanceResult::accepted() const {
  const auto of = [](const std::vector<Acceptance>& list) {
    return static_cast<std::size_t>(
        std::ranges::count_if(list, [](const Acceptance& a) { return a.accepted(); }));
  };
  return of(whole) + of(damaged);
}

std::size_t AcceptanceResult::felt() const {
  const auto of = [](const std::vector<Acceptance>& list) {
    return static_cast<std::size_t>(std::ranges::count_if(
        list, [](const Acceptance& a) { return a.accepted() && a.felt.fault.empty(); }));
  };
  return of(whole) + of(damaged);
}

Acceptance accept_file(const std::string& path, double scale_to_m,
                       const tools::ChildLimits& limits) {
  Acceptance result;
  result.mesh = std::filesystem::path(path).filename().string();
  tools::ScenePart part;
  part.mesh = result.mesh;
  part.path = path;
  part.scale_to_m = {scale_to_m, scale_to_m, scale_to_m};
  const Clock clock;
  // The judge's own view of the file comes from the child too: reading may crash.
  const ChildResult end = run_apart(result.mesh, limits, [&] {
    try {
      const tools::PartMesh source = tools::read_part_mesh(part, result.mesh);
      Json json = compiled_json(source.mesh, result.mesh, source.scale_to_m);
      json["given"] = facts_json(facts_of(source.mesh));
      return json;
    } catch (const tools::InputError& error) {
      return statement_json({.outcome = Outcome::kRefused, .said = error.what()});
    }
  });
  result.seconds = clock.seconds();
  const Json json = Json::parse(end.text, nullptr, false);
  MeshFacts facts;
  if (json.is_object() && json.contains("given")) facts = facts_of_json(json["given"]);
  result.triangles = facts.triangles;
  judge(end, facts, facts, result);
  return result;
}

Acceptance accept_damaged(const RawMesh& good, MeshDamage damage, std::uint64_t seed,
                          const tools::ChildLimits& limits) {
  Acceptance result;
  result.mesh = good.file;
  result.damage = damage;
  result.seed = seed;
  const RawMesh mesh = damaged(good, damage, seed);
  const Clock clock;
  const ChildResult end = run_apart(result.mesh, limits, [&] {
    return compiled_json(mesh, mesh.file, {1.0, 1.0, 1.0});
  });
  result.seconds = clock.seconds();
  const MeshFacts facts = facts_of(mesh);
  result.triangles = facts.triangles;
  judge(end, facts, facts_of(good), result);
  return result;
}

AcceptanceResult run_acceptance(const AcceptanceSize& size) {
  AcceptanceResult result;
  result.size = size;
  // One thread: every mesh is compiled in a process that is forked from this one.
  const RunOptions options{1, size.progress};
  const auto run = [&](std::vector<Acceptance>& list, std::size_t count, const char* name,
                       const std::function<Acceptance(std::size_t)>& accept) {
    list.resize(count);
    run_shards(
        count, options, name, [] { return 0; }, [&](int, std::size_t k) { list[k] = accept(k); });
  };
  const std::vector<RawMesh> good = good_meshes();
  if (size.folder.empty()) {
    run(result.whole, good.size(), "meshes",
        [&](std::size_t k) { return accept_damaged(good[k], MeshDamage::kNone, 0, size.limits); });
  } else {
    const std::vector<std::string> files = mesh_files(size.folder, result.skipped);
    run(result.whole, files.size(), "meshes",
        [&](std::size_t k) { return accept_file(files[k], size.scale_to_m, size.limits); });
  }
  constexpr std::uint32_t kKinds = kMeshDamages - 1;
  run(result.damaged, size.damaged, "damaged meshes", [&](std::size_t k) {
    return accept_damaged(good[k / kKinds % good.size()], static_cast<MeshDamage>(1 + k % kKinds),
                          seed_of(size.seed, k), size.limits);
  });
  return result;
}

std::string acceptance_page(const AcceptanceResult& result) {
  std::string text = table_head({"mesh", "compiled as", "triangles", "pieces", "s", "scene MB",
                                 "state MB", "memory MB", "air N", "press N", "because"});
  const auto megabytes = [](std::uint64_t bytes) {
    return formatted("%.2f", 1e-6 * static_cast<double>(bytes));
  };
  for (const Acceptance& a : result.whole) {
    text += table_row(
        {a.mesh, to_text(a.outcome), std::to_string(a.triangles), std::to_string(a.pieces),
         formatted("%.2f", a.seconds), megabytes(a.scene_bytes), megabytes(a.state_bytes),
         megabytes(a.memory_bytes), a.accepted() ? formatted("%.3g", a.felt.air_force_n) : "",
         a.accepted() ? formatted("%.3g", a.felt.press_force_n) : "", a.said});
  }
  const auto accepted = static_cast<std::size_t>(
      std::ranges::count_if(result.whole, [](const Acceptance& a) { return a.accepted(); }));
  tools::append_line(text, "\n%zu of %zu meshes accepted\n", accepted, result.whole.size());
  if (!result.damaged.empty()) {
    text += table_head({"damage", "meshes", "solid", "surface", "refused", "crashed", "not ended",
                        "untrue", "longest s"});
    for (std::uint32_t kind = 1; kind < kMeshDamages; ++kind) {
      std::array<std::size_t, 5> outcomes{};
      std::size_t count = 0, untrue = 0;
      double longest = 0.0;
      for (const Acceptance& a : result.damaged) {
        if (a.damage != static_cast<MeshDamage>(kind)) continue;
        ++count;
        ++outcomes[static_cast<std::size_t>(a.outcome)];
        untrue += a.untrue.empty() ? 0u : 1u;
        longest = std::max(longest, a.seconds);
      }
      std::vector<std::string> cells{to_text(static_cast<MeshDamage>(kind)), std::to_string(count)};
      for (const std::size_t n : outcomes) cells.push_back(std::to_string(n));
      cells.push_back(std::to_string(untrue));
      cells.push_back(formatted("%.2f", longest));
      text += table_row(cells);
    }
    text += "\n";
  }
  for (const auto* list : {&result.whole, &result.damaged}) {
    for (const Acceptance& a : *list) {
      if (!a.failed()) continue;
      tools::append_line(text, "FAILED %s, %s, seed %llu: %s: %s%s%s%s%s", a.mesh.c_str(),
                         to_text(a.damage), static_cast<unsigned long long>(a.seed),
                         to_text(a.outcome), a.said.c_str(),
                         a.untrue.empty() ? "" : ": untrue: ", a.untrue.c_str(),
                         a.felt.fault.empty() ? "" : ": felt: ", a.felt.fault.c_str());
    }
  }
  const std::size_t failures = result.failures();
  if (failures > 0)
    text += formatted("FAILED: %zu of %zu meshes; ", failures,
                      result.whole.size() + result.damaged.size());
  tools::append_line(text,
                     "%zu of %zu accepted pairs: no force over %.3g mm of free air, and a force on "
                     "the press",
                     result.felt(), result.accepted(), 1e3 * kAirWay_m);
  return text;
}

std::vector<OutputText> acceptance_files(const AcceptanceResult& result) {
  return {{"accept.csv", csv_of(result)},
          {"accept.json", json_of(result)},
          {"accept.md", acceptance_page(result)}};
}

}  // namespace haptic::sim
