// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bytes of a compiled scene (`.rtscene`): one relocatable little-endian blob, written by the graph
/// compiler, read in place by the core. Header, table of sections, sections; every offset counts
/// from the first byte of the blob. Each section starts at a multiple of kSceneAlignment and holds
/// `count` elements of `element_bytes`; padding is zero. Sections with an unknown id are skipped.
/// Scalars named Real have the width that the header states.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/laws.hpp"

namespace haptic {

inline constexpr char kSceneMagic[8] = {'R', 'T', 'S', 'C', 'E', 'N', 'E', '\0'};
inline constexpr std::uint32_t kSceneVersion = 14;
inline constexpr std::size_t kSceneAlignment = 64;

/// Limits of the format; the compiler refuses beyond them and SceneView checks them.
inline constexpr std::uint32_t kMaxPieceFeatures =
    65535;                                               ///< vertices, edges or faces of one piece
inline constexpr std::uint32_t kMaxFaceVertices = 4096;  ///< vertices of one face
inline constexpr std::uint32_t kMaxSections = 64;
inline constexpr std::uint32_t kMostPieces = 1u << 22;

enum class SectionId : std::uint32_t {
  kParameters = 1,        ///< SceneParameters, exactly one
  kBodies = 2,            ///< BodyRecord; body 0 is the moving one
  kPlanes = 3,            ///< PlaneRecord, by body
  kPieces = 4,            ///< PieceRecord, by body
  kVertices = 5,          ///< Real[3], by piece
  kFaces = 6,             ///< FaceRecord, by piece
  kLoopVertices = 7,      ///< u16 vertices of the faces, counter-clockwise from outside
  kLoopEdges = 8,         ///< u16 edges of the faces: edge k joins loop vertices k and k + 1
  kEdges = 9,             ///< EdgeRecord, by piece
  kEdgeDirections = 10,   ///< EdgeDirection, by piece
  kVertexEdgeBegin = 11,  ///< u32, one per vertex of all pieces and one more
  kVertexEdges = 12,      ///< u16 edges at each vertex, ascending
  kPairs = 13,            ///< PairRecord; none where pairs are not listed (scene/formed_pairs.hpp)
  kNodes = 14,            ///< NodeRecord, by pair whose graph is stored
  kNeighborBegin = 15,    ///< u32, one per node of all stored graphs and one more
  kNeighbors = 16,        ///< u16 or u32 (element_bytes): neighbor nodes within the pair, ascending
  kSourceVertices = 17,   ///< i32, by piece: vertex of the user's mesh, -1 when a cut made it
  kText = 18,             ///< bytes: names, UTF-8, not terminated
  kVertexLanes = 19,      ///< Real, by piece that is not flat: all x, all y, all z of its vertices,
                          ///< each padded
  kEdgeArcs = 20,         ///< EdgeArc, by edge of pieces that are not flat
  kNodeMarks = 21,        ///< u64, by pair or piece that has marks (scene/node_marks.hpp)
  kSimplified = 22,       ///< SimplifiedBody, by body; only where a simplification changed one
  kConeRanges = 23,       ///< ConeRange, by flat piece: of its vertices, then of its edges
  kConeDirections = 24,   ///< Real[3], unit, geometry frame of the body: by edge of flat pieces the
                          ///< normal of the side there, in the facet's plane and out of it; behind
                          ///< these the directions of cones
  kGuide = 25,            ///< GuideRecord, one; only where the scene leads the hand along a plan
  kGuideStations = 26,    ///< GuideStation, from the start to the goal; with kGuide alone
  kParts = 27,            ///< PartRecord, by body; only where the hand may hold one after another
  kPartBodies = 28,       ///< u32: the parts that are the static bodies of each part's scene
  kPartScenes = 29,       ///< bytes: the scenes in which parts are held, each aligned as this one
  kDriven = 30,           ///< DrivenRecord, ascending by part; only where an owner moves parts
  kBodyPairs = 31,        ///< BodyPairRecord; only where several parts move at once
  kStages = 32  ///< StageRecord, in the order of the assembly; only where the scene has one
};

/// Vertices of a piece in kVertexLanes come in a multiple of this; the rest repeats vertex 0.
inline constexpr std::uint32_t kLanePadding = 8;
[[nodiscard]] constexpr std::uint32_t padded_lanes(std::uint32_t vertices) noexcept {
  return (vertices + kLanePadding - 1) / kLanePadding * kLanePadding;
}

struct SectionEntry {
  SectionId id;
  std::uint32_t element_bytes;
  std::uint64_t offset;
  std::uint64_t count;
};

// Header and capacities.

/// Fixed capacities and bounds of one tick, computed from the tables (scene/capacity.hpp). A tick
/// visits at most `max_pair_visits` pairs, nearest first; the other bounds hold for any such
/// choice.
struct SceneCapacity {
  std::uint64_t state_bytes;     ///< memory of one HapticCore for this scene, 64-bit addresses
  std::uint32_t moving_lanes;    ///< padded vertices of all pieces of A
  std::uint32_t pair_count;      ///< UINT32_MAX: so many or more
  std::uint32_t total_features;  ///< faces and edges of both pieces, over all pairs
  std::uint32_t largest_pair_features;
  std::uint32_t largest_near;     ///< largest near capacity of a pair
  std::uint32_t max_pair_visits;  ///< pairs searched in one tick
  std::uint32_t max_support_pairs;
  std::uint32_t max_feature_evaluations;  ///< faces and edges whose bound is computed
  std::uint32_t max_edge_pairs;           ///< pairs of active edges tested
  std::uint32_t max_near_nodes;           ///< of all near sets together
  std::uint32_t max_hull_points;          ///< points of one contact polygon
  /// Law kProxy, else 0: pairs near the part that a tick can follow, and units of work that it may
  /// spend, with what it may have begun when they are spent (scene/proxy_limits.hpp): they bound
  /// gaps along C-face planes, nodes of valid sets and the work of searches too.
  std::uint32_t near_slots, max_work_units;
  std::uint32_t max_list_visits;    ///< nodes of the trees that lists of near pairs look at
  std::uint32_t max_full_searches;  ///< searches without history
  std::uint32_t max_proxy_passes, max_proxy_rejected;
  std::uint32_t max_proxy_rounds;                ///< of one pass
  std::uint32_t max_qp_rows, max_qp_iterations;  ///< of one quadratic program
  std::uint32_t max_qp_programs, max_qp_steps;   ///< programs, and iterations of them all together
  std::uint32_t unproven;                        ///< UnprovenBound, bit set = cannot be defended
  std::uint32_t reserved;                        ///< 0

  friend constexpr bool operator==(const SceneCapacity&, const SceneCapacity&) noexcept = default;
};

/// Why what a tick does cannot be certified: of a search at the goal pose, and of law kProxy only
/// the pairs near the part. The work of a tick is bounded in every case; these bits say that a tick
/// might have to give up exactness, or the part lag, with a flag, to keep to it.
enum UnprovenBound : std::uint32_t {
  kUnprovenEdgePairs = 1u << 0,   ///< a pair has more pairs of edges than a tick may test
  kUnprovenNearSet = 1u << 1,     ///< a pair has more nodes than its near set may hold
  kUnprovenPairVisits = 1u << 2,  ///< more pairs can be near at once than a tick may visit
  kUnprovenNearPairs = 1u << 3    ///< more pairs can be near at once than law kProxy can follow
};

struct SceneHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t header_bytes;  ///< sizeof(SceneHeader)
  std::uint64_t byte_count;    ///< of the whole blob
  std::uint64_t content_hash;  ///< scene_content_hash of the blob with this field zero
  std::uint32_t scalar_bytes;  ///< sizeof(Real): 8 or 4
  std::uint32_t section_count;
  std::uint64_t section_table;  ///< offset of SectionEntry[section_count]
  SceneCapacity capacity;
};

/// Header and the longest section table.
inline constexpr std::size_t kSceneFrontBytes =
    sizeof(SceneHeader) + kMaxSections * sizeof(SectionEntry);

// Parameters: law, device, coupling, where the part goes; and the limits of these numbers.

/// Largest coordinate [m] and stiffness [N/m]: far beyond any device, and small enough that no
/// force, torque or square of a length leaves the range of Real, single precision included.
inline constexpr double kMaxSceneLength_m = 1.0e6;
inline constexpr double kMaxStiffness_n_per_m = 1.0e12;
/// Limits of the coupling: least stiffness and length L = sqrt(k_r / k_t), which must stay apart
/// from zero in single precision; damping [N s/m], rotation error [rad] and window [s] at most;
/// coefficient of friction at most.
inline constexpr double kMinStiffness_n_per_m = 1.0e-12;
inline constexpr double kMinCouplingLength_m = 1.0e-9;
inline constexpr double kMaxCouplingDamping_ns_per_m = 1.0e12;
inline constexpr double kMaxRotationError_rad = 3.0;
inline constexpr double kMaxWindow_s = 1.0e3;
inline constexpr double kMaxFriction = 2.0;
/// Limits of the held part: mass [kg], acceleration of gravity [m/s^2].
inline constexpr double kMaxHeldMass_kg = 1.0e6;
inline constexpr double kMaxGravity_m_per_s2 = 1.0e4;

/// Properties of the haptic device, as they act at its handle; SI units. A value of 0 in a limit
/// means "not given".
struct DeviceParameters {
  double mass_kg, damping_ns_per_m, coulomb_friction_n, encoder_step_m;
  double rotor_inertia_kg_m2[3];  ///< that the handle turns against about the axes of W; all 0:
                                  ///< not given
  double rotor_damping_nms_per_rad[3];  ///< about the same axes
  double coulomb_torque_nm, encoder_step_rad;
  double max_force_n, max_torque_nm, max_force_rate_n_per_s, max_torque_rate_nm_per_s;
  double max_stiffness_n_per_m, max_damping_ns_per_m;
  double max_rotary_stiffness_nm_per_rad;
  double delay_s;
  std::uint32_t given;  ///< 1 when the scene has a [device] table
  std::uint32_t reserved;
};

/// How the proxy is coupled to the device (law kProxy), and what stands between any law and the
/// device. SI units; every value resolved by the compiler, 0 where a limit is said to be none.
struct CouplingParameters {
  double k_t_n_per_m;              ///< coupling stiffness in translation, > 0
  double k_r_nm_per_rad;           ///< in rotation, > 0; k_r = k_t L^2, L 1e-9 to 1e6 m
  double damping_ns_per_m;         ///< B: coupling damping in translation; B L^2 in rotation; >= 0
  double damping_share;            ///< it is at most this share of the spring wrench, 0 to 1
  double max_rotation_error_rad;   ///< theta_sat: the torque grows no further; in (0, 3]
  double max_translation_error_m;  ///< the force grows no further; 0: no limit
  double min_window_s;             ///< of the twist estimator, 0 to max_window_s
  double max_window_s;             ///< of the twist estimator, > 0
  double max_pull_n;               ///< force at which the spring saturates; 0: no limit
  double max_turn_nm;              ///< torque at which it does; 0: no limit
  double tolerance_m;              ///< depth that counts as free; 0: from the size of the part
  double climb_m;  ///< steps up to this height do not hold the part; 0: by its size; < 0: all do
  std::uint32_t passes;        ///< of the proxy in one tick, 1 to kMaxProxyPasses
  std::uint32_t near_pairs;    ///< that a tick can follow, up to kMostNearPairs; 0: by the pieces
  std::uint32_t passivity;     ///< 1: energy observer and controller act on the wrench
  std::uint32_t allow_active;  ///< 1: gains beyond the passivity budget were allowed
};

/// Bits of EnvelopeParameters::given.
enum EnvelopeGiven : std::uint32_t { kOrientationGiven = 1u << 0, kWorkspaceGiven = 1u << 1 };

/// Where the part goes; nodes that none of these poses needs may be missing from the marks. What is
/// not given is zero.
struct EnvelopeParameters {
  double q_wa_xyzw[4];   ///< middle of the orientations, unit
  double max_angle_rad;  ///< largest turn from it, 0 to pi; 0: the part never turns
  double min_m[3];       ///< of the box that the grip point stays in, W axes
  double max_m[3];
  std::uint32_t given;  ///< EnvelopeGiven
  std::uint32_t reserved;
};

/// True if the envelope is one orientation: the part never turns.
[[nodiscard]] constexpr bool is_one_orientation(const EnvelopeParameters& e) noexcept {
  return (e.given & kOrientationGiven) != 0 && e.max_angle_rad == 0;
}

/// The mass that the hand is to feel in the moving part; all zero: none.
struct HeldPartParameters {
  double mass_kg;              ///< >= 0
  double inertia_kg_m2[6];     ///< matrix about the grip point in A's axes: xx, yy, zz, xy, xz, yz
  double centre_m[3];          ///< of mass, from the grip point, A's axes
  double gravity_m_per_s2[3];  ///< W's axes
};

struct SceneParameters {
  LawId law;
  std::uint32_t motion_limits_given;  ///< 1 when the scene has a [motion_limits] table
  double k_f_n_per_m;                 ///< paper's k_F
  double epsilon_m;                   ///< paper's epsilon: width of the near set
  double exact_band_m;  ///< separations beyond this may be answered by a held plane, flagged
  double rate_hz;
  double start_p_wa_m[3];  ///< start pose of A's mesh frame in W
  double start_q_wa_xyzw[4];
  double max_linear_speed_m_per_s, max_angular_speed_rad_per_s;
  std::uint32_t name_offset, name_bytes;  ///< in kText
  std::uint32_t goal_contact;  ///< 1: the contact at the goal pose can be searched; law kProxy does
                               ///< without
  std::uint32_t work_units;    ///< of law kProxy: what a tick may spend, kLeastWorkUnits at least
  DeviceParameters device;
  CouplingParameters coupling;
  EnvelopeParameters envelope;
  HeldPartParameters held;
};

// Bodies and their pieces.

/// Directions in kConeDirections.
struct ConeRange {
  std::uint32_t begin, count;
};

/// PieceRecord::cone_begin of a piece with a volume.
inline constexpr std::uint32_t kNoCones = 0xFFFFFFFFu;

/// One rigid body. Geometry of the moving body is given in A's axes about the grip point; of a
/// static body in W's axes about `reference_m`.
struct BodyRecord {
  double
      reference_m[3];  ///< moving: grip point x_0^A in A's mesh frame; static: reference point in W
  double volume_m3;    ///< of the solid (pieces of a cover counted once each); of a surface 0
  double friction;     ///< static body: Coulomb coefficient against the moving body while it
                       ///< slides, 0 to 2; moving: 0
  double friction_static;  ///< the same while it sticks, `friction` to 2; moving: 0
  std::uint32_t piece_begin, piece_count;
  std::uint32_t plane_begin, plane_count;
  std::uint32_t name_offset, name_bytes;  ///< in kText
};

/// A body that is not that of its mesh: bevels, fillets and rounds gave way, or edges collapsed.
/// For people, to whom it is reported when the scene is loaded; no tick reads it.
struct SimplifiedBody {
  std::uint32_t body;
  std::uint32_t reserved;
  double distance_m;        ///< proved: no point of either surface is farther from the other
  double volume_change_m3;  ///< volume of the body minus that of the mesh; 0 of a surface
};

/// Role of a part for the hand.
enum class PartRole : std::uint32_t {
  kFixed = 1,   ///< never held
  kHand = 2,    ///< held at the start: body 0 of the scene around
  kPlaced = 3,  ///< may be held, and stays where it is let go
  kDriven = 4,  ///< never held: its owner moves it, and it pushes what is held
  kHand2 = 5,   ///< held by the second hand all the time, and the first part by the first: part 1
  kLoose = 6    ///< never held: it stays where what moves has pushed it
};

/// A part of a scene whose parts the hand holds one after another (scene/part_scenes.hpp). Each
/// that may be held has a scene of its own, in which it is the moving body.
struct PartRecord {
  PartRole role;
  std::uint32_t law_bytes;    ///< state of its law among others that move (JointMotion); else 0
  double start_p_wa_m[3];     ///< where its mesh frame is in W in all these scenes
  double start_q_wa_xyzw[4];  ///< unit
  std::uint64_t scene_begin;  ///< in kPartScenes, a multiple of kSceneAlignment
  std::uint64_t scene_bytes;  ///< 0: it is never held
  std::uint32_t body_begin;   ///< in kPartBodies
  std::uint32_t body_count;   ///< static bodies of its scene: the parts that it may meet
};

/// Leads a part that moves beside those that are held.
enum class Lead : std::uint32_t {
  kOwner = 0,   ///< its owner's poses: a robot's fixture, a conveyor, a body of another simulator
  kAnchor = 1,  ///< of a loose part: an anchor that gives way
  kWeight = 2   ///< of a loose part: its weight, along -z of W
};

/// A part that moves beside those that are held: its owner moves it, or it is loose.
struct DrivenRecord {
  std::uint32_t part;  ///< its number
  Lead lead;
  /// Its owner moves it no faster; its weight lets it sink no faster; > 0.
  double fastest_m_per_s, fastest_rad_per_s;
  double late_s;       ///< without a newer pose for longer it stays; of a loose part: a tick; > 0
  double push_n;       ///< largest force of what leads it: beyond, an anchor gives way; > 0
  double ratio;        ///< stiffness of that spring over that of the hand's; > 1
  double middle_m[3];  ///< point of it that the law turns it about, in its mesh frame
  double radius_m;     ///< every vertex lies within it of that point; > 0
};

/// Two parts that may meet while both move: one that may be held, and a driven one or that of the
/// other hand. In the scene of the two A moves, and B, alone, stands at its mesh frame.
struct BodyPairRecord {
  std::uint32_t a, b;         ///< numbers of the parts; of those of two hands A is the smaller one
  std::uint64_t scene_begin;  ///< in kPartScenes, a multiple of kSceneAlignment
  std::uint64_t scene_bytes;
};

/// A stage of an assembly: a part is brought to its goal, while those of earlier stages are at
/// theirs and all others where they start. Read by tools; no tick does.
struct StageRecord {
  std::uint32_t part;        ///< its number; each at most once, and one that the hand may take
  std::uint32_t reserved;    ///< 0
  double goal_p_wa_m[3];     ///< of its mesh frame in W
  double goal_q_wa_xyzw[4];  ///< unit
};

/// A plan that leads the hand (tick/guide.hpp): how strongly, and how far it reaches.
struct GuideRecord {
  std::uint64_t plan_geometry;  ///< hash of the geometry that the plan was proved for
  double pull_n;       ///< force along the way: slope of the potential over its length; > 0
  double hold_n;       ///< largest force across the way, beyond the clearance of the stations; > 0
  double turn_m;       ///< length that a turn of 1 rad counts as, > 0
  double near_goal_m;  ///< the pull fades over this last part of the way, > 0
  double let_go_m;     ///< distance from the way at which the guide lets go, > 0
  double ramp_s;       ///< in which it sets in and ends, > 0
  double energy_j;     ///< the most that it can do, > 0
};

/// A pose of the plan. Lengths are of place and turn: root of |dx|^2 + (turn_m angle)^2.
struct GuideStation {
  Real x0_m[3];       ///< grip point in W
  Real q_wa_xyzw[4];  ///< unit
  /// To the next station: place [m]; turn_m times twice the vector part of the turn's quaternion
  /// [m]. Of the last zero.
  Real way_m[3], turn_way_m[3];
  Real per_square;         ///< 1 over the square of that way [1/m^2]; of the last 0
  Real cost_m;             ///< length of the rest of the way
  Real clearance_m;        ///< proved: no pair of pieces is nearer; at least 0
  std::uint32_t contacts;  ///< pairs of pieces that touch there
  /// Planes of contact there, by TouchKind; pieces that touch in one plane count once. For people:
  /// no tick reads them. All 0 where nothing touches, and only there.
  std::uint8_t touching[4];
};
/// How two pieces touch in a plane.
enum class TouchKind : std::uint8_t { kFaces = 0, kEdgeOnFace, kVertexOnFace, kEdges };
inline constexpr std::uint32_t kMostGuideStations = 256;

struct PlaneRecord {
  Real normal[3];  ///< unit
  Real offset_m;   ///< normal . p = offset for points p of the plane, in the body's geometry frame
};

/// A convex piece: a polyhedron, or a flat facet of a surface. A facet has two faces, one for each
/// side, with the same vertices; its volume is 0.
struct PieceRecord {
  std::uint32_t body;
  std::uint32_t vertex_begin, vertex_count;
  std::uint32_t face_begin, face_count;
  std::uint32_t edge_begin, edge_count;
  std::uint32_t loop_begin, loop_count;  ///< in kLoopVertices and kLoopEdges
  std::uint32_t mark_begin;  ///< in kNodeMarks where pairs are not listed, or kNotMarked
  double volume_m3;
  double radius_m;     ///< largest distance of a vertex from `centre_m`
  double centre_m[3];  ///< mean of the vertices, geometry frame: interior point for the verdict
  double reach_m;      ///< largest distance of a vertex from the frame's origin
  /// For every vertex and every unit direction in which no neighbour rises by epsilon: how much
  /// farther than D_near - epsilon the support of a near node's plane can lie behind it [m].
  double vertex_relax_m;
  /// Largest ratio, over all edges, of the height that the piece can rise over a plane through the
  /// edge to the height of the adjoining face that rises, while that is at most epsilon; >= 1.
  double edge_relax_ratio;
  std::uint32_t lane_begin;  ///< in kVertexLanes; there is nothing of a flat piece
  std::uint32_t lane_count;  ///< padded vertices: x at lane_begin, y and z one lane_count on each
  /// In kConeRanges, of a flat piece, else kNoCones: the directions of the mesh's edges at each
  /// vertex, away from it; then at each edge those in which its facets go on, in their planes and
  /// orthogonal to the edge. A contact can carry force along n where the piece goes on behind it.
  std::uint32_t cone_begin;
  /// Edges of the flat pieces before this one: where the sides of a flat piece begin in
  /// kConeDirections, and how far before its edges another one begins in kEdgeArcs.
  std::uint32_t flat_edges;
};

/// A facet of a surface.
[[nodiscard]] constexpr bool is_flat(const PieceRecord& piece) noexcept {
  return piece.face_count == 2;
}

/// Planes of a piece: those of its faces, and behind them of a facet those of its sides. A side is
/// what a face would be along an edge of the facet if it had a thickness: where two facets lie in
/// planes almost parallel, no other plane may lie between them.
[[nodiscard]] constexpr std::uint32_t plane_count(const PieceRecord& piece) noexcept {
  return piece.face_count + (is_flat(piece) ? piece.edge_count : 0);
}

/// Reals that a piece has in kVertexLanes.
[[nodiscard]] constexpr std::uint64_t stored_lanes(const PieceRecord& piece) noexcept {
  return is_flat(piece) ? 0 : 3 * std::uint64_t{piece.lane_count};
}

struct FaceRecord {
  std::uint32_t plane;       ///< index within the body's planes
  std::int32_t sign;         ///< +1 or -1: outward normal = sign * plane normal
  std::uint32_t loop_begin;  ///< in kLoopVertices, absolute
  std::uint32_t loop_count;
  std::int32_t source_face;  ///< face of the user's mesh, -1 when a cut made it
};

/// Edge v0 < v1; edges of a piece are sorted by (v0, v1). v0 -> v1 is counter-clockwise round
/// face[0].
struct EdgeRecord {
  std::uint16_t vertex[2];
  std::uint16_t face[2];
  std::uint16_t apex[2];  ///< vertex of face[k] farthest from the edge's line
};

struct EdgeDirection {
  Real unit[3];  ///< from vertex[0] to vertex[1]
  Real length_m;
};

/// The arc of an edge on the Gauss sphere, between the normals of its two faces, extended at each
/// end by the angle at which the adjoining face rises by epsilon over a plane through the edge; the
/// whole circle (cosine -1, sine 0) where a face is too narrow to rise by epsilon. The arc is
/// `cos(t) mid + sin(t) side`, |t| <= the half angle, which is at most pi.
struct EdgeArc {
  Real mid[3], side[3];  ///< orthonormal, orthogonal to the edge; `side` towards face[1]
  Real cosine, sine;     ///< of the half angle
  /// Outward normal of face[k] times the distance of apex[k] from the edge's line [m].
  Real tilt[2][3];
  /// 1 where, as far as the arc reaches beyond face[k], no vertex rises farther over a plane
  /// through the edge than apex[k]; 0 where one does.
  Real apex_rules[2];
};

// Pairs, their basic contacts, and the capacities that a pair states.

/// PairRecord::node_begin of a pair whose graph is not stored: its nodes and arcs are formed from
/// the incidence tables of its two pieces (scene/graph_rule.hpp), which gives the same graph.
inline constexpr std::uint32_t kGraphNotStored = 0xFFFFFFFFu;

/// PairRecord::mark_begin of a pair that needs all of its nodes.
inline constexpr std::uint32_t kNotMarked = 0xFFFFFFFFu;

/// A pair (piece of A, piece of B) = one convex C-obstacle and its graph of basic contacts (paper
/// Sec. II-A). Node numbers: type A `f nVB + v`, type B `nFA nVB + v nFB + f`, type C `nFA nVB +
/// nVA nFB + e nEB + g`.
struct PairRecord {
  std::uint32_t piece_a, piece_b;
  std::uint32_t node_begin;  ///< in kNodes, or kGraphNotStored
  std::uint32_t node_count;
  std::uint32_t node_count_a;  ///< type A; then type B; the rest is type C
  std::uint32_t node_count_b;
  std::uint32_t max_degree;
  std::uint32_t near_capacity;       ///< of the near set
  std::uint32_t edge_pair_capacity;  ///< pairs of active edges that a search may test
  std::uint32_t mark_begin;          ///< in kNodeMarks, or kNotMarked
};

/// Features of a basic contact: face or vertex or edge of A, vertex or face or edge of B, within
/// their pieces. Neighbors of the same type with the same face (types A and B) lie among the
/// `keep_count` consecutive ones of its list from the `keep_begin`-th on: for type A these are all
/// of them and no others, for type B those with the same vertex of A stand between. None for type
/// C.
struct NodeRecord {
  std::uint16_t a, b;
  std::uint16_t keep_begin, keep_count;
};

/// Pairs of edges that one pair may test in one tick. Every pair with no more than that many is
/// exact at every pose; measured on hulls of 200 vertices: at most 200 after the first tick.
inline constexpr std::uint32_t kMaxEdgePairs = 16384;

/// Pairs with no more nodes than this have room for all of them in their near set.
inline constexpr std::uint32_t kSmallPairNodes = 1024;

/// Basic contacts that can share one C-plane when the faces with `face_a` and `face_b` vertices lie
/// on each other: every vertex of each and every pair of their edges (19 for tetrahedron and box,
/// 24 for two boxes).
constexpr std::uint64_t face_face_ties(std::uint64_t face_a, std::uint64_t face_b) noexcept {
  return face_a + face_b + face_a * face_b;
}

/// Capacity of the near set of a pair with `node_count` live nodes: all of a small pair; else three
/// planes of ties at one corner of the C-obstacle, a margin for the edge stars of their corners,
/// and never more than the pair has nodes.
constexpr std::uint32_t near_capacity(std::uint32_t node_count, std::uint32_t largest_face_a,
                                      std::uint32_t largest_face_b) noexcept {
  if (node_count <= kSmallPairNodes) return node_count;
  const std::uint64_t ties = 3 * face_face_ties(largest_face_a, largest_face_b) + 16;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(node_count, std::max<std::uint64_t>(kSmallPairNodes, ties)));
}

/// Pairs of active edges that a search may test, of a pair with as many reachable ones.
constexpr std::uint32_t edge_pair_capacity(std::uint64_t edge_pairs) noexcept {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(kMaxEdgePairs, edge_pairs));
}

static_assert(sizeof(SectionEntry) == 24 && sizeof(SceneCapacity) == 104 &&
              sizeof(SceneHeader) == 152);
static_assert(sizeof(DeviceParameters) == 168 && sizeof(CouplingParameters) == 112 &&
              sizeof(EnvelopeParameters) == 96 && sizeof(HeldPartParameters) == 104 &&
              sizeof(SceneParameters) == 608);
static_assert(sizeof(GuideRecord) == 64 && sizeof(GuideStation) == 16 * sizeof(Real) + 8);
static_assert(sizeof(BodyRecord) == 72 && sizeof(PieceRecord) == 120 && sizeof(FaceRecord) == 20 &&
              sizeof(SimplifiedBody) == 24 && sizeof(PartRecord) == 88 &&
              sizeof(DrivenRecord) == 80 && sizeof(BodyPairRecord) == 24 &&
              sizeof(StageRecord) == 64);
static_assert(sizeof(EdgeRecord) == 12 && sizeof(PairRecord) == 40 && sizeof(NodeRecord) == 8);
static_assert(sizeof(PlaneRecord) == 4 * sizeof(Real) &&
              sizeof(EdgeDirection) == 4 * sizeof(Real) && sizeof(EdgeArc) == 16 * sizeof(Real));
static_assert(std::is_trivially_copyable_v<SceneHeader> &&
              std::is_trivially_copyable_v<SceneParameters>);

/// 64-bit hash of a whole blob, its content_hash field taken as zero (FNV-1a over 8-byte words,
/// then bytes). `blob` must hold at least a header. O(bytes); deterministic on every platform.
[[nodiscard]] std::uint64_t scene_content_hash(std::span<const std::byte> blob) noexcept;

}  // namespace haptic
