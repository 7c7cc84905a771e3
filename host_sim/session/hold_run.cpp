// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/hold_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

double change(const double (&now)[3], const double (&before)[3]) {
  return std::hypot(now[0] - before[0], now[1] - before[1], now[2] - before[2]);
}

double size(const double (&v)[3]) { return std::hypot(v[0], v[1], v[2]); }

double apart_m(const PartPlace& a, const PartPlace& b) { return change(a.p_wa_m, b.p_wa_m); }

PartPlace place_of(const tools::PoseNumbers& pose) {
  PartPlace place;
  std::copy_n(pose.p_m, 3, place.p_wa_m);
  std::copy_n(pose.q_xyzw, 4, place.q_wa_xyzw);
  return place;
}

}  // namespace

HoldRun::HoldRun(CoreSession& session, std::vector<HoldCommand> commands)
    : session_(session), commands_(std::move(commands)) {
  if (commands_.empty()) return;
  if (session_.parts() == nullptr)
    throw tools::InputError(
        "the script holds and lets go, and the scene has one moving part; "
        "compile it with [[part]] tables");
  if (session_.parts()->holds_throughout())
    throw tools::InputError(
        "the script holds and lets go, and in a scene with role \"hand2\" or \"loose\" hands hold "
        "their parts all the time; leave the holds out");
  for (const HoldCommand& command : commands_)
    if (!command.part.empty()) static_cast<void>(number_of(command.part));
}

std::uint32_t HoldRun::number_of(const std::string& part) const {
  const PartScenes& parts = *session_.parts();
  std::string names;
  for (std::uint32_t k = 0; k < parts.count(); ++k) {
    if (!parts.may_be_taken(k)) continue;
    if (parts.name(k) == part) return k;
    names += (names.empty() ? "" : ", ") + std::string(parts.name(k));
  }
  throw tools::InputError("hold = \"" + part + "\": no such part may be held; those are: " + names);
}

void HoldRun::let_go(double asked_s) {
  PartHand& hand = *session_.hand();
  HoldEvent event;
  event.asked_s = asked_s;
  event.part = session_.parts()->name(hand.part());
  event.force_n = size(last_.force_n);
  asked_place_ = place_of(last_.proxy_wa);
  hand.release();
  events_.push_back(event);
  is_watched_ = true;
}

void HoldRun::take(double t_s, double asked_s, std::uint32_t part) {
  HoldEvent event;
  event.t_s = t_s;
  event.asked_s = asked_s;
  event.taken = true;
  event.part = session_.parts()->name(part);
  asked_place_ = session_.hand()->places()[part];
  const RtStatus status = session_.hand()->prepare(part);
  if (status != RtStatus::kOk)
    throw tools::InputError("hold = \"" + event.part + "\": " + to_text(status));
  events_.push_back(event);
  is_watched_ = true;
}

void HoldRun::before_tick(double t_s) {
  if (next_ == commands_.size()) return;
  const HoldCommand& command = commands_[next_];
  if (t_s < command.t_s) return;
  const PartHand::Phase phase = session_.hand()->phase();
  if (phase == PartHand::Phase::kHolding) {
    let_go(command.t_s);
    if (command.part.empty()) ++next_;
  } else if (phase == PartHand::Phase::kEmpty) {
    if (!command.part.empty()) take(t_s, command.t_s, number_of(command.part));
    ++next_;
  }
}

void HoldRun::after_tick(const tools::TickRecord& tick) {
  if (is_watched_) {
    HoldEvent& event = events_.back();
    event.force_step_n = std::max(event.force_step_n, change(tick.force_n, last_.force_n));
    event.torque_step_nm = std::max(event.torque_step_nm, change(tick.torque_nm, last_.torque_nm));
    if (event.taken && tick.t_s <= event.t_s)
      event.moved_m = apart_m(asked_place_, place_of(tick.proxy_wa));
    if (!event.taken && session_.hand()->phase() == PartHand::Phase::kEmpty) {
      event.t_s = tick.t_s;
      event.moved_m = apart_m(asked_place_, session_.hand()->places()[session_.hand()->part()]);
      is_watched_ = false;
    }
    if (event.taken && tick.t_s > event.t_s + kTakenWatch_s) is_watched_ = false;
  }
  last_ = tick;
}

std::string HoldRun::failures() const {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  for (const HoldEvent& event : events_) {
    if (event.moved_m <= kMostMovedByHold_m) continue;
    add(tools::formatted("%s was moved by %.3g um where it was ", event.part.c_str(),
                         1e6 * event.moved_m) +
        (event.taken ? "taken" : "let go"));
  }
  if (next_ < commands_.size())
    add(tools::formatted("the script ends before what it asks for at %.3f s is done",
                         commands_[next_].t_s));
  return text;
}

}  // namespace haptic::sim
