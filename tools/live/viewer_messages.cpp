// SPDX-License-Identifier: Apache-2.0
#include "tools/live/viewer_messages.hpp"

#include <nlohmann/json.hpp>

#include "tools/live/topics.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

template <typename Number>
void append(std::string& out, Number value) {
  for (std::size_t k = 0; k < sizeof value; ++k)
    out += static_cast<char>(static_cast<std::uint8_t>(value >> (8 * k)));
}

}  // namespace

std::string foxglove_greeting(const std::string& session) {
  return text_of({{"op", "serverInfo"},
                  {"name", "haptic"},
                  {"capabilities", Json::array()},
                  {"supportedEncodings", Json::array({"json"})},
                  {"metadata", Json::object()},
                  {"sessionId", session}});
}

std::string foxglove_channels(bool knows_felt) {
  Json channels = Json::array();
  for (std::size_t k = 0; k < kTopics; ++k) {
    if (!knows_felt && static_cast<Topic>(k) == Topic::kFeltPose) continue;
    const TopicFacts& topic = topics()[k];
    channels.push_back({{"id", k + 1},
                        {"topic", topic.name},
                        {"encoding", "json"},
                        {"schemaName", topic.schema_name},
                        {"schema", topic.schema},
                        {"schemaEncoding", "jsonschema"}});
  }
  return text_of({{"op", "advertise"}, {"channels", std::move(channels)}});
}

std::string foxglove_complaint(const std::string& text) {
  constexpr int kWarning = 1;
  return text_of({{"op", "status"}, {"level", kWarning}, {"message", text}});
}

std::string foxglove_frame(std::uint32_t subscription, std::uint64_t time_ns,
                           std::string_view message) {
  std::string frame;
  frame.reserve(13 + message.size());
  frame += '\x01';
  append(frame, subscription);
  append(frame, time_ns);
  frame += message;
  return frame;
}

}  // namespace haptic::tools
