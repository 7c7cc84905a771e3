// SPDX-License-Identifier: Apache-2.0
#include "tools/live/topics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/scene/part_scenes.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/movers.hpp"
#include "tools/verdict/flag_names.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNumber = R"({"type":"number"})";

/// Name and schema of a member of an object.
using Member = std::pair<std::string_view, const char*>;

std::string schema_of(const char* title, const std::vector<Member>& members) {
  std::string text = std::string(R"({"title":")") + title + R"(","type":"object","properties":{)";
  const char* comma = "";
  for (const auto& [name, kind] : members) {
    text += std::string(comma) + "\"" + std::string(name) + "\":" + kind;
    comma = ",";
  }
  return text + "}}";
}

const std::string kTime =
    R"({"type":"object","title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer","minimum":0,"maximum":999999999}}})";
const std::string kVector =
    R"({"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}})";
const std::string kQuaternion =
    R"({"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}})";
const std::string kPose = R"({"type":"object","properties":{"position":)" + kVector +
                          R"(,"orientation":)" + kQuaternion + "}}";
constexpr const char* kText = R"({"type":"string"})";
constexpr const char* kInteger = R"({"type":"integer"})";
constexpr const char* kTexts = R"({"type":"array","items":{"type":"string"}})";
constexpr const char* kObjects = R"({"type":"array","items":{"type":"object"}})";

Json time_of(std::uint64_t ns) {
  return {{"sec", ns / 1'000'000'000u}, {"nsec", ns % 1'000'000'000u}};
}
template <typename Three>
Json vector_json(const Three& v) {
  return {{"x", unsigned_zero(v[0])}, {"y", unsigned_zero(v[1])}, {"z", unsigned_zero(v[2])}};
}
Json quaternion_json(const double (&xyzw)[4]) {
  return {{"x", unsigned_zero(xyzw[0])},
          {"y", unsigned_zero(xyzw[1])},
          {"z", unsigned_zero(xyzw[2])},
          {"w", unsigned_zero(xyzw[3])}};
}

/// A number that JSON can hold; null where it is none.
Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json pose_message(const PoseNumbers& pose, std::uint64_t ns) {
  return {{"timestamp", time_of(ns)},
          {"frame_id", "w"},
          {"pose",
           {{"position", vector_json(pose.p_m)}, {"orientation", quaternion_json(pose.q_xyzw)}}}};
}

Json frame_message(const std::string& frame, const PoseNumbers& pose, std::uint64_t ns) {
  return {{"timestamp", time_of(ns)},
          {"parent_frame_id", "w"},
          {"child_frame_id", frame},
          {"translation", vector_json(pose.p_m)},
          {"rotation", quaternion_json(pose.q_xyzw)}};
}

/// Red, green, blue, opacity.
using Colour = std::array<double, 4>;
constexpr Colour kHeldColour = {0.3, 0.53, 0.71, 1.0}, kFixedColour = {0.76, 0.79, 0.82, 0.6},
                 kDrivenColour = {0.55, 0.5, 0.72, 0.6};

/// Name, frame and colour of an entity.
struct EntityLook {
  std::string id, frame;
  Colour colour;
};

/// The triangles of one body: of a moving one about its mesh frame, of the others in W.
Json entity_of(const SceneView& scene, std::uint32_t body, const EntityLook& look) {
  const BodyRecord& record = scene.bodies()[body];
  Json points = Json::array();
  for (std::uint32_t p = 0; p < record.piece_count; ++p) {
    const PieceView piece = scene.piece(record.piece_begin + p);
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      if (piece.faces[f].source_face < 0) continue;  // a cut between pieces
      const auto loop = piece.face_vertices(f);
      for (std::size_t k = 2; k < loop.size(); ++k) {
        for (const std::size_t corner : {std::size_t{0}, k - 1, k}) {
          const Eigen::Vector3d at = piece.vertex(loop[corner]).cast<double>();
          points.push_back(
              vector_json(std::array{at[0] + record.reference_m[0], at[1] + record.reference_m[1],
                                     at[2] + record.reference_m[2]}));
        }
      }
    }
  }
  const Colour& c = look.colour;
  const Json colour = {{"r", c[0]}, {"g", c[1]}, {"b", c[2]}, {"a", c[3]}};
  const Json origin = {{"position", vector_json(std::array{0.0, 0.0, 0.0})},
                       {"orientation", quaternion_json({0, 0, 0, 1})}};
  return {{"timestamp", time_of(0)},
          {"frame_id", look.frame},
          {"id", look.id},
          {"lifetime", time_of(0)},
          {"frame_locked", true},
          {"metadata", Json::array()},
          {"arrows", Json::array()},
          {"cubes", Json::array()},
          {"spheres", Json::array()},
          {"cylinders", Json::array()},
          {"lines", Json::array()},
          {"triangles", Json::array({{{"pose", origin},
                                      {"points", std::move(points)},
                                      {"color", colour},
                                      {"colors", Json::array()},
                                      {"indices", Json::array()}}})},
          {"texts", Json::array()},
          {"models", Json::array()}};
}

std::string driven_frame(const PartScenes& parts, std::uint32_t driven) {
  const std::uint32_t part = part_of_mover(parts, driven);
  const bool is_loose = parts[part].role == PartRole::kLoose;
  const char* const kind = is_held_by_second(parts, driven) ? "hand2/"
                           : is_loose                       ? "loose/"
                                                            : "driven/";
  return kind + std::string(parts.name(part));
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Json field_json(const TickRecord& tick, const TickField& field, const GuideLegs& legs) {
  switch (field.kind) {
    case TickKind::kNumber:
      return number_json(number_of(tick, field));
    case TickKind::kVector:
      return vector_json(
          std::array{number_of(tick, field), number_of(tick, field, 1), number_of(tick, field, 2)});
    case TickKind::kQuaternion:
      return quaternion_json({number_of(tick, field), number_of(tick, field, 1),
                              number_of(tick, field, 2), number_of(tick, field, 3)});
    case TickKind::kCount:
      return count_of(tick, field);
    case TickKind::kHash:
      return hash_text(count_of(tick, field));
    case TickKind::kFlags:
      return flag_names(tick.flags);
    case TickKind::kRtStatus:
      return to_text(tick.status);
    case TickKind::kSituation:
      return to_text(tick.situation);
    case TickKind::kGuideState:
      return to_text(tick.guide.state);
    case TickKind::kGuidePlace:
      return legs.place(tick.guide.state, tick.guide.station);
    case TickKind::kGuideLeg:
      return legs.leg_of(tick.guide.station) + 1;
    case TickKind::kGuideLegs:
      return legs.count();
  }
  return {};
}

/// The schema of an object of these fields, by the values that they begin with.
std::string schema_of(const char* title, std::span<const ShownField> fields) {
  std::vector<Member> members;
  for (const ShownField& shown : fields) {
    const Json value = field_json({}, *shown.field, {});
    members.emplace_back(shown.name, value.is_string()         ? kText
                                     : value.is_array()        ? kTexts
                                     : value.is_object()       ? kVector.c_str()
                                     : value.is_number_float() ? kNumber
                                                               : kInteger);
  }
  return schema_of(title, members);
}

std::string fields_text(const TickRecord& tick, std::span<const ShownField> fields,
                        const GuideLegs& legs) {
  Json json;
  for (const ShownField& shown : fields)
    json[std::string(shown.name)] = field_json(tick, *shown.field, legs);
  return text_of(json);
}

constexpr int kInfo = 2, kWarning = 3;

std::string log_text(std::uint64_t ns, int level, const std::string& words) {
  return text_of(
      {{"timestamp", time_of(ns)}, {"level", level}, {"message", words}, {"name", "core"}});
}

}  // namespace

const std::array<TopicFacts, kTopics>& topics() {
  static const std::string pose =
      schema_of("foxglove.PoseInFrame",
                {{"timestamp", kTime.c_str()}, {"frame_id", kText}, {"pose", kPose.c_str()}});
  static const std::array<TopicFacts, kTopics> all = {{
      {"/scene", "foxglove.SceneUpdate",
       schema_of("foxglove.SceneUpdate", {{"deletions", kObjects}, {"entities", kObjects}})},
      {"/tf", "foxglove.FrameTransform",
       schema_of("foxglove.FrameTransform", {{"timestamp", kTime.c_str()},
                                             {"parent_frame_id", kText},
                                             {"child_frame_id", kText},
                                             {"translation", kVector.c_str()},
                                             {"rotation", kQuaternion.c_str()}})},
      {"/pose", "foxglove.PoseInFrame", pose},
      {"/felt_pose", "foxglove.PoseInFrame", pose},
      {"/wrench", "haptic.Wrench", schema_of("haptic.Wrench", fields_of<TickTable::kWrench>())},
      {"/contact", "haptic.Contact", schema_of("haptic.Contact", fields_of<TickTable::kContact>())},
      {"/counters", "haptic.Counters",
       schema_of("haptic.Counters", fields_of<TickTable::kCounters>())},
      {"/guide", "haptic.Guide", schema_of("haptic.Guide", fields_of<TickTable::kGuide>())},
      {"/log", "foxglove.Log",
       schema_of("foxglove.Log", {{"timestamp", kTime.c_str()},
                                  {"level", kInteger},
                                  {"message", kText},
                                  {"name", kText}})},
  }};
  return all;
}

std::uint64_t topic_time_ns(const TickRecord& tick) {
  return static_cast<std::uint64_t>(std::llround(tick.t_s * 1e9));
}

std::string scene_message(const SceneView& scene) {
  PartScenes parts;
  const bool has_driven = PartScenes::open(scene, parts) == RtStatus::kOk && mover_count(parts) > 0;
  // In the scene of the part that is held at first no other that moves stands, but where nothing
  // else does.
  SceneView held = scene;
  if (has_driven && SceneView::open(parts.scene_of(0), held) != RtStatus::kOk) held = scene;
  Json entities = Json::array();
  for (std::uint32_t body = 0; body < held.bodies().size(); ++body) {
    if (body > 0 && has_driven && !parts.meets_standing(0)) break;
    const BodyRecord& record = held.bodies()[body];
    const std::string name(held.text(record.name_offset, record.name_bytes));
    entities.push_back(entity_of(held, body,
                                 {std::to_string(body) + " " + name, body == 0 ? "part" : "w",
                                  body == 0 ? kHeldColour : kFixedColour}));
  }
  for (std::uint32_t k = 0; has_driven && k < mover_count(parts); ++k) {
    SceneView shape;
    std::uint32_t body = 0;
    if (!open_mover_shape(parts, k, shape, body)) continue;
    const std::string frame = driven_frame(parts, k);
    entities.push_back(entity_of(shape, body, {frame, frame, kDrivenColour}));
  }
  return text_of({{"deletions", Json::array()}, {"entities", std::move(entities)}});
}

std::string tick_message(Topic topic, const TickRecord& tick, const GuideLegs& legs) {
  const std::uint64_t ns = topic_time_ns(tick);
  switch (topic) {
    case Topic::kFrames:
      return text_of(frame_message("part", tick.proxy_wa, ns));
    case Topic::kPose:
      return text_of(pose_message(tick.device_wa, ns));
    case Topic::kFeltPose:
      return text_of(pose_message(tick.proxy_wa, ns));
    case Topic::kWrench:
      return fields_text(tick, fields_of<TickTable::kWrench>(), legs);
    case Topic::kContact:
      return fields_text(tick, fields_of<TickTable::kContact>(), legs);
    case Topic::kCounters:
      return fields_text(tick, fields_of<TickTable::kCounters>(), legs);
    case Topic::kGuide:
      if (legs.empty() || tick.guide.state == GuideState::kNone) return {};
      return fields_text(tick, fields_of<TickTable::kGuide>(), legs);
    case Topic::kScene:
    case Topic::kLog:
      break;
  }
  return {};
}

DrivenFrames::DrivenFrames(const SceneView& scene) {
  PartScenes parts;
  if (PartScenes::open(scene, parts) != RtStatus::kOk || parts.count() == 0) return;
  for (std::uint32_t k = 0; k < mover_count(parts); ++k) names_.push_back(driven_frame(parts, k));
}

std::vector<std::string> DrivenFrames::messages(const TickRecord& tick,
                                                std::span<const DrivenTick> driven) const {
  std::vector<std::string> all;
  for (std::size_t k = 0; k < std::min(names_.size(), driven.size()); ++k)
    all.push_back(text_of(frame_message(names_[k], driven[k].felt_wa, topic_time_ns(tick))));
  return all;
}

std::vector<std::string> LogTopic::messages(const TickRecord& tick) {
  const std::uint64_t ns = topic_time_ns(tick);
  std::vector<std::string> all;
  if (tick.situation != situation_) all.push_back(log_text(ns, kInfo, to_text(tick.situation)));
  for (const std::string& name : flag_names(tick.flags & ~flags_))
    all.push_back(log_text(ns, kWarning, name));
  situation_ = tick.situation;
  flags_ = tick.flags;
  return all;
}

}  // namespace haptic::tools
