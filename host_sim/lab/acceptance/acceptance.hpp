// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Does the compiler take a mesh, is what it says of it true, and can it be felt? Every mesh is
/// compiled as the part in the hand, next to a box, moved through free air and pressed against the
/// box (pressed_pair.hpp), in a process of its own with limits: a crash or a run without end is a
/// finding and ends nothing.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/lab/acceptance/mesh_damage.hpp"
#include "host_sim/lab/acceptance/pressed_pair.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/limited_child.hpp"

namespace haptic::sim {

enum class Outcome : std::uint8_t { kSolid, kSurface, kRefused, kCrashed, kUnended };
[[nodiscard]] const char* to_text(Outcome outcome);

/// What became of one mesh.
struct Acceptance {
  std::string mesh;
  MeshDamage damage = MeshDamage::kNone;
  std::uint64_t seed = 0;
  Outcome outcome = Outcome::kCrashed;
  std::string said;  ///< the reason for solid or surface, or the refusal
  std::size_t triangles = 0, pieces = 0;
  std::uint64_t scene_bytes = 0, state_bytes = 0, memory_bytes = 0;  ///< memory: of the process
  double seconds = 0.0;
  std::string untrue;  ///< what is wrong with what was said; empty: nothing
  PressedPair felt;    ///< of an accepted mesh

  [[nodiscard]] bool accepted() const {
    return outcome == Outcome::kSolid || outcome == Outcome::kSurface;
  }
  [[nodiscard]] bool failed() const {
    return outcome == Outcome::kCrashed || outcome == Outcome::kUnended || !untrue.empty() ||
           !felt.fault.empty();
  }
};

/// Of the process of one mesh.
inline constexpr tools::ChildLimits kAcceptanceLimits{120, std::uint64_t{8} << 30};

/// What the compiler said of a mesh, as the judge sees it.
struct Statement {
  Outcome outcome = Outcome::kRefused;
  std::string said;
  double volume_m3 = 0.0;      ///< of a solid
  bool proven = true;          ///< of a solid: its certificate holds
  std::size_t open_edges = 0;  ///< of a surface
};

/// The defect of a statement, empty where it is true. `good`: the mesh before the damage.
[[nodiscard]] std::string defect_of(const Statement& statement, MeshDamage damage,
                                    const MeshFacts& given, const MeshFacts& good);

/// A mesh file in `scale_to_m` (where the file has no unit).
[[nodiscard]] Acceptance accept_file(const std::string& path, double scale_to_m,
                                     const tools::ChildLimits& limits);
[[nodiscard]] Acceptance accept_damaged(const tools::RawMesh& good, MeshDamage damage,
                                        std::uint64_t seed, const tools::ChildLimits& limits);

struct AcceptanceSize {
  std::string folder;  ///< of mesh files; empty: the good meshes of our own
  double scale_to_m = 1.0;
  std::uint32_t damaged = 100;  ///< damaged meshes, by turns of all kinds and good meshes
  std::uint64_t seed = 1;
  tools::ChildLimits limits = kAcceptanceLimits;
  bool progress = false;  ///< lines on stderr, of run_shards
};

struct AcceptanceResult {
  AcceptanceSize size;
  std::vector<Acceptance> whole;     ///< files, or good meshes
  std::vector<Acceptance> damaged;   ///< of good meshes
  std::vector<std::string> skipped;  ///< files in the folder that are no meshes
  [[nodiscard]] std::size_t failures() const;
  /// Of all meshes: taken by the compiler, and of these without force in the air and with one on
  /// the press.
  [[nodiscard]] std::size_t accepted() const;
  [[nodiscard]] std::size_t felt() const;
};

/// @throws tools::InputError  the folder cannot be read or holds no mesh.
[[nodiscard]] AcceptanceResult run_acceptance(const AcceptanceSize& size);

/// Lines for people: a mesh each, and a table of the damage.
[[nodiscard]] std::string acceptance_page(const AcceptanceResult& result);
/// accept.csv, accept.json, accept.md.
[[nodiscard]] std::vector<OutputText> acceptance_files(const AcceptanceResult& result);

}  // namespace haptic::sim
