// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the live server says to viewers of others, in the protocol foxglove.websocket.v1
/// (foxglove.sdk.v1 has the same bytes), about the topics of tools/live/topics.hpp.

#include <cstdint>
#include <string>
#include <string_view>

namespace haptic::tools {

/// serverInfo; advertise of the topics, whose channels are their places from 1 on.
[[nodiscard]] std::string foxglove_greeting(const std::string& session);
[[nodiscard]] std::string foxglove_channels(bool knows_felt);
[[nodiscard]] std::string foxglove_complaint(const std::string& text);
/// A binary frame of a subscription.
[[nodiscard]] std::string foxglove_frame(std::uint32_t subscription, std::uint64_t time_ns,
                                         std::string_view message);

}  // namespace haptic::tools
