// SPDX-License-Identifier: Apache-2.0
// Parts that their owners move, of the scene of a page.
#include "host_sim/view/wasm/view_core.hpp"
#include "tools/common/driven_shape.hpp"
#include "tools/live/driven_tick.hpp"

namespace haptic::sim {

bool ViewCore::meets_standing() const {
  return parts_ == nullptr || parts_->scenes.meets_standing(parts_->hand().part());
}

void ViewCore::list_state() {
  state_pieces_ = {state_};
  if (parts_ == nullptr || parts_->scenes.driven().empty()) return;
  // The hand is put back where it lies, with all that it points to.
  state_pieces_.push_back(parts_->law[0].span());
  state_pieces_.push_back(std::as_writable_bytes(std::span(&parts_->hands, 1)));
  state_pieces_.push_back(std::as_writable_bytes(std::span(newest_)));
}

void ViewCore::give() {
  if (parts_ != nullptr && drive.driven < parts_->scenes.driven().size())
    newest_[static_cast<std::size_t>(drive.driven)] = drive.record;
}

void ViewCore::follow(std::int64_t now_ns, bool is_felt) {
  if (parts_ == nullptr || parts_->scenes.driven().empty()) return;
  const auto newest = std::span(newest_).first(parts_->scenes.driven().size());
  static_cast<void>(parts_->hands.follow({newest, now_ns, is_felt}));
}

void ViewCore::describe_driven() {
  answer.clear();
  if (parts_ == nullptr) return;
  const DrivenParts& driven = parts_->hand().driven();
  for (std::uint32_t k = 0; k < driven.count(); ++k) {
    const DrivenState& state = driven.states()[k];
    answer.counts.insert(answer.counts.end(), {state.touches() ? 1u : 0u, state.is_lost ? 1u : 0u});
    const tools::DrivenTick tick = tools::driven_tick(state);
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
    answer.text.append(parts_->scenes.name(driven.record(k).part)).append("\n");
  }
}

void ViewCore::describe_driven_pieces() {
  answer.clear();
  if (parts_ == nullptr) return;
  for (std::uint32_t k = 0; k < parts_->scenes.driven().size(); ++k) {
    SceneView shape;
    if (!tools::open_driven_shape(parts_->scenes, k, shape)) continue;
    for (std::uint32_t piece = 0; piece < shape.pieces().size(); ++piece)
      if (shape.pieces()[piece].body == 1)
        add_piece(shape, piece, k, shape.bodies()[1].reference_m);
  }
}

}  // namespace haptic::sim
