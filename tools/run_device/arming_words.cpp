// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/arming_words.hpp"

#include <array>
#include <cmath>
#include <iterator>

#include "hal/realtime/flight_report.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// A turn of the part in the handle that nobody sees.
constexpr double kNoTurn = 1e-6;

std::string metres_text(double value) {
  const double rounded = 1e-6 * std::nearbyint(1e6 * value);  // to the micrometre
  return short_number(rounded == 0 ? 0.0 : rounded, 7);
}

/// "[limits]", or "[limits2]" of the second device.
std::string table(const char* name, const ArmingNews& news) {
  return std::string("[") + name + (news.device == 2 ? "2]" : "]");
}

/// How a part that has left its limits comes back.
std::string back_text(const ArmingNews& news, const char* verb, const std::string& otherwise) {
  if (news.device == 0 && news.finds_place != 0) return "the part begins at the start again";
  return std::string(verb) + " the part back" + (news.device == 0 ? otherwise : "");
}

std::string fix_of(std::uint32_t fault, const ArmingNews& news) {
  const std::string there = place_keys(news);
  switch (fault) {
    case kFaultNotFinite:
      return "keep the last ticks ([recorder] crash_file) and report it";
    case kFaultBadPose:
      return "the device must report finite numbers and unit quaternions";
    case kFaultStaleState:
      return "the device must report at least as often as [loop] rate_hz asks for; run_device "
             "doctor looks at the bus";
    case kFaultLateTick:
      return "the machine was busy: [loop] servo_priority and servo_cpu, and run_device doctor";
    case kFaultDeviceLost:
      return "plug the device in again";
    case kFaultDevice:
      return "what the device or its link says beside it has to go first";
    case kFaultEmergencyStop:
      return "let go of the stop (" + table("switches", news) + " emergency_stop)" +
             (news.device > 0 ? ", which is that of both devices" : "");
    case kFaultScene:
      return news.finds_place != 0
                 ? "give the scene a start that is free: [moving] position_m; until then the part "
                   "is led out"
                 : "give " + there +
                       ", which puts the part where the scene has it start, or leave offset_m out; "
                       "until then the part is led out";
    case kFaultInternal:
      return "keep the last ticks ([recorder] crash_file) and report it with the scene";
    case kFaultEnvelope:
      return back_text(news, "turn", "") +
             "; [motion_limits] orientation of the scene is the limit";
    case kFaultWorkspace:
      return back_text(news, "bring", ", or give " + there) +
             "; [motion_limits] workspace of the scene is the limit, " + table("workspace", news) +
             " scale reaches less far";
    case kFaultJump:
      return "a hand is no faster than " + table("limits", news) +
             " jump_speed_m_per_s and jump_turn_rad_per_s: look at the encoders";
    case kFaultSequence:
      return "states must come in order: is another program at the device?";
    case kFaultFrame:
      return "the owner of the fixed parts must give their poses in time and within its speed";
    default:
      return "report it";
  }
}

/// The bits of a set, lowest first.
template <typename Told>
void each_bit(std::uint32_t set, const Told& told) {
  for (std::uint32_t left = set; left != 0; left &= left - 1) told(left & ~(left - 1));
}

}  // namespace

ArmingNewsTaker::ArmingNewsTaker(const ServoParameters& parameters, std::uint32_t device) noexcept
    : map_(parameters.map), start_{true, true, parameters.start.pose_wa} {
  news_.device = device;
  news_.deadman = parameters.switches.deadman;
  news_.finds_place = parameters.start.place ? 1 : 0;
}

void ArmingNewsTaker::take(const ServoInput& input, const ServoResult& result) noexcept {
  news_.waits = result.waits;
  news_.present = result.present;
  const bool inside = (result.rendered.flags & kFlagRecovery) != 0;
  if (!inside) news_.inside_ticks = 0;
  if (!result.rendered_new) return;
  if (inside) news_.inside_ticks += 1;
  if (!result.began) return;
  news_.begins += 1;
  const Pose sensed_dh = pose_of(input.state.pose_dh);
  const WorkspaceMap found =
      begun_map(map_, start_, at_handle_point(sensed_dh, handle_arm(map_, sensed_dh.q_wa)));
  for (int k = 0; k < 3; ++k) news_.offset_m[k] = static_cast<double>(found.offset_w[k]);
  const Quat& q = found.q_ha;
  const std::array<Real, 4> wxyz = {q.w(), q.x(), q.y(), q.z()};
  for (std::size_t k = 0; k < 4; ++k) news_.part_rotation_wxyz[k] = static_cast<double>(wxyz[k]);
}

std::string place_keys(const ArmingNews& news) {
  const double* p = news.offset_m;
  const double* q = news.part_rotation_wxyz;
  std::string text = "[workspace] offset_m = [" + metres_text(p[0]) + ", " + metres_text(p[1]) +
                     ", " + metres_text(p[2]) + "]";
  if (std::hypot(q[1], q[2], q[3]) > kNoTurn)
    text += formatted(", part_rotation = { w = %.9g, x = %.9g, y = %.9g, z = %.9g }", q[0], q[1],
                      q[2], q[3]);
  return text;
}

std::string fix_text(std::uint32_t faults, const ArmingNews& news) {
  std::string text;
  each_bit(faults,
           [&](std::uint32_t fault) { text += (text.empty() ? "" : "; ") + fix_of(fault, news); });
  return text.empty() ? text : text + "; then release and press the deadman switch";
}

std::string wait_text(const ArmingNews& news) {
  const std::uint32_t w = news.waits;
  if ((w & kWaitDevice) != 0) return "the device does not report";
  if ((w & kWaitHomed) != 0) return "the device is not calibrated: lead it to where it homes";
  if ((w & kWaitPose) != 0) return "no pose of the device that can be used has come yet";
  if ((w & kWaitInside) != 0) {
    const std::string fix = fix_of(kFaultScene, news);
    return "the part is inside an obstacle, for " + std::to_string(news.inside_ticks) +
           " ticks so far; " + fix;
  }
  if ((w & kWaitCause) != 0)
    return hal::safety_fault_texts(news.present) + "; " + fix_text(news.present, news);
  if ((w & kWaitLate) != 0)
    return "states or ticks come too late: run_device doctor says what holds them up";
  if ((w & kWaitRampOut) != 0) return "the force ramps to zero";
  const std::string deadman = "the deadman switch (" + table("switches", news) +
                              " deadman = " + std::to_string(news.deadman) + ") ";
  if ((w & kWaitDeadmanReleased) != 0)
    return deadman + "is held and counts only once it has been released and is pressed again";
  if ((w & kWaitDeadmanPressed) != 0) return deadman + "is not pressed";
  return {};
}

}  // namespace haptic::tools
