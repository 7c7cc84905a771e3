// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The core of one moving part that a session of this process renders, or the hands of a
/// scene with parts; and what its owner does to the parts while the loop ticks: hold, release,
/// drive, move the fixed ones.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/haptic.h"

namespace haptic::tools {

/// Owner: that of the session. `hold_part`, `release_part` and `bodies` from any thread;
/// `move_fixed` and `drive` from one at a time.
class SessionParts {
 public:
  /// `view`: of a scene that was opened before; it outlives this.
  explicit SessionParts(const SceneView& view);
  SessionParts(const SessionParts&) = delete;
  SessionParts& operator=(const SessionParts&) = delete;

  [[nodiscard]] HeldParts* parts() noexcept { return parts_.get(); }  ///< null: one moving part
  [[nodiscard]] HapticCore* core() noexcept { return core_; }         ///< null: the scene has parts
  [[nodiscard]] const NewestRecord<FrameRecord>& frames() const noexcept { return frames_; }
  [[nodiscard]] std::span<const NewestRecord<FrameRecord>> driven_records() const noexcept {
    return std::span(driven_).first(parts_ != nullptr ? parts_->scenes.driven().size() : 0);
  }
  /// Servo thread, after a tick.
  [[nodiscard]] HeldNow after(const ServoResult& result) const noexcept;

  /// Lets go of what is held and waits until the hand is empty, 2 s at most; the next tick takes
  /// `part`. HAPTIC_OK; HAPTIC_ERROR_PART; HAPTIC_ERROR_BUSY: it has not let go, or `ended`.
  [[nodiscard]] int hold_part(std::uint32_t part, std::int64_t period_ns,
                              const std::atomic<bool>& ended);
  [[nodiscard]] int release_part();
  /// As many as there is room for. @return how many there are; 0: the scene has one moving part.
  [[nodiscard]] std::size_t bodies(const HeldNow& now, std::span<haptic_body> bodies) const;
  /// The fixed parts are there, by the clock of the ticks.
  void move_fixed(const haptic_frame& frame, std::int64_t now_ns) noexcept;
  /// The driven part is there. HAPTIC_ERROR_PART: no such part is driven.
  [[nodiscard]] int drive(std::uint32_t part, const haptic_frame& frame,
                          std::int64_t now_ns) noexcept;

 private:
  [[nodiscard]] int go_on_to(std::uint32_t part);

  SceneBytes core_memory_;
  std::unique_ptr<HeldParts> parts_;
  HapticCore* core_ = nullptr;
  mutable std::mutex mutex_;  ///< of the hand, between ticks
  FrameRecord frame_;
  NewestRecord<FrameRecord> frames_;
  NewestWriter<FrameRecord> frame_writer_{frames_};
  /// Stream of a driven part, by their order.
  struct DrivenStream {
    FrameRecord last;
    std::optional<NewestWriter<FrameRecord>> writer;
  };
  std::array<NewestRecord<FrameRecord>, kMostDriven> driven_;
  std::array<DrivenStream, kMostDriven> streams_;
};

}  // namespace haptic::tools
