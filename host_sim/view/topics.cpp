// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/topics.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/session/replay_summary.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNumber = R"({"type":"number"})";

/// A JSON schema of an object whose members are all of one kind.
std::string schema_of(const char* title,
                      std::initializer_list<std::pair<const char*, const char*>> members) {
  std::string text = std::string(R"({"title":")") + title + R"(","type":"object","properties":{)";
  const char* comma = "";
  for (const auto& [name, kind] : members) {
    text += std::string(comma) + "\"" + name + "\":" + kind;
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
template <typename Number>
double number_of(Number x) {
  return tools::unsigned_zero(static_cast<double>(x));
}
template <typename Three>
Json vector_json(const Three& v) {
  return {{"x", number_of(v[0])}, {"y", number_of(v[1])}, {"z", number_of(v[2])}};
}
Json quaternion_json(const Quat& q) {
  return {{"x", number_of(q.x())},
          {"y", number_of(q.y())},
          {"z", number_of(q.z())},
          {"w", number_of(q.w())}};
}

/// A number that JSON can hold; null where it is none.
Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json pose_message(const Pose& pose, std::uint64_t ns) {
  return {{"timestamp", time_of(ns)},
          {"frame_id", "w"},
          {"pose",
           {{"position", vector_json(pose.p_wa)}, {"orientation", quaternion_json(pose.q_wa)}}}};
}

/// The triangles of one body: of the moving one about its mesh frame, of the others in W.
Json entity_of(const SceneView& scene, std::uint32_t body) {
  const BodyRecord& record = scene.bodies()[body];
  Json points = Json::array();
  for (std::uint32_t p = 0; p < record.piece_count; ++p) {
    const PieceView piece = scene.piece(record.piece_begin + p);
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      if (piece.faces[f].source_face < 0) continue;  // a cut between pieces
      const auto loop = piece.face_vertices(f);
      for (std::size_t k = 2; k < loop.size(); ++k) {
        for (const std::size_t corner : {std::size_t{0}, k - 1, k}) {
          const Vector at = piece.vertex(loop[corner]).cast<double>();
          points.push_back(
              vector_json(std::array{at[0] + record.reference_m[0], at[1] + record.reference_m[1],
                                     at[2] + record.reference_m[2]}));
        }
      }
    }
  }
  const Json colour = body == 0 ? Json{{"r", 0.3}, {"g", 0.53}, {"b", 0.71}, {"a", 1.0}}
                                : Json{{"r", 0.76}, {"g", 0.79}, {"b", 0.82}, {"a", 0.6}};
  const Json origin = {{"position", vector_json(std::array{0.0, 0.0, 0.0})},
                       {"orientation", quaternion_json(Quat::Identity())}};
  const std::string name(scene.text(record.name_offset, record.name_bytes));
  return {{"timestamp", time_of(0)},
          {"frame_id", body == 0 ? "part" : "w"},
          {"id", std::to_string(body) + " " + name},
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

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
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
      {"/wrench", "haptic.Wrench",
       schema_of("haptic.Wrench", {{"force_n", kVector.c_str()}, {"torque_nm", kVector.c_str()}})},
      {"/contact", "haptic.Contact",
       schema_of("haptic.Contact", {{"situation", kText},
                                    {"flags", kTexts},
                                    {"device_to_part_m", kNumber},
                                    {"proxy_gap_m", kNumber},
                                    {"d_near_m", kNumber}})},
      {"/counters", "haptic.Counters",
       schema_of("haptic.Counters",
                 {{"tick", kInteger}, {"work_units", kInteger}, {"state_hash", kText}})},
      {"/guide", "haptic.Guide",
       schema_of("haptic.Guide", {{"state", kText},
                                  {"place", kText},
                                  {"leg", kInteger},
                                  {"legs", kInteger},
                                  {"station", kInteger},
                                  {"to_go_m", kNumber},
                                  {"off_m", kNumber},
                                  {"force_n", kVector.c_str()},
                                  {"torque_nm", kVector.c_str()}})},
      {"/log", "foxglove.Log",
       schema_of("foxglove.Log", {{"timestamp", kTime.c_str()},
                                  {"level", kInteger},
                                  {"message", kText},
                                  {"name", kText}})},
  }};
  return all;
}

std::uint64_t topic_time_ns(const LoopRecord& record) {
  return static_cast<std::uint64_t>(std::llround(record.tick.t_s * 1e9));
}

std::string scene_message(const SceneView& scene) {
  Json entities = Json::array();
  for (std::uint32_t body = 0; body < scene.bodies().size(); ++body)
    entities.push_back(entity_of(scene, body));
  return text_of({{"deletions", Json::array()}, {"entities", std::move(entities)}});
}

std::string tick_message(Topic topic, const LoopRecord& record, const GuideLegs& legs) {
  const TickRecord& tick = record.tick;
  const std::uint64_t ns = topic_time_ns(record);
  switch (topic) {
    case Topic::kFrames:
      return text_of({{"timestamp", time_of(ns)},
                      {"parent_frame_id", "w"},
                      {"child_frame_id", "part"},
                      {"translation", vector_json(record.tick.proxy_wa.p_wa)},
                      {"rotation", quaternion_json(record.tick.proxy_wa.q_wa)}});
    case Topic::kPose:
      return text_of(pose_message(record.tick.device_wa, ns));
    case Topic::kFeltPose:
      return text_of(pose_message(record.tick.proxy_wa, ns));
    case Topic::kWrench:
      return text_of(
          {{"force_n", vector_json(tick.force_n)}, {"torque_nm", vector_json(tick.torque_nm)}});
    case Topic::kContact:
      return text_of({{"situation", to_text(tick.situation)},
                      {"flags", flag_names(tick.flags)},
                      {"device_to_part_m", number_json(tick.apart_m)},
                      {"proxy_gap_m", number_json(tick.proxy_gap_m)},
                      {"d_near_m", number_json(tick.d_near_m)}});
    case Topic::kCounters:
      return text_of({{"tick", tick.tick},
                      {"work_units", tick.nodes_evaluated},
                      {"state_hash", tools::hash_text(tick.state_hash)}});
    case Topic::kGuide: {
      const TickGuide& guide = tick.guide;
      if (legs.empty() || guide.state == GuideState::kNone) return {};
      return text_of({{"state", to_text(guide.state)},
                      {"place", legs.place(guide.state, guide.station)},
                      {"leg", legs.leg_of(guide.station) + 1},
                      {"legs", legs.count()},
                      {"station", guide.station},
                      {"to_go_m", number_json(guide.to_go_m)},
                      {"off_m", number_json(guide.off_m)},
                      {"force_n", vector_json(guide.force_n)},
                      {"torque_nm", vector_json(guide.torque_nm)}});
    }
    case Topic::kScene:
    case Topic::kLog:
      break;
  }
  return {};
}

std::vector<std::string> LogTopic::messages(const LoopRecord& record) {
  const TickRecord& tick = record.tick;
  const std::uint64_t ns = topic_time_ns(record);
  std::vector<std::string> all;
  if (tick.situation != situation_) all.push_back(log_text(ns, kInfo, to_text(tick.situation)));
  for (const std::string& name : flag_names(tick.flags & ~flags_))
    all.push_back(log_text(ns, kWarning, name));
  situation_ = tick.situation;
  flags_ = tick.flags;
  return all;
}

}  // namespace haptic::sim
