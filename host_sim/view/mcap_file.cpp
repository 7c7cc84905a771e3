// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/mcap_file.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/session/replay_summary.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kDataEnd = 0x0F
};

/// Little-endian, as the format has it.
template <typename Number>
void put_number(std::string& out, Number value) {
  for (std::size_t k = 0; k < sizeof value; ++k)
    out += static_cast<char>(static_cast<std::uint8_t>(value >> (8 * k)));
}

/// With its length before it.
void put_text(std::string& out, std::string_view text) {
  put_number(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

void put_record(std::string& out, Opcode opcode, std::string_view content) {
  out += static_cast<char>(opcode);
  put_number(out, static_cast<std::uint64_t>(content.size()));
  out += content;
}

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
template <typename Three>
Json vector_json(const Three& v) {
  return {{"x", static_cast<double>(v[0])},
          {"y", static_cast<double>(v[1])},
          {"z", static_cast<double>(v[2])}};
}
Json quaternion_json(const Quat& q) {
  return {{"x", static_cast<double>(q.x())},
          {"y", static_cast<double>(q.y())},
          {"z", static_cast<double>(q.z())},
          {"w", static_cast<double>(q.w())}};
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

}  // namespace

McapWriter::McapWriter(std::string_view profile, std::string_view library) : file_(kMagic) {
  std::string content;
  put_text(content, profile);
  put_text(content, library);
  put_record(file_, kHeader, content);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name,
                                      std::string_view schema) {
  channels_ += 1;
  std::string content;
  put_number(content, channels_);
  put_text(content, schema_name);
  put_text(content, "jsonschema");
  put_text(content, schema);
  put_record(file_, kSchema, content);
  content.clear();
  put_number(content, channels_);
  put_number(content, channels_);  // of its schema
  put_text(content, topic);
  put_text(content, "json");
  put_number(content, std::uint32_t{0});  // no metadata
  put_record(file_, kChannel, content);
  return channels_;
}

void McapWriter::add_message(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  std::string content;
  put_number(content, channel);
  put_number(content, messages_[channel]++);
  put_number(content, time_ns);  // logged
  put_number(content, time_ns);  // published
  content += json;
  put_record(file_, kMessage, content);
}

std::string McapWriter::finish() {
  put_record(file_, kDataEnd, std::string(4, '\0'));  // no check sum
  put_record(file_, kFooter, std::string(20, '\0'));  // no summary
  return std::move(file_) + std::string(kMagic);
}

std::string mcap_of(const SceneView& scene, std::span<const LoopRecord> records) {
  McapWriter writer("", "haptic");
  const std::uint16_t scene_channel = writer.add_channel(
      "/scene", "foxglove.SceneUpdate",
      schema_of("foxglove.SceneUpdate", {{"deletions", kObjects}, {"entities", kObjects}}));
  const std::uint16_t frames =
      writer.add_channel("/tf", "foxglove.FrameTransform",
                         schema_of("foxglove.FrameTransform", {{"timestamp", kTime.c_str()},
                                                               {"parent_frame_id", kText},
                                                               {"child_frame_id", kText},
                                                               {"translation", kVector.c_str()},
                                                               {"rotation", kQuaternion.c_str()}}));
  const std::string pose =
      schema_of("foxglove.PoseInFrame",
                {{"timestamp", kTime.c_str()}, {"frame_id", kText}, {"pose", kPose.c_str()}});
  const std::uint16_t device = writer.add_channel("/pose", "foxglove.PoseInFrame", pose);
  const std::uint16_t felt = writer.add_channel("/felt_pose", "foxglove.PoseInFrame", pose);
  const std::uint16_t wrench = writer.add_channel(
      "/wrench", "haptic.Wrench",
      schema_of("haptic.Wrench", {{"force_n", kVector.c_str()}, {"torque_nm", kVector.c_str()}}));
  const std::uint16_t contact =
      writer.add_channel("/contact", "haptic.Contact",
                         schema_of("haptic.Contact", {{"situation", kText},
                                                      {"flags", kTexts},
                                                      {"device_to_part_m", kNumber},
                                                      {"proxy_gap_m", kNumber},
                                                      {"d_near_m", kNumber}}));
  const std::uint16_t counters = writer.add_channel(
      "/counters", "haptic.Counters",
      schema_of("haptic.Counters",
                {{"tick", kInteger}, {"work_units", kInteger}, {"state_hash", kText}}));
  const std::uint16_t log =
      writer.add_channel("/log", "foxglove.Log",
                         schema_of("foxglove.Log", {{"timestamp", kTime.c_str()},
                                                    {"level", kInteger},
                                                    {"message", kText},
                                                    {"name", kText}}));

  Json entities = Json::array();
  for (std::uint32_t body = 0; body < scene.bodies().size(); ++body)
    entities.push_back(entity_of(scene, body));
  writer.add_message(scene_channel, 0,
                     text_of({{"deletions", Json::array()}, {"entities", std::move(entities)}}));

  constexpr int kInfo = 2, kWarning = 3;
  std::uint32_t last_flags = 0;
  ContactSituation last_situation = ContactSituation::kNone;
  for (const LoopRecord& record : records) {
    const TickRecord& tick = record.tick;
    const auto ns = static_cast<std::uint64_t>(std::llround(tick.t_s * 1e9));
    writer.add_message(frames, ns,
                       text_of({{"timestamp", time_of(ns)},
                                {"parent_frame_id", "w"},
                                {"child_frame_id", "part"},
                                {"translation", vector_json(record.proxy_wa.p_wa)},
                                {"rotation", quaternion_json(record.proxy_wa.q_wa)}}));
    writer.add_message(device, ns, text_of(pose_message(record.device_wa, ns)));
    writer.add_message(felt, ns, text_of(pose_message(record.proxy_wa, ns)));
    writer.add_message(wrench, ns,
                       text_of({{"force_n", vector_json(tick.force_n)},
                                {"torque_nm", vector_json(tick.torque_nm)}}));
    writer.add_message(contact, ns,
                       text_of({{"situation", to_text(tick.situation)},
                                {"flags", flag_names(tick.flags)},
                                {"device_to_part_m", number_json(tick.apart_m)},
                                {"proxy_gap_m", number_json(tick.proxy_gap_m)},
                                {"d_near_m", number_json(tick.d_near_m)}}));
    writer.add_message(counters, ns,
                       text_of({{"tick", tick.tick},
                                {"work_units", tick.nodes_evaluated},
                                {"state_hash", tools::hash_text(tick.state_hash)}}));
    const auto say = [&](int level, const std::string& words) {
      writer.add_message(log, ns,
                         text_of({{"timestamp", time_of(ns)},
                                  {"level", level},
                                  {"message", words},
                                  {"name", "core"}}));
    };
    if (tick.situation != last_situation) say(kInfo, to_text(tick.situation));
    for (const std::string& name : flag_names(tick.flags & ~last_flags)) say(kWarning, name);
    last_situation = tick.situation;
    last_flags = tick.flags;
  }
  return writer.finish();
}

}  // namespace haptic::sim
