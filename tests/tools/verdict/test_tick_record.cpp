// SPDX-License-Identifier: Apache-2.0
// The record of a tick and the list of its fields: what a result leaves in it, the names that
// others read by, and the structures of C and Python against the list.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"
#include "tools/verdict/tick_record.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::sim::test::text_of_file;
using haptic::test::has;

namespace {

using Names = std::vector<std::string>;

std::string source_text(const char* path) {
  const std::string text = text_of_file(std::string(HAPTIC_SOURCE_DIR) + "/" + path);
  REQUIRE_FALSE(text.empty());
  return text;
}

/// A member of a structure of the C interface; types as in TickField, pointers as they are written.
struct Member {
  std::string name, type;
  std::size_t count = 1;
  bool operator==(const Member&) const = default;
};
using Members = std::vector<Member>;

std::string as_text(const Member& member) {
  return member.type + " " + member.name + "[" + std::to_string(member.count) + "]";
}

const Member* named(const Members& members, const std::string& name) {
  const auto found = std::ranges::find(members, name, &Member::name);
  return found == members.end() ? nullptr : &*found;
}

std::string type_named(const std::string& name) {
  static const std::map<std::string, std::string> types = {
      {"double", "f64"},   {"uint32_t", "u32"}, {"uint64_t", "u64"},
      {"c_double", "f64"}, {"c_uint32", "u32"}, {"c_uint64", "u64"},
      {"float64", "f64"},  {"uint32", "u32"},   {"uint64", "u64"}};
  const auto found = types.find(name);
  return found == types.end() ? name : found->second;
}

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin);
  if (from == std::string::npos) return {};
  const std::size_t at = from + begin.size();
  return text.substr(at, text.find(end, at) - at);
}

/// A structure of haptic.h, but for its size.
Members c_members(const std::string& header, const std::string& name) {
  std::string body = between(header, "typedef struct " + name + " {", "} " + name + ";");
  body = std::regex_replace(body, std::regex("//[^\n]*"), "");
  const std::regex declaration("(const )?([a-z0-9_]+\\*?)\\s+([^;]+);"),
      one("(\\w+)(\\[(\\d+)\\])?");
  Members members;
  for (std::sregex_iterator at(body.begin(), body.end(), declaration), end; at != end; ++at) {
    const std::string names = (*at)[3];
    for (std::sregex_iterator in(names.begin(), names.end(), one); in != end; ++in) {
      const std::string count = (*in)[3];
      members.push_back({(*in)[1], type_named((*at)[2]), count.empty() ? 1 : std::stoul(count)});
    }
  }
  std::erase_if(members, [](const Member& member) { return member.name == "struct_size"; });
  return members;
}

/// A structure of _library.py or session.py: what stands behind `begin`.
Members python_members(const std::string& source, const std::string& begin) {
  const std::string body = between(source, begin, "\n    ]");
  const std::regex line("\\(\"(\\w+)\", (np\\.)?(\\w+)( \\* (\\d+)|, (\\d+))?\\)");
  Members members;
  for (std::sregex_iterator at(body.begin(), body.end(), line), end; at != end; ++at) {
    const std::string count = (*at)[5].matched ? (*at)[5].str() : (*at)[6].str();
    members.push_back({(*at)[1], type_named((*at)[3]), count.empty() ? 1 : std::stoul(count)});
  }
  std::erase_if(members, [](const Member& member) { return member.name == "struct_size"; });
  return members;
}

/// The end of a name of a quantity in this unit.
std::string suffix_of(std::string_view unit) {
  if (unit.empty() || unit == "1") return "";
  if (unit == "N m") return "_nm";
  return unit == "J" ? "_j" : unit == "N" ? "_n" : "_" + std::string(unit);
}

/// Units of the members that are made of several fields (head of haptic.h).
const std::map<std::string, Names> kComposed = {{"wrench", {"N", "N m"}},
                                                {"felt_pose", {"m", "1"}}};
/// What a session says besides its newest tick.
const std::set<std::string> kOfSession = {
    "tick",          "time_s",     "link",           "hand_pose",      "sent_wrench",
    "arming",        "armings",    "safety_faults",  "hand_held",      "device_faults",
    "goals_reached", "late_ticks", "missed_periods", "longest_tick_s", "reserved"};
const std::set<std::string> kNotInState = {"near_count"};
const std::set<std::string> kNotInHistory = {"near_count", "felt_pose", "gap_m", "state_hash"};

struct Texts {
  std::string header = source_text("tools/library/haptic.h");
  std::string library = source_text("tools/python/haptic/_library.py");
  std::string session = source_text("tools/python/haptic/session.py");
  std::vector<TickField> fields{kTickFields.begin(), kTickFields.end()};
};

/// Members that the list wants in haptic_step_output, and what is wrong with their units.
Members wanted_members(const std::vector<TickField>& fields, Names& wrong) {
  Members wanted;
  std::map<std::string, Names> units;
  for (const TickField& field : fields) {
    if (field.in_c == kNotInC) continue;
    const std::string name(field.in_c);
    units[name].emplace_back(field.unit);
    const auto there = std::ranges::find(wanted, name, &Member::name);
    if (there == wanted.end())
      wanted.push_back({name, std::string(field.type), field.count});
    else
      there->count += field.count;
  }
  for (const auto& [name, of] : units) {
    const auto composed = kComposed.find(name);
    const bool fits = composed != kComposed.end()
                          ? of == composed->second
                          : of.size() == 1 && name.ends_with(suffix_of(of[0]));
    if (!fits) wrong.push_back("'" + name + "' of haptic_step_output is in another unit");
  }
  return wanted;
}

/// `members` are those of `wanted`, but for those of `without`; any others are in `besides`.
void compare(Names& wrong, const std::string& where, const Members& members, const Members& wanted,
             const std::set<std::string>& without = {}, const std::set<std::string>& besides = {}) {
  for (const Member& member : wanted) {
    const Member* const there = named(members, member.name);
    if (there == nullptr) {
      if (!without.contains(member.name)) wrong.push_back(where + " has no " + as_text(member));
    } else if (*there != member) {
      wrong.push_back(where + " has " + as_text(*there) + " for " + as_text(member));
    }
  }
  for (const Member& member : members) {
    if (named(wanted, member.name) == nullptr && !besides.contains(member.name))
      wrong.push_back(where + " has " + as_text(member) + ", which kTickFields has not");
  }
}

/// Types of the numbers of a structure, one behind the other.
Names numbers_of(const Members& members) {
  Names types;
  for (const Member& member : members) types.insert(types.end(), member.count, member.type);
  return types;
}

/// What of the structures of C and Python is not as the list has it.
Names differences(const Texts& texts) {
  Names wrong;
  const Members wanted = wanted_members(texts.fields, wrong);
  const Members step = c_members(texts.header, "haptic_step_output");
  const Members state = c_members(texts.header, "haptic_state");
  const Members history = c_members(texts.header, "haptic_tick");
  compare(wrong, "haptic_step_output", step, wanted);
  compare(wrong, "haptic_state", state, wanted, kNotInState, kOfSession);
  compare(wrong, "haptic_tick", history, wanted, kNotInHistory, kOfSession);
  const auto same = [&](const char* name, const Members& in_c) {
    const std::string begin = std::string("class ") + name + "(_Sized):";
    if (python_members(texts.library, begin) != in_c)
      wrong.push_back(std::string(name) + " of _library.py is not as in haptic.h");
  };
  same("StepOutput", step);
  same("StateOutput", state);
  if (numbers_of(python_members(texts.session, "TICK = np.dtype(")) != numbers_of(history))
    wrong.push_back("TICK of session.py is not as haptic_tick in haptic.h");
  return wrong;
}

std::string joined(const Names& names) {
  std::string text;
  for (const std::string& name : names) text += name + "\n";
  return text;
}

/// What is found after a change of one of the texts.
std::string found_after(std::string Texts::*text, const std::string& from, const std::string& to,
                        const Texts& texts) {
  Texts changed = texts;
  const std::size_t at = (changed.*text).find(from);
  REQUIRE(at != std::string::npos);
  (changed.*text).replace(at, from.size(), to);
  return joined(differences(changed));
}

template <TickTable table>
std::string names_in() {
  std::string names;
  for (const ShownField& shown : fields_of<table>())
    names.append(names.empty() ? "" : ",").append(shown.name);
  return names;
}

/// A result in which nothing is zero but its status.
StepResult full_result() {
  StepResult r;
  std::memset(static_cast<void*>(&r), 0x3f, sizeof r);
  r.has_goal_contact = true;
  r.status = RtStatus::kOk;
  r.situation = ContactSituation::kEdgeEdge;
  r.guidance.state = GuideState::kOn;
  r.goal_pose_wa = {Vec3(1.0_r, 2.0_r, 3.0_r), Quat(0.5_r, 0.5_r, 0.5_r, 0.5_r)};
  r.proxy_pose_wa = {Vec3(-4.0_r, 5.0_r, 6.0_r), Quat(0.5_r, -0.5_r, 0.5_r, -0.5_r)};
  return r;
}

}  // namespace

TEST_SUITE("tools.tick_record") {
  TEST_CASE("record_of: each field of the record has its number of the result") {
    StepResult result = full_result();
    const Vec3 grip_a(0.0_r, 0.0_r, 2.0_r);
    const TickRecord record = record_of(12, 0.5, result, LawId::kProxy, grip_a);
    const std::set<std::string_view> others_say = {"status", "felt_planes", "felt_points"};
    for (const TickField& field : kTickFields) {
      CAPTURE(field.member);
      if (field.type == "f64") {
        for (std::size_t k = 0; k < field.count; ++k) CHECK(number_of(record, field, k) != 0);
      } else {
        CHECK((count_of(record, field) == 0) == others_say.contains(field.member));
      }
    }
    CHECK(record.tick == 12);
    CHECK(record.torque_nm[2] == static_cast<double>(result.wrench_w.torque_w.z()));
    CHECK(record.guide.station == result.guidance.station);
    CHECK(record.guide.to_go_m == static_cast<double>(result.guidance.cost_m));
    CHECK(record.nodes_evaluated ==
          result.counters.feature_evaluations + result.counters.edge_pairs);
    CHECK(record.relocalised_pairs == result.counters.stale_pairs);
    CHECK(record.situation == ContactSituation::kEdgeEdge);
    const Pose back = record.proxy_wa;
    CHECK(back.p_wa == result.proxy_pose_wa.p_wa);
    CHECK(back.q_wa.coeffs() == result.proxy_pose_wa.q_wa.coeffs());
    const Vec3 grip_w = result.proxy_pose_wa.p_wa + result.proxy_pose_wa.q_wa * grip_a;
    for (int k = 0; k < 3; ++k) CHECK(record.proxy_grip_m[k] == static_cast<double>(grip_w[k]));
    for (const RtStatus status : {RtStatus::kOk, RtStatus::kPoseNotUnit}) {
      result.status = status;
      const JudgedTick judged = judged_tick(record_of(0, 0, result, LawId::kProxy));
      const JudgedTick of_result = judged_tick(result, LawId::kProxy);
      CHECK(judged.refused == of_result.refused);
      CHECK(judged.in_contact == of_result.in_contact);
      CHECK(judged.pull_n == of_result.pull_n);
      CHECK(judged.flags == of_result.flags);
      CHECK(judged.energy_j == of_result.energy_j);
    }
  }

  TEST_CASE("record_of: without a guide nothing of it is there") {
    StepResult result = full_result();
    result.guidance.state = GuideState::kNone;
    const TickGuide guide = record_of(0, 0, result, LawId::kProxy).guide;
    CHECK(guide.state == GuideState::kNone);
    CHECK(guide.force_n[0] == 0);
    CHECK(guide.station == 0);
  }

  TEST_CASE(
      "fields: kinds fit their types, names their unit, and no name of the page is there twice") {
    std::set<std::string_view> of_page;
    for (const TickField& field : kTickFields) {
      CAPTURE(field.member);
      const bool is_of_doubles = field.kind <= TickKind::kQuaternion;
      CHECK((field.type == "f64") == is_of_doubles);
      CHECK(field.count == (field.kind == TickKind::kVector       ? 3
                            : field.kind == TickKind::kQuaternion ? 4
                                                                  : 1));
      CHECK(field.unit.empty() == !is_of_doubles);
      CHECK(field.page.empty() == is_of_legs(field.kind));
      if (!field.page.empty()) CHECK(of_page.insert(field.page).second);
      // One column for each number.
      if (field.csv.table != TickTable::kNoTable)
        CHECK(std::ranges::count(field.csv.name, ',') + 1 == static_cast<int>(field.count));
      if (field.unit.empty() || field.unit == "1") continue;
      const std::string suffix = suffix_of(field.unit);
      const std::string member(field.member);
      CHECK(member.ends_with(suffix));
      CHECK(field.page.ends_with(suffix));
      for (const std::string_view name : {field.csv.name, field.live.name})
        CHECK((name.empty() || name.ends_with(suffix)));
    }
  }

  TEST_CASE("fields: columns, keys and exports keep their names and their order") {
    CHECK(names_in<TickTable::kCsv>() ==
          "tick,t_s,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm,d_near_m,state,near_count,nodes_evaluated,"
          "flags,state_hash,proxy_gap_m,energy_j");
    CHECK(names_in<TickTable::kCsvGuide>() ==
          "guide,guide_station,guide_place,guide_fx_n,guide_fy_n,guide_fz_n,guide_tx_nm,"
          "guide_ty_nm,guide_tz_nm,guide_to_go_m,guide_off_m");
    CHECK(names_in<TickTable::kCsvPoses>() ==
          "proxy_x_m,proxy_y_m,proxy_z_m,proxy_qw,proxy_qx,proxy_qy,proxy_qz,device_x_m,"
          "device_y_m,device_z_m,device_qw,device_qx,device_qy,device_qz");
    // Keys and exports that came later follow these.
    CHECK(names_in<TickTable::kWrench>().starts_with("force_n,torque_nm"));
    CHECK(names_in<TickTable::kContact>().starts_with(
        "situation,flags,device_to_part_m,proxy_gap_m,d_near_m"));
    CHECK(names_in<TickTable::kCounters>().starts_with("tick,work_units,state_hash"));
    CHECK(names_in<TickTable::kGuide>().starts_with(
        "state,place,leg,legs,station,to_go_m,off_m,force_n,torque_nm"));
    std::string exports;
    for (const TickField& field : kTickFields)
      if (!field.page.empty()) exports.append(field.page).append(" ");
    CHECK(exports.starts_with(
        "force_w_n torque_w_nm goal_p_wa_m goal_q_wa_xyzw proxy_p_wa_m proxy_q_wa_xyzw "
        "goal_grip_w_m proxy_grip_w_m proxy_gap_m potential_j energy_j d_near_m state_hash status "
        "flags situation near_count nearest_pair has_goal_contact behind_ticks work_units "
        "felt_planes felt_points guide_force_w_n guide_torque_w_nm guide_to_go_m guide_off_m "
        "guide_state guide_station "));
  }

  TEST_CASE("C and Python: their structures have the fields of the list, in its types and units") {
    const Texts texts;
    CHECK(joined(differences(texts)) == "");
    CHECK(c_members(texts.header, "haptic_step_output").size() == 7);
    CHECK(c_members(texts.header, "haptic_state").size() == 21);
    CHECK(c_members(texts.header, "haptic_tick").size() == 9);
  }

  TEST_CASE(
      "C and Python: a field in one and not in the other, of another type or unit, is found") {
    const Texts texts;
    const auto header = [&](const std::string& from, const std::string& to) {
      return found_after(&Texts::header, from, to, texts);
    };
    CHECK(has(header("uint32_t near_count;", ""), "haptic_step_output has no u32 near_count[1]"));
    CHECK(has(header("uint32_t near_count;", "uint32_t near_count; double new_j;"),
              "haptic_step_output has f64 new_j[1], which kTickFields has not"));
    CHECK(has(header("double felt_pose[7]", "float felt_pose[7]"),
              "haptic_step_output has float felt_pose[7] for f64 felt_pose[7]"));
    CHECK(has(header("double wrench[6];     ///< on the hand", "double wrench[3];"),
              "has f64 wrench[3] for f64 wrench[6]"));
    CHECK(has(header("double gap_m;", "double gap_mm;"), "haptic_step_output has no f64 gap_m[1]"));
    CHECK(has(header("uint32_t situation, flags;  ///< as", "uint32_t situation;  ///< as"),
              "haptic_state has no u32 flags[1]"));
    CHECK(has(header("uint64_t late_ticks;", "uint64_t late_ticks, new_ticks;"),
              "haptic_state has u64 new_ticks[1], which"));
    CHECK(has(header("uint32_t situation, flags, arming, safety_faults;",
                     "uint32_t situation, arming, safety_faults; uint64_t flags;"),
              "haptic_tick has u64 flags[1] for u32 flags[1]"));

    const auto library = [&](const std::string& from, const std::string& to) {
      return found_after(&Texts::library, from, to, texts);
    };
    CHECK(
        has(library("(\"near_count\", c_uint32)", "(\"near_count\", c_uint64)"), "StepOutput of"));
    CHECK(has(library("(\"hand_held\", c_uint32),", ""), "StateOutput of _library.py is not as"));
    CHECK(has(found_after(&Texts::session, "(\"hand_pose\", np.float64, 7)",
                          "(\"hand_pose\", np.float64, 3)", texts),
              "TICK of session.py"));

    const auto field = [&](std::string_view member, auto change) {
      Texts changed = texts;
      change(*std::ranges::find(changed.fields, member, &TickField::member));
      return joined(differences(changed));
    };
    CHECK(has(field("energy_j", [](TickField& f) { f.in_c = "energy_j"; }),
              "haptic_step_output has no f64 energy_j[1]"));
    CHECK(has(field("flags", [](TickField& f) { f.in_c = kNotInC; }),
              "haptic_step_output has u32 flags[1], which kTickFields has not"));
    CHECK(has(field("proxy_gap_m", [](TickField& f) { f.unit = "mm"; }),
              "'gap_m' of haptic_step_output is in another unit"));
    CHECK(has(field("torque_nm", [](TickField& f) { f.unit = "N mm"; }),
              "'wrench' of haptic_step_output is in another unit"));
    CHECK(has(field("state_hash", [](TickField& f) { f.type = "u32"; }),
              "has u64 state_hash[1] for u32 state_hash[1]"));
  }
}
