// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/cost/cost_comparison.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <string_view>

#include "host_sim/report/quantile.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;

constexpr std::size_t kMaxTableBytes = std::size_t{1} << 30;

/// Cells of a line without its end.
std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(',', begin);
    cells.push_back(line.substr(begin, end == std::string_view::npos ? end : end - begin));
    if (end == std::string_view::npos) return cells;
    begin = end + 1;
  }
}

/// A table of ticks, its columns found by name.
class EarlierTable {
 public:
  EarlierTable(const std::string& text, const std::string& file) : rest_(text), file_(file) {
    if (!next()) fail("no header");
    columns_ = cells_;
  }

  /// The next line, if there is one.
  bool next() {
    if (rest_.empty()) return false;
    line_ += 1;
    const std::size_t end = rest_.find('\n');
    cells_ = cells_of(rest_.substr(0, end));
    rest_ = end == std::string_view::npos ? std::string_view() : rest_.substr(end + 1);
    if (!columns_.empty() && cells_.size() != columns_.size())
      fail(std::to_string(cells_.size()) + " cells and not " + std::to_string(columns_.size()));
    return true;
  }

  [[nodiscard]] std::size_t column(const char* name) const {
    const auto at = std::ranges::find(columns_, name);
    if (at == columns_.end()) fail("no column " + std::string(name) + "; not of a cost report");
    return static_cast<std::size_t>(at - columns_.begin());
  }

  /// An empty cell is 0.
  template <typename Number>
  [[nodiscard]] Number number(std::size_t column) const {
    const std::string_view text = cells_[column];
    Number value{};
    if (text.empty()) return value;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
      fail("'" + std::string(text) + "' is no number");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw tools::InputError(file_ + ":" + std::to_string(line_) + ": " + what);
  }

  std::string_view rest_;
  std::string file_;
  std::vector<std::string_view> columns_, cells_;
  std::size_t line_ = 0;
};

/// Columns of a tick that are compared, in the order of EarlierTick.
constexpr const char* kCompared[] = {"fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm", "px_m",
                                     "py_m", "pz_m", "qw",   "qx",    "qy",    "qz"};

template <std::size_t N>
bool equal(const double (&l)[N], const double (&r)[N]) {
  return std::equal(l, l + N, r);
}

/// Length of the difference; infinite where one of both is no number.
double apart(const double (&l)[3], const double (&r)[3]) {
  const double d = std::hypot(l[0] - r[0], l[1] - r[1], l[2] - r[2]);
  return std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
}

/// Angle between two orientations, exact for small ones too: twice the arc sine of half the
/// distance between the unit quaternions, of the nearer sign.
double turned_rad(const double (&l)[4], const double (&r)[4]) {
  double minus = 0, plus = 0;
  for (int i = 0; i < 4; ++i) {
    minus += (l[i] - r[i]) * (l[i] - r[i]);
    plus += (l[i] + r[i]) * (l[i] + r[i]);
  }
  const double chord = std::sqrt(std::min(minus, plus));
  if (std::isnan(chord)) return std::numeric_limits<double>::infinity();
  return 4 * std::asin(std::min(1.0, chord / 2));
}

DifferenceFigures difference_figures(std::vector<double> sizes) {
  if (sizes.empty()) return {};
  std::ranges::sort(sizes);
  return {sizes.back(), quantile(sizes, 0.99)};
}

template <typename Tick>
std::optional<InstructionFigures> instructions_of(const std::vector<Tick>& ticks) {
  std::vector<std::uint64_t> counts;
  for (const Tick& tick : ticks) counts.push_back(tick.instructions);
  if (counts.empty() || std::ranges::find(counts, 0u) != counts.end()) return std::nullopt;
  std::ranges::sort(counts);
  const double sum = std::accumulate(counts.begin(), counts.end(), 0.0);
  return InstructionFigures{sum / static_cast<double>(counts.size()), quantile(counts, 0.99),
                            counts.back()};
}

}  // namespace

std::optional<EarlierRun> read_earlier_run(const std::string& folder, const std::string& name) {
  const std::string file = folder + "/" + name + ".csv";
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return std::nullopt;
  const std::string text = tools::read_text_file(file, kMaxTableBytes, "the earlier report");
  EarlierTable table(text, file);
  const std::size_t t_s = table.column("t_s"), instructions = table.column("instructions");
  std::vector<std::size_t> columns;
  for (const char* each : kCompared) columns.push_back(table.column(each));
  EarlierRun run;
  while (table.next()) {
    EarlierTick tick;
    tick.t_s = table.number<double>(t_s);
    tick.instructions = table.number<std::uint64_t>(instructions);
    for (std::size_t k = 0; k < 3; ++k) {
      tick.force_n[k] = table.number<double>(columns[k]);
      tick.torque_nm[k] = table.number<double>(columns[3 + k]);
      tick.proxy_m[k] = table.number<double>(columns[6 + k]);
    }
    for (std::size_t k = 0; k < 4; ++k) tick.proxy_wxyz[k] = table.number<double>(columns[9 + k]);
    run.ticks.push_back(tick);
  }
  const std::string motion = folder + "/" + name + "_motion.csv";
  if (std::filesystem::exists(motion, error))
    run.motion = tools::read_text_file(motion, kMaxTableBytes, "the earlier motion");
  return run;
}

CostDifference difference_of(const CostRun& run, const std::string& motion,
                             const std::optional<EarlierRun>& earlier) {
  CostDifference d;
  d.scene = run.name;
  if (!earlier) {
    d.missing = "the scene";
    return d;
  }
  // Ticks of another motion are other ticks.
  if (earlier->motion != motion) {
    d.missing = earlier->motion.empty() ? "its motion" : "the same motion";
    return d;
  }
  if (earlier->ticks.size() != run.ticks.size()) {
    d.missing = "ticks: " + std::to_string(earlier->ticks.size()) + " and not " +
                std::to_string(run.ticks.size());
  }
  d.ticks = std::min(run.ticks.size(), earlier->ticks.size());
  std::vector<double> force_n, torque_nm, proxy_m, proxy_rad;
  for (std::size_t i = 0; i < d.ticks; ++i) {
    const CostTick& now = run.ticks[i];
    const EarlierTick& then = earlier->ticks[i];
    const bool same = equal(now.force_n, then.force_n) && equal(now.torque_nm, then.torque_nm) &&
                      equal(now.proxy_m, then.proxy_m) && equal(now.proxy_wxyz, then.proxy_wxyz);
    if (!same && d.differing == 0) d.first_differing = i;
    if (!same) d.differing += 1;
    force_n.push_back(apart(now.force_n, then.force_n));
    torque_nm.push_back(apart(now.torque_nm, then.torque_nm));
    proxy_m.push_back(apart(now.proxy_m, then.proxy_m));
    proxy_rad.push_back(turned_rad(now.proxy_wxyz, then.proxy_wxyz));
  }
  d.largest_at =
      static_cast<std::size_t>(std::max_element(force_n.begin(), force_n.end()) - force_n.begin());
  d.force_n = difference_figures(std::move(force_n));
  d.torque_nm = difference_figures(std::move(torque_nm));
  d.proxy_m = difference_figures(std::move(proxy_m));
  d.proxy_rad = difference_figures(std::move(proxy_rad));
  d.before = instructions_of(earlier->ticks);
  d.after = instructions_of(run.ticks);
  return d;
}

bool all_compared(std::span<const CostDifference> differences) {
  return std::ranges::all_of(differences,
                             [](const CostDifference& d) { return d.missing.empty(); });
}

std::string comparison_csv(std::span<const CostDifference> differences) {
  ReportTable table(
      "scene,missing,ticks,differing,first_differing,force_largest_n,force_p99_n,force_largest_"
      "tick,"
      "torque_largest_nm,torque_p99_nm,proxy_largest_m,proxy_p99_m,proxy_largest_rad,proxy_p99_rad,"
      "instructions_mean_before,instructions_mean_after,instructions_p99_before,"
      "instructions_p99_after,instructions_largest_before,instructions_largest_after");
  for (const CostDifference& d : differences) {
    const auto mean = [](const std::optional<InstructionFigures>& f) {
      return f ? shown_as("%.1f", f->mean) : Cell();
    };
    const auto count = [](const std::optional<InstructionFigures>& f,
                          std::uint64_t InstructionFigures::*figure) {
      return f ? Cell((*f).*figure) : Cell();
    };
    table.add({d.scene,
               quoted(d.missing),
               d.ticks,
               d.differing,
               d.differing > 0 ? Cell(d.first_differing) : Cell(),
               d.force_n.largest,
               d.force_n.p99,
               d.differing > 0 ? Cell(d.largest_at) : Cell(),
               d.torque_nm.largest,
               d.torque_nm.p99,
               d.proxy_m.largest,
               d.proxy_m.p99,
               d.proxy_rad.largest,
               d.proxy_rad.p99,
               mean(d.before),
               mean(d.after),
               count(d.before, &InstructionFigures::p99),
               count(d.after, &InstructionFigures::p99),
               count(d.before, &InstructionFigures::largest),
               count(d.after, &InstructionFigures::largest)});
  }
  return table.csv();
}

std::string comparison_table(std::span<const CostDifference> differences) {
  std::string text;
  append_line(text,
              "differences from the earlier report, largest and 99th percentile of the ticks");
  append_line(text, "  %-10s %7s %8s %10s %10s %10s %10s %10s %10s", "scene", "ticks", "differ",
              "force N", "p99", "torque Nm", "p99", "proxy um", "p99");
  for (const CostDifference& d : differences) {
    append_line(text, "  %-10s %7zu %8zu %10.3g %10.3g %10.3g %10.3g %10.3g %10.3g%s%s",
                d.scene.c_str(), d.ticks, d.differing, d.force_n.largest, d.force_n.p99,
                d.torque_nm.largest, d.torque_nm.p99, 1e6 * d.proxy_m.largest, 1e6 * d.proxy_m.p99,
                d.missing.empty() ? "" : "  MISSING in the earlier report: ", d.missing.c_str());
  }
  append_line(text, "instructions per tick, earlier and now");
  append_line(text, "  %-10s %10s %10s %7s %10s %10s %7s %10s %10s %7s", "scene", "mean", "now",
              "ratio", "p99", "now", "ratio", "largest", "now", "ratio");
  for (const CostDifference& d : differences) {
    if (!d.before || !d.after) {
      append_line(text, "  %-10s not counted in %s", d.scene.c_str(),
                  d.before ? "this report" : "the earlier report");
      continue;
    }
    const auto whole = [](std::uint64_t n) { return static_cast<double>(n); };
    append_line(text, "  %-10s %10.0f %10.0f %7.3f %10.0f %10.0f %7.3f %10.0f %10.0f %7.3f",
                d.scene.c_str(), d.before->mean, d.after->mean, d.after->mean / d.before->mean,
                whole(d.before->p99), whole(d.after->p99),
                whole(d.after->p99) / whole(d.before->p99), whole(d.before->largest),
                whole(d.after->largest), whole(d.after->largest) / whole(d.before->largest));
  }
  return text;
}

}  // namespace haptic::sim
