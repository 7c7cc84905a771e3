// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/run_arguments.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "host_sim/device/pressing_script.hpp"

namespace haptic::sim {
namespace {

constexpr double kDefaultSeconds = 6.0;

}  // namespace

void RunArguments::keep(const std::vector<OutputText>& files,
                        const nlohmann::ordered_json& account) const {
  if (!out.empty()) {
    for (const OutputText& file : files) write_whole_file(out + "/" + file.name, file.content);
    write_whole_file(out + "/run.json", account.dump(2) + "\n");
  }
  if (json) std::printf("%s\n", account.dump(2).c_str());
}

void RunArguments::keep_drives(const DriveRun& run) const {
  if (!out.empty() && !run.csv().empty()) write_whole_file(out + "/driven.csv", run.csv());
}

void stay(tools::LiveSession& live) {
  std::fflush(stdout);
  std::fprintf(stderr, "host_sim: the session stays to be seen until this is stopped (^C)\n");
  live.wait_for_stop();
}

HandWay hand_way(const RunArguments& o, const std::string& file, CoreSession& session,
                 double rate_hz) {
  MotionScript script = file.empty()
                            ? pressing_script(session, rate_hz, o.seconds.value_or(kDefaultSeconds))
                            : read_motion_script(file);
  script.rate_hz = rate_hz;
  std::vector<MotionSample> motion = make_motion(script);
  if (o.seconds) {
    MotionSample last = motion.back();
    const auto ticks = static_cast<std::size_t>(std::llround(*o.seconds * rate_hz)) + 1;
    motion.resize(std::min(motion.size(), ticks));
    while (motion.size() < ticks) {
      last.t_s = motion.back().t_s + 1.0 / rate_hz;
      motion.push_back(last);
    }
  }
  return {std::move(motion), script.holds};
}

}  // namespace haptic::sim
