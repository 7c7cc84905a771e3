// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/status_tail.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

#include "hal/clock/servo_clock.hpp"

namespace haptic::sim {
namespace {

constexpr std::int64_t kLookForLines_ns = 1'000'000;

}  // namespace

void StatusTail::begin(const std::string& file) {
  thread_ = std::thread([this, file] { follow(file); });
}

void StatusTail::follow(const std::string& file) {
  const int opened = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) return;
  std::string rest;
  std::array<char, 4096> bytes;
  while (!stop_.load()) {
    const std::int64_t now = hal::monotonic_ns();
    for (ssize_t size = 0; (size = read(opened, bytes.data(), bytes.size())) > 0;)
      rest.append(bytes.data(), static_cast<std::size_t>(size));
    for (std::size_t end = rest.find('\n'); end != std::string::npos; end = rest.find('\n')) {
      const nlohmann::json json = nlohmann::json::parse(rest.substr(0, end), nullptr, false);
      rest.erase(0, end + 1);
      if (json.is_object() && json.value("kind", "") == "status")
        lines_.push_back({now, json.value("t_s", 0.0), json.value("force_n", 0.0)});
    }
    (void)hal::sleep_until(now + kLookForLines_ns);
  }
  close(opened);
}

std::vector<StatedForce> StatusTail::end() {
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
  std::int64_t begin_ns = std::numeric_limits<std::int64_t>::max();
  const auto since = [](const Line& line) { return static_cast<std::int64_t>(1e9 * line.t_s); };
  for (const Line& line : lines_) begin_ns = std::min(begin_ns, line.read_ns - since(line));
  std::vector<StatedForce> stated;
  for (const Line& line : lines_) stated.push_back({begin_ns + since(line), line.force_n});
  return stated;
}

}  // namespace haptic::sim
