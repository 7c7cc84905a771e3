// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/contact_reference.hpp"

#include <charconv>
#include <cmath>
#include <fstream>

#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {

std::vector<ReferenceSample> read_contact_reference(const std::string& path) {
  tools::note_input(path, "the reference");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw tools::InputError(path + ": cannot be opened; check the name");
  std::vector<ReferenceSample> samples;
  std::string line;
  std::size_t number = 0;
  while (std::getline(stream, line)) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::string place = path + ":" + std::to_string(number) + ": ";
    if (number == 1) {
      if (line != "t,contact") throw tools::InputError(place + "the header must be 't,contact'");
      continue;
    }
    if (line.empty()) continue;
    ReferenceSample sample;
    const char* end = line.data() + line.size();
    const auto parsed = std::from_chars(line.data(), end, sample.t_s);
    const std::string_view flag(parsed.ptr, static_cast<std::size_t>(end - parsed.ptr));
    if (parsed.ec != std::errc() || !std::isfinite(sample.t_s)) {
      throw tools::InputError(place + "the line must start with a time in s");
    }
    if (flag == ",1") {
      sample.flag = ReferenceFlag::kContact;
    } else if (flag == ",0") {
      sample.flag = ReferenceFlag::kFree;
    } else if (flag != ",u") {
      throw tools::InputError(place + "after the time comes ',1', ',0' or ',u'");
    }
    if (!samples.empty() && sample.t_s <= samples.back().t_s) {
      throw tools::InputError(place + "times must increase");
    }
    samples.push_back(sample);
  }
  if (samples.empty()) throw tools::InputError(path + ": has no samples");
  return samples;
}

ReferenceTotals compare_with_reference(std::span<const ReferenceSample> samples,
                                       std::span<const TickRecord> ticks, double tolerance_s) {
  ReferenceTotals totals;
  std::size_t k = 0;
  for (const ReferenceSample& sample : samples) {
    const auto distance = [&](std::size_t i) { return std::abs(ticks[i].t_s - sample.t_s); };
    while (k + 1 < ticks.size() && distance(k + 1) <= distance(k)) ++k;
    if (ticks.empty() || distance(k) > tolerance_s) {
      ++totals.unmatched;
      continue;
    }
    const bool contact = ticks[k].d_near_m <= 0;
    if (sample.flag == ReferenceFlag::kUndecided) {
      ++totals.undecided;
      continue;
    }
    const bool expected = sample.flag == ReferenceFlag::kContact;
    ++(expected ? totals.contact : totals.free);
    if (contact == expected) continue;
    if (totals.wrong++ == 0) totals.first_wrong_t_s = sample.t_s;
  }
  return totals;
}

}  // namespace haptic::sim
