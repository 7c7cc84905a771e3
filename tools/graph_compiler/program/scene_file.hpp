// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scene file (TOML, format 1): which meshes, where they stand, how contact is rendered.
/// README.md lists the keys.

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/common/file_place.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::tools {

/// One `[[friction]]` table: Coulomb coefficient between two materials, in either order.
struct FrictionPair {
  std::array<std::string, 2> materials;
  double mu = 0.0;         ///< while they slide
  double mu_static = 0.0;  ///< while they stick, at least mu
  FilePlace at{};          ///< of `materials`

  [[nodiscard]] bool is_of(const std::string& a, const std::string& b) const {
    return (materials[0] == a && materials[1] == b) || (materials[0] == b && materials[1] == a);
  }
};

/// Coefficients of two materials; absent when the table does not know the pair or a name is empty.
std::optional<FrictionPair> friction_of(const std::vector<FrictionPair>& pairs,
                                        const std::string& a, const std::string& b);

/// The kind to which a part is compiled.
enum class PartKind : std::uint8_t {
  kAny,      ///< a solid where the mesh allows it, a surface otherwise
  kSolid,    ///< exact convex pieces, or refused
  kSurface,  ///< flat convex facets
};

/// Without a newer pose a driven part is late after this, where the scene does not say [s].
inline constexpr double kDefaultLate_s = 0.1;

/// A part that its owner moves: how fast, and how hard it pushes.
struct DrivenRequest {
  double fastest_m_per_s = 0.0, fastest_rad_per_s = 0.0;  ///< > 0
  double late_s = kDefaultLate_s;
  std::optional<double> push_n;  ///< absent: by the largest pull of the hand's spring
  FilePlace push_at{};           ///< of push_n
};

/// A part that others push: its anchor holds so much, or it has a weight; absent: an anchor of
/// kDefaultYield_n.
struct LooseRequest {
  std::optional<double> yield_n, weight_n;
  double fall_m_per_s = 0.5;  ///< at which a weight lets it sink
};
inline constexpr double kDefaultYield_n = 0.5;

/// One `[moving]`, `[[static]]` or `[[part]]` table.
struct ScenePart {
  std::string name;                           ///< of a `[[part]]`; empty: another table
  PartRole role = PartRole::kFixed;           ///< the same
  std::string mesh;                           ///< as written; of a shape its word
  std::filesystem::path path;                 ///< resolved against the scene file's folder
  std::optional<Shape> shape;                 ///< instead of a file
  std::optional<std::string> link;            ///< of the robot description `path`
  LinkFrame link_frame = LinkFrame::kLink;    ///< in which its mesh is
  std::optional<std::string> node;            ///< of the mesh file `path`; absent: all of it
  std::optional<FilePlace> scale_at;          ///< of scale_to_m, where it is given
  std::shared_ptr<const RawMesh> given;       ///< the mesh itself, instead of the file at `path`
  std::array<double, 3> scale_to_m{1, 1, 1};  ///< metres per file unit
  std::array<double, 3> position_m{0, 0, 0};  ///< of the mesh frame in W; moving part: start pose
  std::array<double, 4> quaternion_wxyz{1, 0, 0, 0};
  std::string material;                ///< of the friction table; empty: none named
  std::optional<double> deflection_m;  ///< of STEP, see ImportOptions
  std::optional<double> tolerance_m;   ///< the part is simplified within
  bool disjoint = false;               ///< solids that overlap are cut apart
  PartKind kind = PartKind::kAny;      ///< `as`
  /// For a part that the hand may hold: its grip in its mesh frame, absent: the centre of volume;
  /// and the mass that the hand is to feel.
  std::optional<std::array<double, 3>> grip_m;
  HeldPartParameters held{};
  DrivenRequest driven{};          ///< for a part with role "driven"
  LooseRequest loose{};            ///< for a part with role "loose"
  std::vector<std::string> notes;  ///< what was taken otherwise than it stands in the file
};

/// A limit of `[budget]` with its place in the file, for the message when it is exceeded.
struct BudgetLimit {
  std::uint64_t bytes = 0;
  std::uint32_t line = 0, column = 0;
};

struct SceneBudget {
  std::optional<BudgetLimit> constants, state, stack;
  std::optional<std::uint32_t> pair_visits;  ///< pairs that a tick may search
  std::optional<std::uint32_t> near_pairs;   ///< pairs near the part that a tick may follow
};

/// `[guide]`: a plan that leads the hand. Absent numbers are chosen by make_guide.
struct SceneGuide {
  std::filesystem::path plan;  ///< resolved against the scene file's folder
  std::optional<double> pull_n, hold_n, let_go_m, ramp_s;
};

/// One `[[stage]]`: a part is brought to its goal, while those of earlier stages are at theirs.
struct SceneStage {
  std::string part;                           ///< its name
  std::array<double, 3> position_m{0, 0, 0};  ///< of its mesh frame in W
  std::array<double, 4> quaternion_wxyz{1, 0, 0, 0};
  std::optional<SceneGuide> guide;  ///< with `plan`: leads the hand while it holds the part
  FilePlace at{};
};

struct SceneFile {
  std::string file;  ///< for messages
  std::string name;
  ScenePart moving;                ///< of `[[part]]` tables the one with role "hand"
  std::vector<ScenePart> statics;  ///< of these the others, in their order
  /// Names of parts that never meet: no pair of theirs is compiled.
  std::vector<std::array<std::string, 2>> never;
  SceneParameters parameters =
      default_parameters();  ///< start pose and name are filled by the scene writer, the
                             ///< coupling by choose_coupling
  CouplingRequest coupling;
  std::vector<FrictionPair> friction;
  std::optional<OrientationEnvelope> orientation;  ///< absent: every orientation
  std::optional<WorkspaceBox> workspace;           ///< of the grip point; absent: every place
  std::optional<double> plane_tolerance_m;
  std::optional<std::uint64_t> graph_bytes;  ///< room for stored contact graphs
  SceneBudget budget;
  std::optional<SceneGuide> guide;
  std::vector<SceneStage> stages;  ///< in the order of the assembly
  /// The parts are given where they are in the end: these places are the goals of their stages, and
  /// the compiler lays them beside each other.
  bool assembled = false;
  /// Values that are hardly meant so, each a sentence with its place.
  std::vector<std::string> warnings;

  /// The hand may hold its parts one after another.
  [[nodiscard]] bool has_parts() const { return !moving.name.empty(); }
  /// Two hands hold the moving part and the first static one all the time.
  [[nodiscard]] bool has_second_hand() const {
    return !statics.empty() && statics[0].role == PartRole::kHand2;
  }
  [[nodiscard]] bool never_turns() const {
    return orientation && !(orientation->max_angle_rad > 0.0);
  }
};

/// Part number 0 is the moving one of the file, number k its static part k - 1.
const ScenePart& numbered_part(const SceneFile& scene, std::size_t part);

/// Numbers of the parts that `part` may meet, driven ones too, in their order.
std::vector<std::size_t> parts_met(const SceneFile& scene, std::size_t part);

/// Numbers of the parts that stand in the scene in which `part` is held, in their order: those that
/// it may meet and that neither an owner nor another hand moves; where there are none, all that it
/// may meet.
std::vector<std::size_t> parts_standing(const SceneFile& scene, std::size_t part);

/// The scene in which `part` is held and `others` stand.
SceneFile scene_holding(const SceneFile& scene, std::size_t part,
                        const std::vector<std::size_t>& others);

/// Largest scene file that is read [bytes].
inline constexpr std::size_t kMaxSceneFileBytes = std::size_t{1} << 20;

/// Reads and checks a scene file; meshes are not opened, but must exist.
/// @throws InputError "scene.toml:LINE:COLUMN: defect; fix", columns counted in characters from 1.
SceneFile read_scene_file(const std::filesystem::path& path);

/// The same from text; mesh paths count from `folder`.
SceneFile parse_scene_file(std::string_view text, const std::string& file,
                           const std::filesystem::path& folder);

}  // namespace haptic::tools
