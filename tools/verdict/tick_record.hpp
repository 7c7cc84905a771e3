// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The one record of a tick, and the one list of its fields: columns of CSV files, keys of live
/// topics and what a page may read are made from it, and the structures of C and Python are held
/// against it (tests/tools/verdict/test_tick_record.cpp).

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include "rt_core/tick/step.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// An enumerator as a number of four bytes, as boards and pages have it.
template <class Enum>
struct Coded {
  constexpr Coded() = default;
  constexpr Coded(Enum value) : code(static_cast<std::uint32_t>(value)) {}
  constexpr operator Enum() const { return static_cast<Enum>(code); }
  std::uint32_t code = 0;
};

/// A pose in doubles, in any scalar of the build.
struct PoseNumbers {
  PoseNumbers() = default;
  PoseNumbers(const Pose& pose);
  operator Pose() const;
  double p_m[3] = {0, 0, 0}, q_xyzw[4] = {0, 0, 0, 1};
};

/// Guide of a tick: what leads the hand besides the contact, and where on the plan it is.
struct TickGuide {
  double force_n[3] = {0, 0, 0};    ///< on the hand, W axes
  double torque_nm[3] = {0, 0, 0};  ///< about the grip point, W axes
  double to_go_m = 0, off_m = 0;    ///< length of the rest of the way; distance from it
  Coded<GuideState> state = GuideState::kNone;
  std::uint32_t station = 0;  ///< the last one passed
};

/// A tick of the core in plain numbers. Trivially copyable, without gaps: boards between processes
/// and messages to pages hold it as it is. A new member goes to the end, one of four bytes beside
/// another of four bytes. Each has a row in kTickFields.
struct TickRecord {
  double force_n[3] = {0, 0, 0};    ///< on the hand, W axes
  double torque_nm[3] = {0, 0, 0};  ///< about the grip point, W axes
  /// A's mesh frame in W: after clutch and envelope; and of the part as it is felt. Laws other than
  /// proxy feel it at the goal.
  PoseNumbers goal_wa, proxy_wa;
  double goal_grip_m[3] = {0, 0, 0}, proxy_grip_m[3] = {0, 0, 0};  ///< the same of the grip point
  double proxy_gap_m = 0;        ///< law proxy: smallest gap of the proxy
  double potential_j = 0;        ///< law proxy: energy of the coupling spring
  double energy_j = 0;           ///< of the passivity observer
  double d_near_m = 0;           ///< smallest over the pairs, <= 0: collision; NaN: not searched
  std::uint64_t state_hash = 0;  ///< of this tick and all before it
  Coded<RtStatus> status = RtStatus::kOk;
  std::uint32_t flags = 0;  ///< StepFlag
  Coded<ContactSituation> situation = ContactSituation::kNone;
  std::uint32_t near_count = 0;        ///< StepResult::near_count
  std::uint32_t nearest_pair = 0;      ///< only where the goal was searched
  std::uint32_t has_goal_contact = 0;  ///< 1: the goal was searched
  std::uint32_t behind_ticks = 0;      ///< in a row, to this one
  std::uint32_t work_units = 0;        ///< of the proxy, as its budget counts them
  /// FeltContact: planes and contact points; 0 where nobody has asked the core.
  std::uint32_t felt_planes = 0, felt_points = 0;
  TickGuide guide;
  std::uint64_t tick = 0;
  double t_s = 0;
  PoseNumbers device_wa;  ///< A's mesh frame in W, as the core was asked for it
  /// Law proxy: distance of the part as it is felt from the goal, at the grip point. Other laws: 0.
  double apart_m = 0;
  double pull_n = 0;                  ///< force of the spring alone: StepResult::spring_w
  std::uint32_t in_contact = 0;       ///< 1: the part as it is felt touches: felt_part_touches
  std::uint32_t nodes_evaluated = 0;  ///< faces, edges and pairs of edges
  std::uint32_t support_pairs = 0;
  std::uint32_t relocalised_pairs = 0;  ///< pairs of which every bound had become stale
};
static_assert(std::is_trivially_copyable_v<TickRecord> && std::is_standard_layout_v<TickRecord>);

/// The record of tick number `tick` from the core's result under `law`; the pose of the device is
/// the goal, for the caller to change where it knows better. `grip_a`: grip point in A's mesh frame
/// [m].
[[nodiscard]] TickRecord record_of(std::uint64_t tick, double t_s, const StepResult& result,
                                   LawId law, const Vec3& grip_a = Vec3::Zero());

/// The quantities of a tick that are judged.
[[nodiscard]] JudgedTick judged_tick(const TickRecord& record) noexcept;

/// How a field is shown. The last three are not of the record alone: the guide's legs
/// (tools/plan/guide_legs.hpp) at its station.
enum class TickKind : std::uint8_t {
  kNumber,
  kVector,      ///< x, y, z
  kQuaternion,  ///< x, y, z, w; in CSV w first
  kCount,
  kHash,  ///< 16 hexadecimal digits
  kFlags,
  kRtStatus,
  kSituation,
  kGuideState,
  kGuidePlace,
  kGuideLeg,  ///< from 1 on
  kGuideLegs
};
[[nodiscard]] constexpr bool is_of_legs(TickKind kind) { return kind >= TickKind::kGuidePlace; }

/// Tables that show fields of a tick.
enum class TickTable : std::uint8_t {
  kNoTable,
  kCsv,       ///< first columns of a line
  kCsvGuide,  ///< columns of a scene with a guide
  kCsvPoses,  ///< columns of the poses
  kCsvAdded,  ///< columns that came later: at the end of each line
  kWrench,    ///< topics of tools/live/topics.hpp
  kContact,
  kCounters,
  kGuide
};

/// A field's place in a table, from 0 on, and its column or key there; columns of a vector with
/// commas between. A place never changes: a new one is the table's next.
struct TickPlace {
  TickTable table = TickTable::kNoTable;
  std::uint8_t place = 0;
  std::string_view name{};
};

struct TickField {
  std::string_view member;  ///< of TickRecord
  std::size_t offset;       ///< in it
  std::string_view type;    ///< f64, u64, u32
  std::size_t count;        ///< of numbers
  TickKind kind;
  std::string_view unit;  ///< SI; 1: a pure number; empty: none
  std::string_view page;  ///< name of the page's export; empty: none, for kinds of the legs
  /// Member of haptic_step_output; fields that share one follow each other there. kNotInC: none.
  std::string_view in_c;
  TickPlace csv{}, live{};

  [[nodiscard]] constexpr std::size_t bytes() const { return count * (type == "u32" ? 4u : 8u); }
};
inline constexpr std::string_view kNotInC{};
inline constexpr TickPlace kNowhere{};

namespace tick_field {

template <class Member>
constexpr TickField of(std::string_view member, std::size_t offset, TickKind kind,
                       std::string_view unit, std::string_view page, std::string_view in_c,
                       TickPlace csv = {}, TickPlace live = {}) {
  using Number = std::remove_all_extents_t<Member>;
  constexpr bool is_double = std::is_same_v<Number, double>;
  static_assert(is_double || std::is_same_v<Number, std::uint64_t> || sizeof(Number) == 4);
  const std::string_view type = is_double ? "f64" : sizeof(Number) == 8 ? "u64" : "u32";
  const std::size_t count = sizeof(Member) / sizeof(Number);
  return {member, offset, type, count, kind, unit, page, in_c, csv, live};
}

}  // namespace tick_field

#define HAPTIC_TICK(member, kind, ...)                                                \
  tick_field::of<decltype(TickRecord::member)>(#member, offsetof(TickRecord, member), \
                                               TickKind::kind, __VA_ARGS__)
#define HAPTIC_AT(table, place, name) \
  TickPlace { TickTable::table, place, name }

/// Every member of TickRecord in its order: kind, unit, name in the page, name in C, then its
/// places in tables.
inline constexpr auto kTickFields = std::to_array({
    HAPTIC_TICK(force_n, kVector, "N", "force_w_n", "wrench", HAPTIC_AT(kCsv, 2, "fx_n,fy_n,fz_n"),
                HAPTIC_AT(kWrench, 0, "force_n")),
    HAPTIC_TICK(torque_nm, kVector, "N m", "torque_w_nm", "wrench",
                HAPTIC_AT(kCsv, 3, "tx_nm,ty_nm,tz_nm"), HAPTIC_AT(kWrench, 1, "torque_nm")),
    HAPTIC_TICK(goal_wa.p_m, kVector, "m", "goal_p_wa_m", kNotInC),
    HAPTIC_TICK(goal_wa.q_xyzw, kQuaternion, "1", "goal_q_wa_xyzw", kNotInC),
    HAPTIC_TICK(proxy_wa.p_m, kVector, "m", "proxy_p_wa_m", "felt_pose",
                HAPTIC_AT(kCsvPoses, 0, "proxy_x_m,proxy_y_m,proxy_z_m")),
    HAPTIC_TICK(proxy_wa.q_xyzw, kQuaternion, "1", "proxy_q_wa_xyzw", "felt_pose",
                HAPTIC_AT(kCsvPoses, 1, "proxy_qw,proxy_qx,proxy_qy,proxy_qz")),
    HAPTIC_TICK(goal_grip_m, kVector, "m", "goal_grip_w_m", kNotInC),
    HAPTIC_TICK(proxy_grip_m, kVector, "m", "proxy_grip_w_m", kNotInC),
    HAPTIC_TICK(proxy_gap_m, kNumber, "m", "proxy_gap_m", "gap_m",
                HAPTIC_AT(kCsv, 10, "proxy_gap_m"), HAPTIC_AT(kContact, 3, "proxy_gap_m")),
    HAPTIC_TICK(potential_j, kNumber, "J", "potential_j", kNotInC),
    HAPTIC_TICK(energy_j, kNumber, "J", "energy_j", kNotInC, HAPTIC_AT(kCsv, 11, "energy_j")),
    HAPTIC_TICK(d_near_m, kNumber, "m", "d_near_m", kNotInC, HAPTIC_AT(kCsv, 4, "d_near_m"),
                HAPTIC_AT(kContact, 4, "d_near_m")),
    HAPTIC_TICK(state_hash, kHash, "", "state_hash", "state_hash", HAPTIC_AT(kCsv, 9, "state_hash"),
                HAPTIC_AT(kCounters, 2, "state_hash")),
    HAPTIC_TICK(status, kRtStatus, "", "status", kNotInC),
    HAPTIC_TICK(flags, kFlags, "", "flags", "flags", HAPTIC_AT(kCsv, 8, "flags"),
                HAPTIC_AT(kContact, 1, "flags")),
    HAPTIC_TICK(situation, kSituation, "", "situation", "situation", HAPTIC_AT(kCsv, 5, "state"),
                HAPTIC_AT(kContact, 0, "situation")),
    HAPTIC_TICK(near_count, kCount, "", "near_count", "near_count",
                HAPTIC_AT(kCsv, 6, "near_count")),
    HAPTIC_TICK(nearest_pair, kCount, "", "nearest_pair", kNotInC),
    HAPTIC_TICK(has_goal_contact, kCount, "", "has_goal_contact", kNotInC),
    HAPTIC_TICK(behind_ticks, kCount, "", "behind_ticks", kNotInC),
    HAPTIC_TICK(work_units, kCount, "", "work_units", kNotInC),
    HAPTIC_TICK(felt_planes, kCount, "", "felt_planes", kNotInC),
    HAPTIC_TICK(felt_points, kCount, "", "felt_points", kNotInC),
    HAPTIC_TICK(guide.force_n, kVector, "N", "guide_force_w_n", kNotInC,
                HAPTIC_AT(kCsvGuide, 3, "guide_fx_n,guide_fy_n,guide_fz_n"),
                HAPTIC_AT(kGuide, 7, "force_n")),
    HAPTIC_TICK(guide.torque_nm, kVector, "N m", "guide_torque_w_nm", kNotInC,
                HAPTIC_AT(kCsvGuide, 4, "guide_tx_nm,guide_ty_nm,guide_tz_nm"),
                HAPTIC_AT(kGuide, 8, "torque_nm")),
    HAPTIC_TICK(guide.to_go_m, kNumber, "m", "guide_to_go_m", kNotInC,
                HAPTIC_AT(kCsvGuide, 5, "guide_to_go_m"), HAPTIC_AT(kGuide, 5, "to_go_m")),
    HAPTIC_TICK(guide.off_m, kNumber, "m", "guide_off_m", kNotInC,
                HAPTIC_AT(kCsvGuide, 6, "guide_off_m"), HAPTIC_AT(kGuide, 6, "off_m")),
    HAPTIC_TICK(guide.state, kGuideState, "", "guide_state", kNotInC,
                HAPTIC_AT(kCsvGuide, 0, "guide"), HAPTIC_AT(kGuide, 0, "state")),
    HAPTIC_TICK(guide.station, kCount, "", "guide_station", kNotInC,
                HAPTIC_AT(kCsvGuide, 1, "guide_station"), HAPTIC_AT(kGuide, 4, "station")),
    HAPTIC_TICK(guide.station, kGuidePlace, "", "", kNotInC, HAPTIC_AT(kCsvGuide, 2, "guide_place"),
                HAPTIC_AT(kGuide, 1, "place")),
    HAPTIC_TICK(guide.station, kGuideLeg, "", "", kNotInC, kNowhere, HAPTIC_AT(kGuide, 2, "leg")),
    HAPTIC_TICK(guide.station, kGuideLegs, "", "", kNotInC, kNowhere, HAPTIC_AT(kGuide, 3, "legs")),
    HAPTIC_TICK(tick, kCount, "", "tick", kNotInC, HAPTIC_AT(kCsv, 0, "tick"),
                HAPTIC_AT(kCounters, 0, "tick")),
    HAPTIC_TICK(t_s, kNumber, "s", "t_s", kNotInC, HAPTIC_AT(kCsv, 1, "t_s")),
    HAPTIC_TICK(device_wa.p_m, kVector, "m", "device_p_wa_m", kNotInC,
                HAPTIC_AT(kCsvPoses, 2, "device_x_m,device_y_m,device_z_m")),
    HAPTIC_TICK(device_wa.q_xyzw, kQuaternion, "1", "device_q_wa_xyzw", kNotInC,
                HAPTIC_AT(kCsvPoses, 3, "device_qw,device_qx,device_qy,device_qz")),
    HAPTIC_TICK(apart_m, kNumber, "m", "apart_m", kNotInC, kNowhere,
                HAPTIC_AT(kContact, 2, "device_to_part_m")),
    HAPTIC_TICK(pull_n, kNumber, "N", "pull_n", kNotInC),
    HAPTIC_TICK(in_contact, kCount, "", "in_contact", kNotInC),
    HAPTIC_TICK(nodes_evaluated, kCount, "", "nodes_evaluated", kNotInC,
                HAPTIC_AT(kCsv, 7, "nodes_evaluated"), HAPTIC_AT(kCounters, 1, "work_units")),
    HAPTIC_TICK(support_pairs, kCount, "", "support_pairs", kNotInC),
    HAPTIC_TICK(relocalised_pairs, kCount, "", "relocalised_pairs", kNotInC),
});
#undef HAPTIC_AT
#undef HAPTIC_TICK

/// True where the fields are all members, one behind the other.
[[nodiscard]] constexpr bool covers_record() {
  std::size_t end = 0;
  for (const TickField& field : kTickFields) {
    if (is_of_legs(field.kind)) continue;
    if (field.offset != end) return false;
    end += field.bytes();
  }
  return end == sizeof(TickRecord);
}
static_assert(covers_record(),
              "a member of TickRecord has no row in kTickFields, or there is a gap");

/// A field as a table shows it.
struct ShownField {
  const TickField* field = nullptr;
  std::string_view name;
};

namespace tick_field {

constexpr std::size_t shown_in(TickTable table) {
  std::size_t count = 0;
  for (const TickField& field : kTickFields)
    count += (field.csv.table == table ? 1u : 0u) + (field.live.table == table ? 1u : 0u);
  return count;
}
/// A place beyond the table's is no constant expression; one that is there twice leaves another
/// without a field and its name (by the name: with sanitizers an address is no constant to g++).
template <TickTable table>
inline constexpr auto kShown = [] {
  std::array<ShownField, shown_in(table)> shown{};
  for (const TickField& field : kTickFields) {
    for (const TickPlace& at : {field.csv, field.live})
      if (at.table == table) shown[at.place] = {&field, at.name};
  }
  return shown;
}();
constexpr bool is_whole(std::span<const ShownField> shown) {
  for (const ShownField& one : shown)
    if (one.name.empty()) return false;
  return true;
}

}  // namespace tick_field

/// The fields of a table in their order.
template <TickTable table>
[[nodiscard]] constexpr std::span<const ShownField> fields_of() {
  static_assert(tick_field::is_whole(tick_field::kShown<table>), "two fields have the same place");
  return tick_field::kShown<table>;
}

/// Number `k` of a field of type f64; a field of the other types.
[[nodiscard]] inline double number_of(const TickRecord& record, const TickField& field,
                                      std::size_t k = 0) noexcept {
  double number = 0;
  std::memcpy(&number, reinterpret_cast<const char*>(&record) + field.offset + k * sizeof number,
              sizeof number);
  return number;
}
[[nodiscard]] inline std::uint64_t count_of(const TickRecord& record,
                                            const TickField& field) noexcept {
  std::uint64_t count = 0;  // little-endian: the low bytes come first
  std::memcpy(&count, reinterpret_cast<const char*>(&record) + field.offset, field.bytes());
  return count;
}

}  // namespace haptic::tools
