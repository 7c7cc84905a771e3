// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/stranger_judge.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <map>

#include "host_sim/session/child_run.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

/// Poses of a motion that triangles are asked about: of suspicious ticks, and of all with a force.
constexpr std::size_t kSuspects = 6, kOthers = 6;
/// Ticks of force beyond the meant parts' that make a wall, not a bump.
constexpr std::size_t kWallTicks = 20;
/// Of all ticks, that must be stuck for a part to be called so.
constexpr std::size_t kStuckShare = 10;

constexpr const char* kFaultNames[] = {"REFUSED", "STUCK", "LEFT", "RECOVERY", "FREE",    "WALL",
                                       "MORE",    "LATE",  "AIR",  "EXIT",     "NO TOUCH"};
static_assert(std::size(kFaultNames) == static_cast<std::size_t>(StrangerFault::kCount));

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return cells;
}

double number_of(std::string_view text) {
  double value = std::nan("");
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Rotation rotation_of_sample(const MotionSample& s) {
  return {s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3]};
}

bool flagged(const PlayedTick& tick, std::uint32_t flags) { return (tick.flags & flags) != 0; }

/// Longest run of ticks in a row.
std::size_t longest_run(const std::vector<char>& marks) {
  std::size_t longest = 0, run = 0;
  for (const char mark : marks) {
    run = mark != 0 ? run + 1 : 0;
    longest = std::max(longest, run);
  }
  return longest;
}

/// Ticks of the runs that do not pass at once.
std::vector<std::size_t> lasting(const std::vector<char>& marks) {
  std::vector<std::size_t> ticks;
  std::size_t begin = 0;
  for (std::size_t k = 0; k <= marks.size(); ++k) {
    if (k < marks.size() && marks[k] != 0) continue;
    for (std::size_t i = begin; k - begin > kPassingTicks && i < k; ++i) ticks.push_back(i);
    begin = k + 1;
  }
  return ticks;
}

/// At most `count` of them, spread evenly.
std::vector<std::size_t> spread(const std::vector<std::size_t>& ticks, std::size_t count) {
  if (ticks.size() <= count) return ticks;
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < count; ++k)
    chosen.push_back(ticks[(2 * k + 1) * ticks.size() / (2 * count)]);
  return chosen;
}

std::string place_text(const HandMotion* hand, std::size_t tick) {
  if (hand == nullptr || tick >= hand->phases.size()) return formatted("tick %zu", tick);
  return formatted("tick %zu (%s)", tick, hand->phases[tick].c_str());
}

}  // namespace

std::vector<PlayedTick> read_played_ticks(const std::string& path) {
  const std::string text = file_text(path);
  if (text.empty()) throw tools::InputError(path + ": cannot be read, or is empty");
  std::map<std::string_view, std::size_t> column;
  std::vector<PlayedTick> ticks;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::vector<std::string_view> cells = cells_of(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (column.empty()) {
      for (std::size_t k = 0; k < cells.size(); ++k) column[cells[k]] = k;
      continue;
    }
    const auto number = [&](const char* name) {
      const auto at = column.find(name);
      return at == column.end() || at->second >= cells.size() ? std::nan("")
                                                              : number_of(cells[at->second]);
    };
    PlayedTick tick;
    tick.force_n = {number("fx_n"), number("fy_n"), number("fz_n")};
    tick.torque_nm = {number("tx_nm"), number("ty_nm"), number("tz_nm")};
    tick.touches = cells.at(column.at("state")) != "none";
    tick.flags = static_cast<std::uint32_t>(number("flags"));
    if (column.contains("proxy_x_m")) {
      MotionSample felt;
      constexpr const char* kPlace[] = {"proxy_x_m", "proxy_y_m", "proxy_z_m"};
      constexpr const char* kTurn[] = {"proxy_qw", "proxy_qx", "proxy_qy", "proxy_qz"};
      for (std::size_t k = 0; k < 3; ++k) felt.p[k] = number(kPlace[k]);
      for (std::size_t k = 0; k < 4; ++k) felt.q_wxyz[k] = number(kTurn[k]);
      tick.felt = felt;
    }
    ticks.push_back(tick);
  }
  return ticks;
}

MotionSample HandSprings::felt(const MotionSample& hand, const PlayedTick& tick) const {
  const Rotation q = rotation_of_sample(hand);
  const Vector grip =
      Vector(hand.p[0], hand.p[1], hand.p[2]) + q * grip_m + tick.force_n / k_t_n_per_m;
  const Vector turn = tick.torque_nm / k_r_nm_per_rad;
  const double angle = turn.norm();
  const Rotation turned = angle > 0 ? Rotation(Eigen::AngleAxisd(angle, turn / angle)) * q : q;
  return sample_at(hand.t_s, grip - turned * grip_m, turned);
}

PairTriangles::PairTriangles(const StrangerPair& pair) {
  std::vector<Triangle> fixed;
  for (std::size_t k = 0; k < pair.fixed.size(); ++k) {
    const Rotation q = pair.places[k].rotation();
    const Vector p_m = 1e-3 * pair.places[k].position_mm;
    const WideRotation turn = rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z()));
    const WideVec move{widen(p_m[0]), widen(p_m[1]), widen(p_m[2])};
    for (const Triangle& t : file_triangles(pair.fixed[k]))
      fixed.push_back({move + turn * t[0], move + turn * t[1], move + turn * t[2]});
  }
  meshes_ = std::make_unique<MeshPair>(file_triangles(pair.moving), fixed);
}

bool PairTriangles::apart(const MotionSample& part, double by_m) const {
  const OraclePose pose{rotation_of(widen(part.q_wxyz[0]), widen(part.q_wxyz[1]),
                                    widen(part.q_wxyz[2]), widen(part.q_wxyz[3])),
                        {widen(part.p[0]), widen(part.p[1]), widen(part.p[2])}};
  return meshes_->distance_m(pose, widen(by_m)) >= widen(by_m);
}

PlayedAccount account_of(const std::vector<PlayedTick>& ticks, const HandMotion* hand,
                         const HandSprings& springs, const PairTriangles& triangles,
                         double touching_m) {
  PlayedAccount account;
  account.ticks = ticks.size();
  if (ticks.empty()) return account;
  std::vector<char> loose(ticks.size(), 0), odd(ticks.size(), 0);
  std::vector<std::size_t> pulled;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    const PlayedTick& tick = ticks[k];
    const double force = tick.force_n.norm();
    account.largest_n = std::max(account.largest_n, force);
    account.contact += tick.touches ? 1u : 0u;
    account.stuck += flagged(tick, kFlagProxyStuck) ? 1u : 0u;
    account.behind += flagged(tick, kFlagBehind) ? 1u : 0u;
    account.ramping += flagged(tick, kFlagRamping) ? 1u : 0u;
    if (flagged(tick, kFlagRecovery) && account.recovery++ == 0) account.first_recovery = k;
    // A wrench that is ramped or held at its limit is not that of the springs.
    const bool of_springs = !flagged(tick, kFlagRamping | kFlagRecovery | kFlagSaturated);
    if (!(force > kFalseForce_n)) continue;
    account.stuck_pulled += flagged(tick, kFlagProxyStuck) ? 1u : 0u;
    account.loose += tick.touches ? 0u : 1u;
    if (!of_springs) continue;
    pulled.push_back(k);
    loose[k] = tick.touches ? 0 : 1;
    odd[k] = flagged(tick, kFlagProxyLimited | kFlagProxyStuck | kFlagBehind) ? 1 : 0;
  }
  account.end_n = ticks.back().force_n.norm();

  const auto touches_nothing = [&](std::size_t k) {
    if (ticks[k].felt) return triangles.apart(*ticks[k].felt, touching_m);
    if (hand == nullptr || k >= hand->samples.size()) return false;
    return triangles.apart(springs.felt(hand->samples[k], ticks[k]), touching_m);
  };
  std::vector<std::size_t> suspects = lasting(loose);
  if (suspects.empty()) suspects = lasting(odd);
  std::vector<std::size_t> chosen = spread(suspects, kSuspects);
  for (const std::size_t k : spread(pulled, kOthers)) chosen.push_back(k);
  for (const std::size_t k : chosen) {
    ++account.judged;
    // A tick of a run: those beside it must pull and be apart too.
    bool apart = touches_nothing(k);
    for (const std::size_t other : {k - 1, k + 1}) {
      apart = apart && other < ticks.size() && ticks[other].force_n.norm() > kFalseForce_n &&
              !flagged(ticks[other], kFlagRamping | kFlagRecovery) && touches_nothing(other);
    }
    if (!apart) continue;
    ++account.apart;
    if (ticks[k].force_n.norm() <= account.apart_n) continue;
    account.apart_n = ticks[k].force_n.norm();
    account.apart_at = k;
  }
  if (hand == nullptr) return account;
  for (const std::size_t stop : hand->stops) {
    if (stop + kTicksOfStop >= ticks.size()) continue;
    ++account.stops;
    const auto begin = ticks.begin() + static_cast<std::ptrdiff_t>(stop);
    if (std::any_of(begin, begin + kTicksOfStop,
                    [](const PlayedTick& t) { return flagged(t, kFlagRamping); }))
      continue;
    const double change =
        std::abs(begin[kPassingTicks].force_n.norm() - begin[kTicksOfStop - 1].force_n.norm());
    if (!(change > kFalseForce_n)) continue;
    ++account.late;
    if (change <= account.late_n) continue;
    account.late_n = change;
    account.late_at = stop;
  }
  return account;
}

ForceExcess excess_of(const std::vector<PlayedTick>& ticks,
                      const std::vector<PlayedTick>& reference) {
  ForceExcess excess;
  std::vector<char> more(std::min(ticks.size(), reference.size()), 0);
  for (std::size_t k = 0; k < more.size(); ++k) {
    const double by = ticks[k].force_n.norm() - reference[k].force_n.norm();
    more[k] = by > kFalseForce_n ? 1 : 0;
    excess.ticks += more[k] != 0 ? 1u : 0u;
    excess.largest_difference_n =
        std::max(excess.largest_difference_n, (ticks[k].force_n - reference[k].force_n).norm());
    if (by <= excess.largest_n) continue;
    excess.largest_n = by;
    excess.at = k;
  }
  excess.longest_run = longest_run(more);
  return excess;
}

const char* to_text(StrangerFault fault) { return kFaultNames[static_cast<std::size_t>(fault)]; }

std::vector<std::string> stranger_fault_names() {
  std::vector<std::string> names;
  for (std::string name : kFaultNames) {
    for (char& c : name) c = c == ' ' ? '-' : static_cast<char>(std::tolower(c));
    names.push_back(name);
  }
  return names;
}

std::optional<StrangerFault> stranger_fault_named(const std::string& name) {
  const std::vector<std::string> names = stranger_fault_names();
  const auto at = std::ranges::find(names, name);
  if (at == names.end()) return std::nullopt;
  return static_cast<StrangerFault>(at - names.begin());
}

void find_faults(const std::string& name, const PlayedAccount& a, const HandMotion* hand,
                 std::vector<FoundFault>& found) {
  if (a.apart > 0) {
    const bool stuck = a.stuck_pulled * kStuckShare > a.ticks;
    found.push_back(
        {stuck ? StrangerFault::kStuck : StrangerFault::kFree,
         formatted("%s: %.3f N in the open at %s, %zu of %zu poses judged; ticks: loose "
                   "%zu, stuck %zu, behind %zu",
                   name.c_str(), a.apart_n, place_text(hand, a.apart_at).c_str(), a.apart, a.judged,
                   a.loose, a.stuck_pulled, a.behind)});
  }
  if (hand != nullptr && a.end_n > kFalseForce_n) {
    found.push_back({StrangerFault::kLeft,
                     formatted("%s: %.3f N at the end, in the open", name.c_str(), a.end_n)});
  }
  if (a.recovery > 0) {
    found.push_back(
        {StrangerFault::kRecovery,
         formatted("%s: %zu ticks of recovery, %zu ramped, the first at %s", name.c_str(),
                   a.recovery, a.ramping, place_text(hand, a.first_recovery).c_str())});
  }
  if (a.late > 0) {
    found.push_back(
        {StrangerFault::kLate,
         formatted("%s: %zu of %zu stops, by up to %.3f N at %s; %zu ticks behind", name.c_str(),
                   a.late, a.stops, a.late_n, place_text(hand, a.late_at).c_str(), a.behind)});
  }
}

void find_excess(const std::string& name, const ForceExcess& excess, const HandMotion& hand,
                 bool as_meant, std::vector<FoundFault>& found) {
  if (excess.longest_run <= kPassingTicks) return;
  const bool wall = as_meant && excess.longest_run > kWallTicks;
  found.push_back(
      {wall ? StrangerFault::kWall : StrangerFault::kMore,
       formatted("%s: up to %.3f N more than %s, %zu ticks, %zu in a row, most at %s", name.c_str(),
                 excess.largest_n, as_meant ? "the parts as meant" : "with large budgets",
                 excess.ticks, excess.longest_run, place_text(&hand, excess.at).c_str())});
}

void falsify(std::vector<PlayedTick>& ticks, const HandMotion& hand, StrangerFault fault) {
  constexpr double kForce_n = 0.2;
  const auto pull = [&](std::size_t from, std::size_t count, std::uint32_t flags) {
    for (std::size_t k = from; k < std::min(from + count, ticks.size()); ++k) {
      ticks[k].force_n = Vector(kForce_n, 0, 0);
      ticks[k].torque_nm.setZero();
      ticks[k].touches = false;
      ticks[k].flags = flags;
    }
  };
  constexpr std::size_t kOpen = 10;  // at the start, at rest
  switch (fault) {
    case StrangerFault::kStuck:
      pull(kOpen, ticks.size() / 5, kFlagProxyStuck);
      return;
    case StrangerFault::kLeft:
      pull(ticks.size() - 1, 1, 0);
      return;
    case StrangerFault::kRecovery:
      ticks[ticks.size() / 2].flags |= kFlagRecovery;
      return;
    case StrangerFault::kFree:
    case StrangerFault::kAir:
      pull(kOpen, 2 * kPassingTicks + 1, 0);
      return;
    case StrangerFault::kMore:
      pull(kOpen, kPassingTicks + 1, 0);
      return;
    case StrangerFault::kWall:
      pull(kOpen, kWallTicks + 1, 0);
      return;
    case StrangerFault::kLate: {
      const std::size_t stop = hand.stops[hand.stops.size() / 2];
      for (std::size_t k = stop; k < stop + kTicksOfStop; ++k) {
        ticks[k].flags &= ~kFlagRamping;
        ticks[k].force_n = Vector(k < stop + kTicksOfStop / 2 ? kForce_n : 0, 0, 0);
      }
      return;
    }
    default:
      return;
  }
}

}  // namespace haptic::sim
