// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Every fault that a servo tick can find by itself: how it comes, and how its cause ends.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/servo_bench.hpp"

namespace haptic::test {

struct FaultCase {
  std::string name;
  std::uint32_t fault;
  std::function<ServoResult(ServoBench&)> happen;  ///< the tick in which it is found
  std::function<void(ServoBench&)> end;            ///< of the cause
};

[[nodiscard]] std::vector<FaultCase> fault_cases();

}  // namespace haptic::test
