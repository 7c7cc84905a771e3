// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One scene and one core for a page: what goes in, what comes out of a tick, and the geometry that
/// is drawn. The page reads the structures below by the layout that this module states itself
/// (layout_text), so no offset is written down twice.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "tools/c_space/c_obstacle.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/live/driven_tick.hpp"
#include "tools/plan/guide_legs.hpp"
#include "tools/verdict/session_judge.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::sim {

/// Input of one tick. Poses are of A's mesh frame in W.
struct ViewInput {
  double p_wa_m[3] = {};
  double q_wa_xyzw[4] = {0, 0, 0, 1};
  double twist_w[6] = {};     ///< at the grip point, m/s and rad/s; used where twist_valid is not 0
  double accepted_w[6] = {};  ///< StepInput::accepted_wrench_w; used where accepted_valid is not 0
  std::int64_t stamp_ns = 0;
  std::uint64_t sequence = 0;
  std::uint32_t twist_valid = 0, accepted_valid = 0, clutched = 0, switches = 0;
  std::uint32_t report_goal_contact = 0;  ///< StepInput::report_goal_contact
};

/// Facts about the scene.
struct ViewScene {
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0, k_f_n_per_m = 0;
  double damping_ns_per_m = 0;  ///< of the coupling; in rotation times k_r / k_t
  double start_p_wa_m[3] = {}, start_q_wa_xyzw[4] = {};
  double grip_a_m[3] = {};  ///< in A's mesh frame
  double rate_hz = 0, epsilon_m = 0, max_force_n = 0, max_torque_nm = 0;
  std::uint64_t content_hash = 0, state_bytes = 0;
  std::uint32_t law = 0, piece_count = 0, pair_count = 0, body_count = 0;
  /// The budget of work, after which a tick begins nothing more; and the bound of a tick's work,
  /// with what it may have begun then.
  std::uint32_t work_units = 0, max_work_units = 0;
  std::uint32_t scalar_bytes = 0;
  std::uint32_t hands = 1;
  double second_grip_m[3] = {};  ///< of the part of a second hand, in its mesh frame
};

/// A pose that the owner of a driven part gives it, or that of a second hand.
struct ViewDrive {
  FrameRecord record;
  std::uint64_t driven = 0;  ///< number of the mover (tools/common/movers.hpp)
};

/// Lists of an answer; each function below says what it puts there.
struct ViewAnswer {
  std::vector<double> numbers;
  std::vector<std::uint32_t> counts;
  std::string text;
  void clear() {
    numbers.clear();
    counts.clear();
    text.clear();
  }
};

/// Kind of a C-obstacle's face: type of its basic contacts, or kSeveralTypes where faces or edges
/// are parallel and contacts of different types share the plane.
inline constexpr std::uint32_t kSeveralTypes = 3;
/// How a face of a C-obstacle stands to the part.
enum class FaceRole : std::uint32_t {
  kOther = 0,
  kNear,  ///< one of its nodes is in the near set of the goal pose
  kHolds  ///< its plane holds the part that is felt
};

/// No body, pair or node.
inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;
/// Normals of one plane by two computations: far above rounding, far below an angle one can see.
inline constexpr double kSameNormal = HAPTIC_REAL_IS_FLOAT ? 1.0e-4 : 1.0e-6;

/// How a node of the graph stands to the part.
enum class GraphRole : std::uint32_t {
  kNeighbor = 0,  ///< next to one of the others
  kNear,          ///< in the near set of the goal pose
  kHolds          ///< its plane holds the part that is felt
};

/// Results of ViewCore::hold.
inline constexpr std::uint32_t kHoldRefused = 0, kHoldWaits = 1, kHoldTakes = 2;

class ViewCore {
 public:
  /// Takes `scene`, which must stay where it is. @return as SceneView::open, HapticCore::create.
  [[nodiscard]] RtStatus open(std::span<const std::byte> scene);

  /// One tick of `input` into `result`. Only after kOk of open().
  void step();
  /// `drive` is the newest pose of its mover from now on: of a driven part, or, as the second hand
  /// leads it, of that one's part.
  void give();
  /// One tick of the driven parts, before each step of a scene that has them: they follow the poses
  /// that they were given; those that were given none stay where they are (PartHand::follow).
  void follow(std::int64_t now_ns, bool is_felt);
  /// A fresh start; of a scene with parts with each of them where it starts.
  void reset();
  /// The hand lets go of what it holds, and then takes `part`. kHoldWaits: step on, and ask again.
  /// kHoldTakes: the next step takes it; numbers: the input's pose that leads it where it is.
  [[nodiscard]] std::uint32_t hold(std::uint32_t part);
  void release();
  /// The verdict begins with the next tick.
  void begin_verdict() noexcept { judge_.reset(); }

  /// All mutable memory of the core, in pieces: a copy put back later in its place continues from
  /// there. Of a scene with driven parts also that of the hand and of their law.
  [[nodiscard]] std::span<const std::span<std::byte>> state() const noexcept {
    return state_pieces_;
  }

  // The answers that follow replace the one before.

  /// text: names of the parts that the hand may hold or that stand, a line each; counts: the one
  /// that is held (0xFFFFFFFF: none), the one that is shown as body 0, for each whether it may be
  /// held, then the parts that are shown as bodies 1, 2, ... Empty: the scene has one moving part.
  void describe_parts();
  /// text: name, law, name of each body, a line each.
  void describe_scene();
  /// For each piece: counts body, vertices, faces, then for each face its mesh face (0xFFFFFFFF: a
  /// cut made it), corners and their vertices; numbers its vertices, of the part in A's axes about
  /// the grip point, of others in W [m].
  void describe_pieces();
  /// For each mover counts 1 where it touches the part that is held, and 1 where its stream
  /// is lost; numbers its DrivenTick; text: names, a line each. Empty: the scene has none.
  void describe_driven();
  /// As describe_pieces, with the number of the driven part in place of the body and vertices about
  /// its mesh frame.
  void describe_driven_pieces();
  /// text: where on the plan of the guide the part is and which contact comes next
  /// (tools/plan/guide_legs.hpp); empty where the scene has no guide.
  void describe_guide();
  /// text: the judgement of the ticks since begin_verdict, as host_sim ends with it; counts: 1 if
  /// it is a failure, else 0.
  void describe_verdict();
  /// C-obstacles at the orientation in which the part is felt, of the pairs that hold it first,
  /// then of the nearest by the search at the goal pose, or, where none is searched, by their
  /// distance; of at most `most_pairs` pairs with at most `most_nodes` basic contacts each. Behind
  /// them the same of the movers, where both are felt: of those that the part touches and of the
  /// nearest. counts: obstacles, pairs of what stands left out; for each obstacle pair (of a mover
  /// 0xFFFFFFFF), body (of a mover the number of bodies and its own), faces; for each face kind (A,
  /// B, C: 0, 1, 2; kSeveralTypes), FaceRole, whether it is hidden, its first near or holding node
  /// (0xFFFFFFFF: none), number of nodes, corners; numbers: the corners in W [m]: positions of the
  /// grip point.
  void describe_obstacles(std::uint32_t most_pairs, std::uint32_t most_nodes);
  /// Contacts of the pairs that hold the part, or of the nearest pair under laws that have no such
  /// planes. counts: contacts; for each body, situation, corners, basic contacts; for each of the
  /// latter type, then of A and of B: kind (vertex, edge, face: 0, 1, 2) and two numbers of the
  /// user's mesh (0xFFFFFFFF: made by a cut). numbers: normal, then corners of the polygon, in W.
  void describe_contacts();
  /// The contact graph round the active pair: that of the first plane that holds the part, else the
  /// nearest as in describe_obstacles. counts: pair, body of B, nodes, arcs, how often a node was
  /// left out; for each node its number, type (0, 1, 2), features of A and of B, GraphRole, whether
  /// it applies; for each arc two places in the list of nodes, one of them at least holds or is
  /// near. Those that hold or are near come first, then their G-neighbors, at most `most_nodes` in
  /// all. numbers: the plane value of each node [m]; empty where no pair is active. Where the part
  /// is felt.
  void describe_graph(std::uint32_t most_nodes);
  /// The two features of a basic contact and its face of the C-obstacle, where the part is felt.
  /// counts: corners of the feature of A, of that of B, of the face (0 where it does not apply);
  /// numbers: all of these in W [m]. Empty where the scene has no such pair or node.
  void describe_marked(std::uint32_t pair, std::uint32_t node);

  ViewInput input;
  ViewDrive drive;
  tools::TickRecord result;  ///< of the last tick, with what is felt
  ViewScene scene;
  ViewAnswer answer;

 private:
  [[nodiscard]] RtStatus create();
  void show_scene();
  void list_state();
  [[nodiscard]] StepResult step_hands(const StepInput& first);
  void stand_second();
  void add_mover(const tools::DrivenTick& tick, std::uint32_t part);
  /// Counts and numbers of a piece: `shown` stands for its body.
  void add_piece(const SceneView& in, std::uint32_t piece, std::uint32_t shown,
                 const double* shift_m);
  [[nodiscard]] bool meets_standing() const;
  /// Pairs of the planes that hold the part.
  [[nodiscard]] std::vector<std::uint32_t> held_pairs() const;
  [[nodiscard]] std::vector<std::uint32_t> near_pairs();
  void describe_obstacle(std::uint32_t pair, const Pose& pose_wa);
  void add_face(std::uint32_t kind, FaceRole role, const tools::CFace& face, std::uint32_t node);
  /// The scene of the held part and a mover, either of which is the one that moves in it.
  struct OtherPair {
    std::uint32_t mover = 0;
    bool is_reversed = false;  ///< the mover does
    SceneView scene;
    std::optional<tools::ObstacleSearch> search;
  };
  void open_others();
  [[nodiscard]] std::vector<OtherPair*> near_others();
  [[nodiscard]] Pose felt_mover(std::uint32_t mover) const;
  void describe_other(OtherPair& other, std::uint32_t most_pairs, std::uint32_t most_nodes);

  struct Free {
    void operator()(std::byte* bytes) const noexcept;
  };
  SceneView view_;
  std::unique_ptr<tools::HeldParts> parts_;  ///< null: the scene has one moving part
  const SceneView* shown_ = &view_;          ///< of the part that is held, or was last
  tools::GuideLegs legs_;
  std::unique_ptr<std::byte, Free> memory_;
  std::span<std::byte> state_;
  std::vector<std::span<std::byte>> state_pieces_;  ///< of the state
  std::array<FrameRecord, kMostDriven> newest_{};   ///< poses of movers
  StepResult second_;                               ///< of a second hand, in the last tick
  HapticCore* core_ = nullptr;
  tools::SessionJudge judge_;
  Pose felt_wa_;
  std::optional<tools::ObstacleSearch> nearby_;     ///< made when it is first asked
  std::vector<std::unique_ptr<OtherPair>> others_;  ///< of the part that is held; made when asked
  std::vector<Vec3> corners_;
  std::vector<ContactId> ids_;
  ContactGeometry contact_;
};

[[nodiscard]] Vec3 vector_in(const double* v);
[[nodiscard]] Pose pose_in(const double* p_m, const double* q_xyzw);

/// A line for each member of the structures input, drive, result, scene and live (LiveState of
/// tools/live/live_state.hpp, the message of a live session): structure, name, offset, type (f64,
/// i64, u64, u32), count, with blanks between. Names of result and live are those of kTickFields.
[[nodiscard]] std::string layout_text();

}  // namespace haptic::sim
