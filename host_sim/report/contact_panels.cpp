// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/contact_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace haptic::sim {
namespace {

// Colours that stay apart for colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 7> kSituationColours = {
    "#ffffff", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#000000", "#cc79a7"};
static_assert(kSituationColours.size() == static_cast<std::size_t>(ContactSituation::kCount));

constexpr double kLeastDepth_mm = 0.01;

}  // namespace

std::string depth_panel(Panel panel, std::span<const double> times,
                        std::span<const double> d_near_mm) {
  double low = 0, high = 0;
  bool searched = false;
  for (const double mm : d_near_mm) {
    if (!std::isfinite(mm)) continue;
    searched = true;
    low = std::min(low, mm);
    high = std::max(high, mm);
  }
  const double top = std::max(low < 0 ? std::min(high, -6 * low) : high, kLeastDepth_mm);
  panel.low = low - 0.08 * (top - low);
  panel.high = top + 0.08 * (top - low);
  std::string svg = panel_frame(panel, "d_near (mm)", false);
  const double y_zero = panel.y_of(0.0);
  svg += "<rect x=\"" + pixel(panel.left) + "\" y=\"" + pixel(y_zero) + "\" width=\"" +
         pixel(panel.width) + "\" height=\"" + pixel(panel.top + panel.height - y_zero) +
         "\" fill=\"#d55e00\" fill-opacity=\"0.08\"/>\n";
  // A piece of curve for each stretch inside the panel: a line along its edge would be no value.
  for (std::size_t begin = 0, end = 0; begin < times.size(); begin = end) {
    const auto inside = [&](std::size_t i) { return d_near_mm[i] <= panel.high; };
    while (begin < times.size() && !inside(begin)) ++begin;
    for (end = begin; end < times.size() && inside(end);) ++end;
    if (end > begin)
      svg += curve(panel, times.subspan(begin, end - begin), d_near_mm.subspan(begin, end - begin),
                   "#000000", 1.4);
  }
  const double x = panel.left + panel.width + 14;
  svg += line_key(x, panel.top + 16, "#000000", 1.4, "d_near: gap at the");
  svg += text_at(x + 30, panel.top + 36, "asked pose", "start", 13);
  svg += text_at(x, panel.top + 60, "shaded: inside", "start", 12);
  svg += text_at(x, panel.top + 76, "an obstacle", "start", 12);
  if (!searched) svg += text_at(x, panel.top + 100, "not searched", "start", 12);
  if (top < high)
    svg += text_at(x, panel.top + 100, "left out above " + mark_label(panel.high, 0.1) + " mm",
                   "start", 12);
  return svg;
}

std::string situation_band(const Panel& panel, std::span<const double> times,
                           std::span<const ContactSituation> situations, double key_y) {
  std::string svg;
  std::array<bool, kSituationColours.size()> seen{};
  const auto column_of = [&](double t) {
    return static_cast<int>(std::floor(panel.x_of(t) - panel.left));
  };
  int run_begin = 0;
  std::size_t run_code = 0;
  const auto flush = [&](int end) {
    if (run_code != 0 && end > run_begin) {
      svg += "<rect x=\"" + pixel(panel.left + run_begin) + "\" y=\"" + pixel(panel.top) +
             "\" width=\"" + std::to_string(end - run_begin) + "\" height=\"" +
             pixel(panel.height) + "\" fill=\"" + kSituationColours[run_code] + "\"/>\n";
    }
  };
  for (std::size_t i = 0, end = 0; i < times.size(); i = end) {
    const int column = column_of(times[i]);
    std::array<std::size_t, kSituationColours.size()> counts{};
    for (end = i; end < times.size() && column_of(times[end]) == column; ++end) {
      const auto code = std::min(static_cast<std::size_t>(situations[end]), counts.size() - 1);
      ++counts[code];
      seen[code] = true;
    }
    std::size_t code = 0;
    for (std::size_t c = 1; c < counts.size(); ++c) {
      if (counts[c] > 0 && (code == 0 || counts[c] > counts[code])) code = c;
    }
    if (code != run_code) {
      flush(column);
      run_begin = column;
      run_code = code;
    }
  }
  flush(static_cast<int>(panel.width));
  svg += band_frame(panel, "situation", true);
  double x = panel.left;
  for (std::size_t c = 0; c < seen.size(); ++c) {
    if (!seen[c]) continue;
    svg += colour_key(x, key_y, kSituationColours[c], to_text(static_cast<ContactSituation>(c)));
    x += 130;
  }
  return svg;
}

std::vector<Release> sudden_releases(std::span<const double> times, std::span<const double> force_n,
                                     std::size_t most) {
  double largest = 0;
  for (const double f : force_n) largest = std::max(largest, f);
  const double least = std::max(0.25 * largest, 0.2);
  std::vector<Release> found;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (force_n[i - 1] - force_n[i] >= least)
      found.push_back({times[i], force_n[i - 1], force_n[i]});
  }
  const auto fall = [](const Release& r) { return r.before_n - r.after_n; };
  std::stable_sort(found.begin(), found.end(),
                   [&](const Release& a, const Release& b) { return fall(a) > fall(b); });
  if (found.size() > most) found.resize(most);
  std::sort(found.begin(), found.end(),
            [](const Release& a, const Release& b) { return a.t_s < b.t_s; });
  return found;
}

std::string release_marks(const Panel& panel, std::span<const Release> releases, bool named) {
  std::string svg;
  double y = panel.top + 16;
  for (const Release& r : releases) {
    const double x = panel.x_of(r.t_s);
    svg += "<line x1=\"" + pixel(x) + "\" y1=\"" + pixel(panel.top) + "\" x2=\"" + pixel(x) +
           "\" y2=\"" + pixel(panel.top + panel.height) +
           "\" stroke=\"#cc0000\" stroke-width=\"1\" stroke-dasharray=\"4 3\"/>\n";
    if (!named) continue;
    const bool left = x > panel.left + 0.7 * panel.width;
    svg += text_at(x + (left ? -6 : 6), y,
                   "released in one tick: " + mark_label(r.before_n, 0.1) + " to " +
                       mark_label(r.after_n, 0.1) + " N",
                   left ? "end" : "start", 12, "fill=\"#cc0000\"");
    y += 16;
  }
  return svg;
}

}  // namespace haptic::sim
