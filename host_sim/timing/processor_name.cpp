// SPDX-License-Identifier: Apache-2.0
#include "host_sim/timing/processor_name.hpp"

#include <fstream>

namespace haptic::sim {

std::string processor_name() {
  std::ifstream stream("/proc/cpuinfo");
  std::string line;
  while (std::getline(stream, line)) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

}  // namespace haptic::sim
