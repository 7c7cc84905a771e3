// SPDX-License-Identifier: Apache-2.0
// What the page calls: one core, by C functions. A call out of turn (a step before a scene is open)
// is a fault of the page and does nothing.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>

#include "host_sim/view/wasm/view_core.hpp"
#include "rt_core/base/status.hpp"
#include "rt_core/contact/contact_situation.hpp"

#define HAPTIC_EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace haptic;

sim::ViewCore& core() {
  static sim::ViewCore the_core;
  return the_core;
}
bool is_open = false;
std::byte* blob = nullptr;

}  // namespace

/// libc++ would print, for which the module would need a system; there is nothing to say.
void std::__libcpp_verbose_abort(char const*, ...) { __builtin_trap(); }

/// Room for a scene of `bytes` bytes, in place of the one before; null: there is none.
HAPTIC_EXPORT(view_reserve) std::byte* view_reserve(std::uint32_t bytes) {
  is_open = false;
  std::free(blob);
  const std::size_t room =
      (std::size_t{bytes} + kSceneAlignment) / kSceneAlignment * kSceneAlignment;
  blob = static_cast<std::byte*>(std::aligned_alloc(kSceneAlignment, room));
  return blob;
}

/// Opens what was put there. RtStatus.
HAPTIC_EXPORT(view_open) std::uint32_t view_open(std::uint32_t bytes) {
  if (blob == nullptr) return static_cast<std::uint32_t>(RtStatus::kBlobTooSmall);
  const RtStatus status = core().open({blob, bytes});
  is_open = status == RtStatus::kOk;
  return static_cast<std::uint32_t>(status);
}

/// A text without end mark, for numbers from 0 on; empty beyond the last.
HAPTIC_EXPORT(view_status_text) const char* view_status_text(std::uint32_t status) {
  return to_text(static_cast<RtStatus>(status));
}
HAPTIC_EXPORT(view_situation_text) const char* view_situation_text(std::uint32_t situation) {
  return to_text(static_cast<ContactSituation>(situation));
}

HAPTIC_EXPORT(view_layout) const char* view_layout() {
  static const std::string text = sim::layout_text();
  return text.c_str();
}

HAPTIC_EXPORT(view_input) void* view_input() { return &core().input; }
HAPTIC_EXPORT(view_drive) void* view_drive() { return &core().drive; }
HAPTIC_EXPORT(view_result) const void* view_result() { return &core().result; }
HAPTIC_EXPORT(view_scene) const void* view_scene() { return &core().scene; }

HAPTIC_EXPORT(view_step) void view_step() {
  if (is_open) core().step();
}
HAPTIC_EXPORT(view_give) void view_give() {
  if (is_open) core().give();
}
HAPTIC_EXPORT(view_follow) void view_follow(std::int64_t now_ns, std::uint32_t is_felt) {
  if (is_open) core().follow(now_ns, is_felt != 0);
}
HAPTIC_EXPORT(view_reset) void view_reset() {
  if (is_open) core().reset();
}

/// Refused, waits, takes: 0, 1, 2 (ViewCore::hold).
HAPTIC_EXPORT(view_hold) std::uint32_t view_hold(std::uint32_t part) {
  return is_open ? core().hold(part) : sim::kHoldRefused;
}
HAPTIC_EXPORT(view_release) void view_release() {
  if (is_open) core().release();
}

HAPTIC_EXPORT(view_begin_verdict) void view_begin_verdict() {
  if (is_open) core().begin_verdict();
}

/// Pieces of the state: how many, and place and size of each.
HAPTIC_EXPORT(view_state_count) std::uint32_t view_state_count() {
  return static_cast<std::uint32_t>(core().state().size());
}
HAPTIC_EXPORT(view_state) void* view_state(std::uint32_t piece) {
  return core().state()[piece].data();
}
HAPTIC_EXPORT(view_state_bytes) std::uint32_t view_state_bytes(std::uint32_t piece) {
  return static_cast<std::uint32_t>(core().state()[piece].size());
}

HAPTIC_EXPORT(view_describe_scene) void view_describe_scene() {
  if (is_open) core().describe_scene();
}
HAPTIC_EXPORT(view_describe_parts) void view_describe_parts() {
  if (is_open) core().describe_parts();
}
HAPTIC_EXPORT(view_describe_driven) void view_describe_driven() {
  if (is_open) core().describe_driven();
}
HAPTIC_EXPORT(view_describe_driven_pieces) void view_describe_driven_pieces() {
  if (is_open) core().describe_driven_pieces();
}
HAPTIC_EXPORT(view_describe_guide) void view_describe_guide() {
  if (is_open) core().describe_guide();
}
HAPTIC_EXPORT(view_describe_verdict) void view_describe_verdict() {
  if (is_open) core().describe_verdict();
}
HAPTIC_EXPORT(view_describe_pieces) void view_describe_pieces() {
  if (is_open) core().describe_pieces();
}
HAPTIC_EXPORT(view_describe_obstacles)
void view_describe_obstacles(std::uint32_t most_pairs, std::uint32_t most_nodes) {
  if (is_open) core().describe_obstacles(most_pairs, most_nodes);
}
HAPTIC_EXPORT(view_describe_contacts) void view_describe_contacts() {
  if (is_open) core().describe_contacts();
}
HAPTIC_EXPORT(view_describe_graph) void view_describe_graph(std::uint32_t most_nodes) {
  if (is_open) core().describe_graph(most_nodes);
}
HAPTIC_EXPORT(view_describe_marked)
void view_describe_marked(std::uint32_t pair, std::uint32_t node) {
  if (is_open) core().describe_marked(pair, node);
}

HAPTIC_EXPORT(view_numbers) const double* view_numbers() { return core().answer.numbers.data(); }
HAPTIC_EXPORT(view_number_count) std::uint32_t view_number_count() {
  return static_cast<std::uint32_t>(core().answer.numbers.size());
}
HAPTIC_EXPORT(view_counts) const std::uint32_t* view_counts() {
  return core().answer.counts.data();
}
HAPTIC_EXPORT(view_count_count) std::uint32_t view_count_count() {
  return static_cast<std::uint32_t>(core().answer.counts.size());
}
HAPTIC_EXPORT(view_text) const char* view_text() { return core().answer.text.c_str(); }
