// SPDX-License-Identifier: Apache-2.0
// Parts that move beside that of the first hand, of the scene of a page: driven ones, and that of a
// second hand.
#include "host_sim/view/wasm/view_core.hpp"
#include "tools/common/movers.hpp"
#include "tools/live/driven_tick.hpp"

namespace haptic::sim {

bool ViewCore::meets_standing() const {
  return parts_ == nullptr || parts_->scenes.meets_standing(parts_->hand().part());
}

void ViewCore::list_state() {
  state_pieces_ = {state_};
  if (parts_ == nullptr || tools::mover_count(parts_->scenes) == 0) return;
  // The hands are put back where they lie, with all that they point to.
  if (parts_->hands.count() > 1) state_pieces_.push_back(parts_->state[1].span());
  state_pieces_.push_back(parts_->law[0].span());
  state_pieces_.push_back(std::as_writable_bytes(std::span(&parts_->hands, 1)));
  state_pieces_.push_back(std::as_writable_bytes(std::span(newest_)));
  state_pieces_.push_back(std::as_writable_bytes(std::span(&second_, 1)));
}

void ViewCore::give() {
  if (parts_ != nullptr && drive.driven < tools::mover_count(parts_->scenes))
    newest_[static_cast<std::size_t>(drive.driven)] = drive.record;
}

void ViewCore::follow(std::int64_t now_ns, bool is_felt) {
  if (parts_ == nullptr || parts_->scenes.driven().empty()) return;
  const auto newest = std::span(newest_).first(parts_->scenes.driven().size());
  static_cast<void>(parts_->hands.follow({newest, now_ns, is_felt}));
}

/// One tick: of both hands where there are two. A second one that was given no pose holds its part
/// still.
StepResult ViewCore::step_hands(const StepInput& first) {
  if (parts_ == nullptr) return core_->step(first);
  if (parts_->hands.count() < 2) return parts_->hands.step(first);
  const FrameRecord& given = newest_[parts_->scenes.driven().size()];
  if (given.number == 0) {
    const StepResult made = parts_->hands.step(first);
    stand_second();
    return made;
  }
  StepInput second;
  second.sequence = first.sequence;
  second.stamp_ns = first.stamp_ns;
  second.pose_wa = pose_in(given.p_m, given.q_xyzw);
  const Hands::Each<StepResult> made = parts_->hands.step({&first, &second});
  second_ = made[1];
  return made[0];
}

/// The second hand, where there is one, leads its part to where that is, and feels nothing.
void ViewCore::stand_second() {
  second_ = StepResult{};
  if (parts_ != nullptr && parts_->hands.count() > 1)
    second_.goal_pose_wa = second_.proxy_pose_wa = parts_->hands.felt_wa(1);
}

void ViewCore::describe_driven() {
  answer.clear();
  if (parts_ == nullptr) return;
  const DrivenParts& driven = parts_->hand().driven();
  for (std::uint32_t k = 0; k < driven.count(); ++k) {
    const DrivenState& state = driven.states()[k];
    answer.counts.insert(answer.counts.end(), {state.touches() ? 1u : 0u, state.is_lost ? 1u : 0u});
    add_mover(tools::driven_tick(state), driven.record(k).part);
  }
  if (parts_->hands.count() < 2) return;
  const bool touches = second_.situation != ContactSituation::kNone;
  answer.counts.insert(answer.counts.end(), {touches ? 1u : 0u, 0u});
  add_mover(tools::driven_tick(second_), 1);
}

void ViewCore::add_mover(const tools::DrivenTick& tick, std::uint32_t part) {
  const auto add = [&](const auto& list) {
    for (const double x : list) answer.numbers.push_back(x);
  };
  for (const tools::PoseNumbers& pose : {tick.commanded_wa, tick.felt_wa}) {
    add(pose.p_m);
    add(pose.q_xyzw);
  }
  answer.numbers.insert(answer.numbers.end(), {tick.lag_m, tick.lag_rad});
  add(tick.push_n);
  add(tick.push_nm);
  answer.text.append(parts_->scenes.name(part)).append("\n");
}

void ViewCore::describe_driven_pieces() {
  answer.clear();
  if (parts_ == nullptr) return;
  for (std::uint32_t k = 0; k < tools::mover_count(parts_->scenes); ++k) {
    SceneView shape;
    std::uint32_t body = 0;
    if (!tools::open_mover_shape(parts_->scenes, k, shape, body)) continue;
    for (std::uint32_t piece = 0; piece < shape.pieces().size(); ++piece)
      if (shape.pieces()[piece].body == body)
        add_piece(shape, piece, k, shape.bodies()[body].reference_m);
  }
}

}  // namespace haptic::sim
