// SPDX-License-Identifier: Apache-2.0
// compare_drives NAME HERE THERE [UNITS INSTRUCTIONS]: results of the same drive on two machines,
// bit for bit, as one line; with the last two, UNITS of the other machine's clock are INSTRUCTIONS,
// and a second line tells what a tick costs there. Exit code 1 when a bit differs.

#include <algorithm>
#include <bit>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "linker/pose_drive.hpp"
#include "rt_core/base/status.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/run_main.hpp"

namespace {

using namespace haptic;

constexpr std::size_t kMostBytes = std::size_t{1} << 30;

struct DriveFile {
  std::vector<DriveTick> ticks;
  DriveSummary summary;
};

DriveFile read_drive(const std::string& path) {
  const std::string bytes = tools::read_text_file(path, kMostBytes, "the drive");
  DriveFile file;
  const std::size_t elements = bytes.size() / sizeof(DriveTick);
  if (elements > 0)
    std::memcpy(static_cast<void*>(&file.summary),
                bytes.data() + (elements - 1) * sizeof(DriveTick), sizeof(DriveSummary));
  if (elements == 0 || bytes.size() % sizeof(DriveTick) != 0 ||
      std::memcmp(file.summary.magic, kDriveMagic, sizeof(kDriveMagic)) != 0 ||
      file.summary.ticks != elements - 1) {
    throw tools::InputError(path + ": not the whole of a drive's results; run the drive again");
  }
  if (file.summary.status != static_cast<std::uint32_t>(RtStatus::kOk)) {
    throw tools::InputError(
        path + ": the drive failed: " + to_text(static_cast<RtStatus>(file.summary.status)));
  }
  file.ticks.resize(elements - 1);
  if (!file.ticks.empty())
    std::memcpy(static_cast<void*>(file.ticks.data()), bytes.data(),
                file.ticks.size() * sizeof(DriveTick));
  return file;
}

/// How two runs of the same drive differ.
struct Difference {
  std::size_t equal = 0;   ///< ticks with equal state hash, wrench and flags
  std::size_t first = 0;   ///< first tick that is not, when not all are
  std::size_t pushed = 0;  ///< ticks with a force
  double force_n = 0, torque_nm = 0;
};

bool same_bits(const double* l, const double* r) {
  return std::equal(l, l + 3, r, [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  });
}

/// Largest of `largest` and the components' differences; one that is no number counts as infinite.
double larger_difference(double largest, const double* l, const double* r) {
  for (int axis = 0; axis < 3; ++axis) {
    const double difference = std::abs(l[axis] - r[axis]);
    largest = std::isnan(difference) ? HUGE_VAL : std::max(largest, difference);
  }
  return largest;
}

Difference difference_of(const DriveFile& here, const DriveFile& there) {
  Difference d;
  d.first = here.ticks.size();
  for (std::size_t k = 0; k < here.ticks.size(); ++k) {
    const DriveTick &l = here.ticks[k], &r = there.ticks[k];
    const bool equal = l.state_hash == r.state_hash && l.flags == r.flags &&
                       same_bits(l.force_w_n, r.force_w_n) &&
                       same_bits(l.torque_w_nm, r.torque_w_nm);
    if (!equal) d.first = std::min(d.first, k);
    d.equal += equal ? 1u : 0u;
    d.pushed +=
        std::any_of(l.force_w_n, l.force_w_n + 3, [](double f) { return f != 0; }) ? 1u : 0u;
    d.force_n = larger_difference(d.force_n, l.force_w_n, r.force_w_n);
    d.torque_nm = larger_difference(d.torque_nm, l.torque_w_nm, r.torque_w_nm);
  }
  return d;
}

void print_cost(const DriveFile& there, double instructions_per_unit) {
  std::vector<double> cost;
  std::size_t worst = 0;
  for (const DriveTick& tick : there.ticks) {
    const std::uint32_t empty = there.summary.empty_clock_units;
    const std::uint32_t units = tick.clock_units > empty ? tick.clock_units - empty : 0;
    cost.push_back(std::round(units * instructions_per_unit));
    if (cost.back() > cost[worst]) worst = cost.size() - 1;
  }
  if (cost.empty()) return;
  const double most = cost[worst];
  const auto at_rank = [&](double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(cost.size() - 1));
    std::nth_element(cost.begin(), cost.begin() + rank, cost.end());
    return cost[static_cast<std::size_t>(rank)];
  };
  const double median = at_rank(0.5), high = at_rank(0.999);
  std::printf(
      "    instructions per tick: median %.0f, p99.9 %.0f, most %.0f (tick %zu); core %" PRIu64
      " bytes of state, scene %" PRIu64 " bytes, stack %" PRIu32 " of %" PRIu32 " bytes\n",
      median, high, most, worst, there.summary.state_bytes, there.summary.scene_bytes,
      there.summary.stack_bytes, there.summary.stack_room_bytes);
}

int compare(const char* name, const DriveFile& here, const DriveFile& there, double per_unit) {
  if (here.summary.scalar_bytes != there.summary.scalar_bytes ||
      here.summary.scene_hash != there.summary.scene_hash ||
      here.ticks.size() != there.ticks.size()) {
    throw tools::InputError(std::string(name) + ": the two ran other scenes, scalars or motions");
  }
  const Difference d = difference_of(here, there);
  const bool equal = d.equal == here.ticks.size();
  std::printf(
      "%s, %s: %zu ticks, %zu with force, %zu equal in every bit, largest difference %g N, %g N "
      "m%s\n",
      name, here.summary.scalar_bytes == 4 ? "float" : "double", here.ticks.size(), d.pushed,
      d.equal, d.force_n, d.torque_nm,
      equal ? "" : (", first in tick " + std::to_string(d.first)).c_str());
  if (per_unit > 0) print_cost(there, per_unit);
  if (equal && d.pushed == 0) {
    std::fprintf(stderr, "compare_drives: %s: no tick felt a force; that compares nothing\n", name);
  }
  if (there.summary.stack_room_bytes != 0 &&
      there.summary.stack_bytes >= there.summary.stack_room_bytes) {
    std::fprintf(stderr, "compare_drives: %s: the stack was used to its end\n", name);
    return tools::kExitCheckFailed;
  }
  return equal && d.pushed > 0 ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

int main(int argc, char** argv) {
  double per_unit = 0;
  if (argc == 6) {
    const double units = std::strtod(argv[4], nullptr);
    per_unit = units > 0 ? std::strtod(argv[5], nullptr) / units : 0;
  }
  if (argc != 4 && !(argc == 6 && per_unit > 0)) {
    std::fputs("usage: compare_drives NAME HERE THERE [UNITS INSTRUCTIONS]\n", stderr);
    return tools::kExitUsage;
  }
  return tools::run_main("compare_drives", [&] {
    return compare(argv[1], read_drive(argv[2]), read_drive(argv[3]), per_unit);
  });
}
