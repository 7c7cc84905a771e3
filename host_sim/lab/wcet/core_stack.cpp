// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/core_stack.hpp"

#include <cstdio>

#if __has_include(<generated/rt_core_stack.hpp>)
#include <generated/rt_core_stack.hpp>
#endif

namespace haptic::sim {
namespace {

#ifdef HAPTIC_STACK_TICK
#define HAPTIC_STACK_FRAME(name, bytes) StackFrame{name, bytes},
constexpr StackFrame kTick[] = {HAPTIC_STACK_TICK(HAPTIC_STACK_FRAME)};
constexpr StackFrame kCore[] = {HAPTIC_STACK_CORE(HAPTIC_STACK_FRAME)};
#undef HAPTIC_STACK_FRAME

StackDepth depth_of(std::span<const StackFrame> chain) {
  StackDepth depth{chain, 0};
  for (const StackFrame& frame : chain) depth.bytes += frame.bytes;
  return depth;
}

CoreStack measured_stack() {
  return {true, "", depth_of(kTick), depth_of(kCore), HAPTIC_STACK_LIMIT};
}
#else
CoreStack measured_stack() {
  CoreStack stack;
#ifdef HAPTIC_STACK_NOT_MEASURED
  stack.why_not = HAPTIC_STACK_NOT_MEASURED;
#else
  stack.why_not = "built without the checks of the build";
#endif
  return stack;
}
#endif

}  // namespace

const CoreStack& core_stack() {
  static const CoreStack stack = measured_stack();
  return stack;
}

std::string stack_text(const CoreStack& stack) {
  if (!stack.measured) return "stack of a tick: not measured: " + std::string(stack.why_not) + "\n";
  char line[200];
  std::snprintf(line, sizeof line,
                "stack in bytes, at most, for any input: a tick %u, servo tick with its "
                "safety stages %u, limit %u\n",
                stack.tick.bytes, stack.core.bytes, stack.limit_bytes);
  std::string text = line;
  for (const StackFrame& frame : stack.tick.chain) {
    std::snprintf(line, sizeof line, "  %6u  %.150s\n", frame.bytes, frame.function);
    text += line;
  }
  return text;
}

}  // namespace haptic::sim
