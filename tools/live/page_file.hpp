// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The page with a scene inside, and a recorded session where there is one: one HTML file that
/// needs nothing else. The page itself is built apart (host_sim/view/README.md); a program finds it
/// in share/haptic_view of the folder above its own.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt_core/safety/moving_frame.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/step.hpp"

namespace haptic::tools {

/// Fields of a tick that are given to a page that computes it again: in a recording
/// (host_sim/view/page/src/recording.ts) and while it runs (live.ts).
enum TickMark : std::uint64_t {
  kMarkReset = 1,     ///< the core forgot all that was before this tick
  kMarkAccepted = 2,  ///< accepted_w is valid: in all ticks of a recording, or in none
  kMarkTwist = 4,     ///< twist_w is valid
  kMarkClutched = 8,  ///< StepInput::clutched
  kMarkDriven = 16,   ///< driven_ns is valid: in all ticks of a recording, or in none
  kMarkFelt = 32      ///< DrivenInput::is_felt
};

/// Input of one tick of the core, and its state hash after it.
struct RecordedTick {
  std::int64_t stamp_ns = 0;
  double p_wa_m[3] = {};
  double q_wa_xyzw[4] = {0, 0, 0, 1};  ///< unit
  double accepted_w[6] = {};  ///< force and torque that acted on the device since the tick before
  double twist_w[6] = {};     ///< of the grip point, m/s and rad/s
  std::uint64_t state_hash = 0;
  std::uint64_t marks = 0;     ///< TickMark
  std::int64_t driven_ns = 0;  ///< DrivenInput::now_ns
};

/// The newest pose of a driven part from one tick on, as the core was given it (DrivenInput).
struct GivenPose {
  std::uint64_t tick = 0;    ///< place of that tick in the recording
  std::uint64_t driven = 0;  ///< number of the mover (tools/common/movers.hpp)
  FrameRecord record;
};
static_assert(sizeof(GivenPose) == 15 * 8);

/// That of an input of the core; marked for nothing that is before it.
[[nodiscard]] RecordedTick recorded_tick(const StepInput& input, std::uint64_t state_hash);

/// Bytes as text that may stand in an HTML file.
[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// The same, zipped before (gzip) where zlib was there when this was built; the page reads both.
[[nodiscard]] std::string packed_text(std::span<const std::byte> bytes);

/// The recording of ticks as the page reads it: by columns of 64-bit words (stamp, position,
/// orientation, hash; the accepted wrench where there is one; twist and marks where a tick is
/// marked for a reset after the first, a twist or a clutch), each but the hash as the difference to
/// what goes on straight from the two ticks before, its sign in the lowest bit; of a column first
/// all lowest bytes, then the next. Motions become small numbers, which zip well. Of a session with
/// driven parts each tick also has their clock and 1 where the hand feels them, and the poses that
/// they were `given` follow in the same way: their number, then a column for each word of
/// GivenPose.
[[nodiscard]] std::vector<std::byte> recording_bytes(std::span<const RecordedTick> ticks,
                                                     std::span<const GivenPose> given = {});

/// The page that belongs to this program.
/// @throws OsError  it has not been built; the text says what to run and to install.
[[nodiscard]] std::string read_page();

/// `page` with the scene, the ticks, none for a page by hand alone, what the scene shows in words,
/// which may be empty, and the poses that driven parts were given. It connects to nothing.
/// @throws InputError  it is no page of this version.
[[nodiscard]] std::string filled_page(const std::string& page, const SceneView& scene,
                                      std::span<const RecordedTick> ticks,
                                      std::string_view about = {},
                                      std::span<const GivenPose> given = {});

/// How a page follows a session that runs (tools/live/README.md).
struct LivePage {
  bool takes_hand = false;  ///< the session follows the hand of a page
  /// Why the ticks cannot be computed again from what the page gets; empty: they can.
  std::string why_not_compared;
};

/// The page of a live session; connected_page makes it whole.
/// @throws InputError  it is no page of this version.
[[nodiscard]] std::string live_page(const std::string& page, const SceneView& scene,
                                    const LivePage& live);

/// A live page that may connect to the server at `host` (name or address, and port) alone.
[[nodiscard]] std::string connected_page(const std::string& live_page, const std::string& host);

}  // namespace haptic::tools
