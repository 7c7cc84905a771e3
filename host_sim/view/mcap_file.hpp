// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A session as an MCAP file (mcap.dev/spec), which Foxglove, Lichtblick and PlotJuggler open: JSON
/// messages with their schemas (topics.hpp), without chunks and index.

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "host_sim/device/loop_run.hpp"
#include "tools/live/driven_tick.hpp"

namespace haptic::sim {

/// Appends the records of an MCAP file to a string. Order: channels, messages, `finish`.
class McapWriter {
 public:
  /// `profile` and `library` as the format's header names them.
  McapWriter(std::string_view profile, std::string_view library);

  /// @param schema_name, schema  a JSON schema. @return the number of the channel, from 1 on.
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name,
                            std::string_view schema);
  /// `json`: the message; `time_ns` from the session's begin on.
  void add_message(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);
  /// The whole file. Nothing may follow.
  [[nodiscard]] std::string finish();

 private:
  std::string file_;
  std::uint16_t channels_ = 0;
  std::map<std::uint16_t, std::uint32_t> messages_;  ///< by channel
};

/// The file of a closed loop. Numbers have 17 digits. `driven`: the driven parts of the scene after
/// each of the ticks, one tick after the other; empty: it has none.
[[nodiscard]] std::string mcap_of(const SceneView& scene, std::span<const LoopRecord> records,
                                  std::span<const tools::DrivenTick> driven = {});

}  // namespace haptic::sim
