// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Work that may crash, run without end or take all memory, in a process of its own with limits.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace haptic::tools {

struct ChildLimits {
  std::uint32_t seconds = 120;                          ///< of processor time
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;  ///< more than this process has
  std::size_t answer_bytes = std::numeric_limits<std::size_t>::max() - 1;  ///< longest answer
  std::uint32_t waiting_seconds = 1200;  ///< in all: ends a child that waits for ever
};

enum class ChildEnd : std::uint8_t {
  kAnswered,     ///< `text` is the answer
  kThrew,        ///< an exception: `text` is what it says
  kOutOfTime,    ///< more time than allowed
  kOutOfMemory,  ///< more memory than allowed
  kTooLong,      ///< a longer answer than allowed
  kSignal,       ///< ended by signal `number`
  kEnded         ///< ended itself with exit code `number`, or without a whole answer
};

struct ChildResult {
  ChildEnd end = ChildEnd::kEnded;
  std::string text;
  int number = 0;
  std::uint64_t memory_bytes = 0;  ///< largest that the child had at once
};

/// Runs `work` in a child process and waits for its answer. The child shares nothing with this
/// process afterwards: what `work` changes is lost. A child that has crashed may answer anything.
/// @throws OsError  no pipe or process; `name` begins the message.
ChildResult run_in_child(const std::string& name, const ChildLimits& limits,
                         const std::function<std::string()>& work);

}  // namespace haptic::tools
