// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/mcap_file.hpp"

#include <array>

#include "tools/live/topics.hpp"

namespace haptic::sim {
namespace {

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

std::string mcap_of(const SceneView& scene, std::span<const LoopRecord> records,
                    std::span<const tools::DrivenTick> driven) {
  McapWriter writer("", "haptic");
  std::array<std::uint16_t, tools::kTopics> channels{};
  for (std::size_t k = 0; k < tools::kTopics; ++k)
    channels[k] = writer.add_channel(tools::topics()[k].name, tools::topics()[k].schema_name,
                                     tools::topics()[k].schema);
  const auto channel = [&](tools::Topic topic) {
    return channels[static_cast<std::size_t>(topic)];
  };

  writer.add_message(channel(tools::Topic::kScene), 0, tools::scene_message(scene));
  tools::LogTopic log;
  const GuideLegs legs(scene);
  const tools::DrivenFrames frames(scene);
  const std::size_t driven_parts = records.empty() ? 0 : driven.size() / records.size();
  for (std::size_t k = 0; k < records.size(); ++k) {
    const TickRecord& tick = records[k].tick;
    const std::uint64_t ns = tools::topic_time_ns(tick);
    for (const tools::Topic topic : tools::kTickTopics) {
      const std::string message = tools::tick_message(topic, tick, legs);
      if (!message.empty()) writer.add_message(channel(topic), ns, message);
    }
    for (const std::string& message :
         frames.messages(tick, driven.subspan(k * driven_parts, driven_parts)))
      writer.add_message(channel(tools::Topic::kFrames), ns, message);
    for (const std::string& message : log.messages(tick))
      writer.add_message(channel(tools::Topic::kLog), ns, message);
  }
  return writer.finish();
}

}  // namespace haptic::sim
