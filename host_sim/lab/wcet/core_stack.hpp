// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The most stack that the core of this program can need, added up by the build from the frames
/// that the compiler reports and the calls between them. It holds for every scene and every input:
/// the core has no recursion and no call through a pointer.

#include <cstdint>
#include <span>
#include <string>

namespace haptic::sim {

/// A function of the deepest chain of calls.
struct StackFrame {
  const char* function;
  std::uint32_t bytes;  ///< its own frame, return address included
};

struct StackDepth {
  std::span<const StackFrame> chain;  ///< the caller first
  std::uint32_t bytes = 0;            ///< of all of them
};

struct CoreStack {
  bool measured = false;
  const char* why_not = "";
  StackDepth tick;  ///< from HapticCore::step downwards
  StackDepth core;  ///< from any function of the core: the servo tick with its safety stages
  std::uint32_t limit_bytes = 0;  ///< that the build refuses to pass
};

/// Stack of the core that this program was built with. Not measured with other compilers than g++,
/// at -O0, with a sanitizer, and in a build without its checks.
[[nodiscard]] const CoreStack& core_stack();

/// Lines of the report: both figures, and the deepest chain of a tick.
[[nodiscard]] std::string stack_text(const CoreStack& stack);

}  // namespace haptic::sim
