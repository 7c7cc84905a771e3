// SPDX-License-Identifier: Apache-2.0
// A verdict in words. Numbers are written here, so that the page's module needs no printf.
#include <algorithm>
#include <cmath>

#include "rt_core/scene/proxy_limits.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {
namespace {

/// Appends to a line; what does not fit is cut off.
class Words {
 public:
  explicit Words(VerdictLine& line) noexcept : line_(line) {}

  Words& operator<<(std::string_view text) noexcept {
    const std::size_t room = line_.text.size() - 1 - size_;
    const std::size_t count = std::min(room, text.size());
    std::copy_n(text.data(), count, line_.text.data() + size_);
    size_ += count;
    line_.text[size_] = '\0';
    return *this;
  }
  Words& operator<<(std::uint64_t value) noexcept {
    std::array<char, 20> digits{};
    std::size_t at = digits.size();
    do {
      digits[--at] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0);
    return *this << std::string_view(digits.data() + at, digits.size() - at);
  }
  /// With `places` digits behind the point, cut off.
  Words& fixed(double value, unsigned places) noexcept {
    constexpr double kMost = 1.0e12;
    std::uint64_t scale = 1;
    for (unsigned k = 0; k < places; ++k) scale *= 10;
    const double whole = std::clamp(value, 0.0, kMost) * static_cast<double>(scale);
    const auto units = static_cast<std::uint64_t>(whole + 1.0e-9);
    *this << units / scale << ".";
    std::uint64_t rest = units % scale;
    for (scale /= 10; scale > 0; scale /= 10) {
      *this << rest / scale;
      rest %= scale;
    }
    return *this;
  }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }

 private:
  VerdictLine& line_;
  std::size_t size_ = 0;
};

std::uint64_t of(const SessionVerdict& v, WhyNot why) noexcept {
  return v.why_not[static_cast<std::size_t>(why)];
}

/// More of it than the scene has; the pairs that there are, where these are not too many.
void add_near_pairs(Words& words, const SessionVerdict& v) noexcept {
  if (v.near_pairs >= kMostNearPairs) {
    words << "parts of fewer pieces help: tolerance_m";
    return;
  }
  constexpr std::uint64_t kFollowedAtOnce = 4096;
  const std::uint64_t most = std::max(kFollowedAtOnce, 2 * std::uint64_t{v.near_pairs});
  words << "[budget] near_pairs = " << std::min({v.pair_count, most, std::uint64_t{kMostNearPairs}})
        << " helps";
}
/// More the more ticks lack it: how much they would have spent nobody knows.
void add_work_units(Words& words, const SessionVerdict& v) noexcept {
  const std::uint64_t behind = of(v, WhyNot::kBehind);
  const std::uint64_t times = 10 * behind > v.ticks ? 16 : 100 * behind > v.ticks ? 4 : 2;
  words << "[budget] work_units = "
        << std::min(times * std::uint64_t{v.work_units}, std::uint64_t{kMostWorkUnits}) << " helps";
}

/// Advice for a part that does not go where it could.
void add_remedy(Words& words, const SessionVerdict& v) noexcept {
  if (of(v, WhyNot::kListFull) > 0) {
    add_near_pairs(words << ": ", v);
  } else if (of(v, WhyNot::kBehind) > 0) {
    add_work_units(words << ": ", v);
  } else {
    words << ", with all pairs and within the budget: please report it with scene and motion";
  }
}

void add_energy(Words& words, const SessionVerdict& v) noexcept {
  words << "the rendering gave out ";
  words.fixed(1.0e3 * v.given_out_j, 1) << " mJ: ";
  words << (v.has_device ? "lower [coupling] k_t_n_per_m and k_r_nm_per_rad"
                         : "give the scene the [device] that it is for");
}

void add_failure(Words& words, const SessionVerdict& v, Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::kForceInTheOpen:
      words << "force without contact: up to ";
      words.fixed(v.open_force_n, 2)
          << " N for " << v.longest_open.ticks << " ticks in a row from tick "
          << v.longest_open.begin << " on, where the part touches nothing";
      add_remedy(words, v);
      break;
    case Outcome::kStuck:
      words << "stuck while free to move for " << v.longest_stuck.ticks
            << " ticks in a row from tick " << v.longest_stuck.begin << " on";
      add_remedy(words, v);
      break;
    case Outcome::kInside:
      words << "the part is inside an obstacle for the last " << v.inside_to_end
            << " ticks and does not come out: give [moving] position_m a place that is free";
      break;
    case Outcome::kBehind:
      words << of(v, WhyNot::kBehind) << " ticks behind: ";
      add_work_units(words, v);
      break;
    case Outcome::kEnergy:
      add_energy(words, v);
      break;
    case Outcome::kNothingTouched:
      words << "the motion touches nothing: give [moving] position_m a place from which the part "
               "meets a fixed one, or write way points";
      break;
    case Outcome::kFollowed:
    case Outcome::kNoTicks:
    case Outcome::kCount:
      break;
  }
}

/// Words for the ticks of one kind.
void add_why(Words& words, const SessionVerdict& v, WhyNot why) noexcept {
  words << of(v, why);
  words << (of(v, why) == 1 ? " tick " : " ticks ");
  switch (why) {
    case WhyNot::kRefused:
      words << "with a pose that cannot be used";
      break;
    case WhyNot::kInside:
      words << "inside an obstacle, without force";
      if (v.started_inside) words << ", from the start: give [moving] position_m a free place";
      break;
    case WhyNot::kOutside:
      words << "after [motion_limits] were left, without force";
      break;
    case WhyNot::kStuck:
      words << "stuck";
      break;
    case WhyNot::kListFull:
      words << "with more pairs near than near_pairs = " << v.near_pairs << ": ";
      add_near_pairs(words, v);
      break;
    case WhyNot::kBehind:
      words << "behind: ";
      add_work_units(words, v);
      break;
    case WhyNot::kSaturated:
      words << "with the pull at its limit";
      break;
    case WhyNot::kRamped:
      words << "with the force ramped";
      break;
    case WhyNot::kCount:
      break;
  }
}

void add_followed(Words& words, const SessionVerdict& v) noexcept {
  const double share = static_cast<double>(v.followed_ticks) / static_cast<double>(v.ticks);
  words << "followed the hand in ";
  if (v.followed_ticks == v.ticks) {
    words << "all " << v.ticks << " ticks";
  } else {
    words.fixed(100 * share, 1) << " % of " << v.ticks << " ticks";
  }
}

}  // namespace

VerdictLine verdict_line(const SessionVerdict& v, std::string_view other) noexcept {
  VerdictLine line;
  Words words(line);
  const bool failed = v.failed() || !other.empty();
  if (failed) words << "FAILED: " << other;
  bool first = other.empty();
  for (unsigned k = 0; k < static_cast<unsigned>(Outcome::kCount); ++k) {
    const auto outcome = static_cast<Outcome>(k);
    if (!v.has(outcome)) continue;
    if (!first) words << "; ";
    first = false;
    add_failure(words, v, outcome);
  }
  if (failed) words << "; ";
  if (v.ticks == 0) {
    words << "no tick was made";
    return line;
  }
  add_followed(words, v);
  for (std::size_t k = 0; k < kWhyNots; ++k) {
    const auto why = static_cast<WhyNot>(k);
    const bool told = (why == WhyNot::kBehind && v.has(Outcome::kBehind)) ||
                      (why == WhyNot::kInside && v.has(Outcome::kInside));
    if (v.why_not[k] == 0 || told) continue;
    add_why(words << "; ", v, why);
  }
  if (v.contact_ticks == 0 && !v.has(Outcome::kNothingTouched))
    words << "; the part touched nothing";
  return line;
}

}  // namespace haptic::tools
