// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/run_events.hpp"

#include <iterator>

#include "hal/realtime/flight_report.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/arming_words.hpp"
#include "tools/run_device/device_run.hpp"

namespace haptic::tools {

const char* to_text(ArmingState arming) {
  constexpr const char* kTexts[] = {"disarmed", "arming", "armed", "disarming", "faulted"};
  const auto at = static_cast<std::size_t>(arming);
  return at < std::size(kTexts) ? kTexts[at] : "?";
}

const char* to_text(LinkState link) {
  constexpr const char* kTexts[] = {"absent", "starting", "ready"};
  const auto at = static_cast<std::size_t>(link);
  return at < std::size(kTexts) ? kTexts[at] : "?";
}

std::string faults_text(std::uint32_t safety, std::uint32_t device) {
  const std::string first = hal::safety_fault_texts(safety);
  const std::string second = hal::device_fault_texts(device);
  return first + (first.empty() || second.empty() ? "" : "; ") + second;
}

void RunEvents::tell(double t_s, const std::string& event, const std::string& text,
                     LineLevel level) const {
  const std::string of = device_ > 0 ? "device " + std::to_string(device_) + ": " : "";
  if (told_) told_({device_, t_s, event, of + text, level});
}

void RunEvents::look(const RunStatus& s) {
  if (s.link != link_) {
    const bool lost = s.link == LinkState::kAbsent;
    if (lost || s.link == LinkState::kReady) {
      tell(s.t_s, lost ? "disconnected" : "connected",
           lost ? "the device is away" : "the device reports",
           lost ? LineLevel::kWarning : LineLevel::kNotice);
    }
    link_ = s.link;
  }
  if (s.trouble != trouble_ && !s.trouble.empty())
    tell(s.t_s, "trouble", s.trouble, LineLevel::kWarning);
  trouble_ = s.trouble;
  if (s.is_silent() != silent_) {
    silent_ = s.is_silent();
    // One process renders for both devices.
    if (silent_ && device_ <= 1 && told_) {
      told_({0, s.t_s, "silent", "the servo process does not answer; the force ramps to zero",
             LineLevel::kError});
    }
  }
  const std::uint32_t safety = s.servo.safety_faults & ~safety_faults_;
  const std::uint32_t device = s.device_faults() & ~device_faults_;
  if ((safety | device) != 0) {
    const std::string fix = fix_text(safety, s.servo.arming_news);
    tell(s.t_s, "fault", faults_text(safety, device) + (fix.empty() ? "" : "; " + fix),
         LineLevel::kError);
  }
  safety_faults_ = s.servo.safety_faults;
  device_faults_ = s.device_faults();
  if (s.servo.arming != arming_) {
    arming_ = s.servo.arming;
    tell(s.t_s, to_text(arming_), formatted("%s, %.2f N", to_text(arming_), s.force_n),
         arming_ == ArmingState::kFaulted ? LineLevel::kError : LineLevel::kNotice);
  }
  look_at_arming(s);
  look_at_speed(s);
}

/// An armed device whose hand is too fast for any force, where that lasts.
void RunEvents::look_at_speed(const RunStatus& s) {
  if (s.servo.too_fast_ticks == 0) {
    fast_from_s_ = s.t_s;
    fast_told_ = false;
    return;
  }
  if (fast_told_ || s.t_s < fast_from_s_ + kLongWait_s) return;
  fast_told_ = true;
  const double stated = s.servo.stated_m_per_s;
  const std::string by =
      stated > 0 ? formatted("by the device's own word at %.3g m/s", stated) : "by its poses";
  tell(s.t_s, "too fast",
       "armed, and no force: the handle moves " + by +
           ", faster than [limits] zero_speed_m_per_s or zero_turn_rad_per_s leaves any",
       LineLevel::kWarning);
}

/// Where the part begins, and why nothing arms where that lasts.
void RunEvents::look_at_arming(const RunStatus& s) {
  const ArmingNews& news = s.servo.arming_news;
  if (link_ == LinkState::kReady && news.begins != begins_) {
    begins_ = news.begins;
    if (device_ > 0) {
      // The parts of two hands go on from where they are.
      if (begins_ == 1)
        tell(s.t_s, "begun", "the part begins where the scene has it start", LineLevel::kNotice);
    } else if (news.finds_place != 0) {
      tell(s.t_s, "begun",
           "the part begins where the scene has it start; to have it there again: " +
               place_keys(news),
           LineLevel::kNotice);
    }
  }
  if (news.waits != waits_ || s.is_silent()) {
    waits_ = news.waits;
    waits_from_s_ = s.t_s;
    wait_told_ = false;
  }
  if (wait_told_ || waits_ == 0 || s.t_s < waits_from_s_ + kLongWait_s) return;
  wait_told_ = true;
  tell(s.t_s, "waiting", "not armed: " + wait_text(news), LineLevel::kNotice);
}

}  // namespace haptic::tools
