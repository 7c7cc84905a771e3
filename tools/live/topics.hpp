// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Topics, JSON schemas and messages for other viewers (Foxglove, Lichtblick, PlotJuggler). The
/// MCAP file and the live server have them from here.
///
/// /scene, foxglove.SceneUpdate, once: the fixed parts in frame "w", the moving one in "part", each
/// driven one in "driven/" and its name.
/// /tf, foxglove.FrameTransform: "part" and the driven parts in "w", where they are felt; a message
/// each.
/// /pose, foxglove.PoseInFrame: where the device has the part.
/// /felt_pose, foxglove.PoseInFrame: where it is felt.
/// /wrench, haptic.Wrench: on the hand, about the grip point, W axes.
/// /contact, haptic.Contact: situation, flags, distance of device and part, D_near.
/// /counters, haptic.Counters: work of the tick, state hash.
/// /guide, haptic.Guide: where on the plan of the scene's guide the part is and which contact comes
/// next, force and torque that lead the hand besides /wrench; of a scene without one no message.
/// The haptic messages have the fields that kTickFields (tools/verdict/tick_record.hpp) puts there.
/// /log, foxglove.Log: each flag that appears, each new situation.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/live/driven_tick.hpp"
#include "tools/plan/guide_legs.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::tools {

enum class Topic : std::uint8_t {
  kScene = 0,
  kFrames,
  kPose,
  kFeltPose,
  kWrench,
  kContact,
  kCounters,
  kGuide,
  kLog
};
inline constexpr std::size_t kTopics = 9;
/// Those with one message a tick.
inline constexpr Topic kTickTopics[] = {Topic::kFrames, Topic::kPose,    Topic::kFeltPose,
                                        Topic::kWrench, Topic::kContact, Topic::kCounters,
                                        Topic::kGuide};

struct TopicFacts {
  const char* name;
  const char* schema_name;
  std::string schema;  ///< JSON schema
};

/// By Topic.
[[nodiscard]] const std::array<TopicFacts, kTopics>& topics();

/// Time of a tick's messages, from the session's begin on.
[[nodiscard]] std::uint64_t topic_time_ns(const TickRecord& tick);

/// The message of Topic::kScene.
[[nodiscard]] std::string scene_message(const SceneView& scene);

/// The message of one of kTickTopics; numbers have 17 digits. Of Topic::kGuide empty where the
/// scene has no guide, of which `legs` are: then there is none.
[[nodiscard]] std::string tick_message(Topic topic, const TickRecord& tick, const GuideLegs& legs);

/// Topic::kFrames of the driven parts of a scene, in addition to tick_message.
class DrivenFrames {
 public:
  DrivenFrames() = default;
  explicit DrivenFrames(const SceneView& scene);

  /// One for each of `driven`, in the order of PartScenes::driven(); of those that the scene has.
  [[nodiscard]] std::vector<std::string> messages(const TickRecord& tick,
                                                  std::span<const DrivenTick> driven) const;

 private:
  std::vector<std::string> names_;
};

/// Topic::kLog of a session: what is new since the tick before.
class LogTopic {
 public:
  [[nodiscard]] std::vector<std::string> messages(const TickRecord& tick);

 private:
  std::uint32_t flags_ = 0;
  ContactSituation situation_ = ContactSituation::kNone;
};

}  // namespace haptic::tools
