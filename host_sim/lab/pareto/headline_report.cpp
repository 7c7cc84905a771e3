// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/headline_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "host_sim/lab/peers/core_peer.hpp"
#include "host_sim/report/picture.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

constexpr double kMilli = 1e3;  // torques in mN m

double ratio(double value, double of) {
  return of > 0 ? value / of : std::numeric_limits<double>::quiet_NaN();
}

/// Three digits where that reads well, else one and the power of ten.
std::string digits_of(double value) {
  if (std::isnan(value)) return "-";
  if (value == 0 || (value >= 0.00995 && value < 9999.5))
    return formatted(value >= 99.5 ? "%.0f" : value >= 0.995 ? "%.3g" : "%.2g", value);
  const std::string text = formatted("%.0e", value);  // 3e-04: without the zero
  const std::size_t e = text.find('e');
  return text.substr(0, e + 1) + std::to_string(std::stoi(text.substr(e + 1)));
}

std::string amount(double value, const char* unit) { return digits_of(value) + " " + unit; }

std::string microseconds(double ns) { return amount(1e-3 * ns, "us"); }

/// "square peg (5)": title up to its comma, and pairs.
std::string short_title(const HeadlineMeasure& m) {
  return m.title.substr(0, m.title.find(',')) + " (" + std::to_string(m.pairs) + ")";
}

std::vector<std::string> scene_heads(const std::vector<HeadlineMeasure>& measures,
                                     const std::string& first) {
  std::vector<std::string> heads{first};
  for (const HeadlineMeasure& m : measures) heads.push_back(short_title(m));
  return heads;
}

/// A line per method, a column per scene.
std::string method_table(const std::vector<HeadlineMeasure>& measures, const std::string& head,
                         const std::function<std::string(const HeadlineMethod&)>& cell) {
  std::string text = table_head(scene_heads(measures, head));
  for (std::size_t k = 0; k < measures.front().methods.size(); ++k) {
    std::vector<std::string> cells{measures.front().methods[k].title};
    for (const HeadlineMeasure& m : measures) cells.push_back(cell(m.methods[k]));
    text += table_row(cells);
  }
  return text + "\n";
}

/// What a user would pick instead: the first library that was found, else the paper's law.
const HeadlineMethod& instead_of(const HeadlineMeasure& measure) {
  for (const HeadlineMethod& m : measure.methods) {
    if (m.name.starts_with("penalty")) return m;
  }
  return *measure.method("paper");
}

std::string ratio_table(const std::vector<HeadlineMeasure>& measures) {
  const std::string other = instead_of(measures.front()).title;
  std::string text = table_head({other + " over the default law", "median time of a tick",
                                 "force error, 99 %", "largest step of the force"});
  for (const HeadlineMeasure& m : measures) {
    const HeadlineMethod &own = *m.method(kDefaultMethod), &instead = instead_of(m);
    text += table_row({short_title(m), digits_of(ratio(instead.time_ns.median, own.time_ns.median)),
                       digits_of(ratio(instead.force_n.p99, own.force_n.p99)),
                       digits_of(ratio(instead.force_step_n, own.force_step_n))});
  }
  return text + "\n";
}

/// The reference's own figures, a column per scene.
std::string reference_table(const std::vector<HeadlineMeasure>& measures) {
  std::vector<std::string> ticks{"ticks in contact"}, forces{"largest force"};
  std::vector<std::string> torques{"largest torque"}, steps{"largest step of the force"};
  for (const HeadlineMeasure& m : measures) {
    ticks.push_back(std::to_string(m.reference.in_contact.size()));
    forces.push_back(amount(m.reference.largest_force_n, "N"));
    torques.push_back(amount(kMilli * m.reference.largest_torque_nm, "mN m"));
    steps.push_back(amount(m.reference.force_step_n, "N"));
  }
  return table_head(scene_heads(measures, "reference")) + table_row(ticks) + table_row(forces) +
         table_row(torques) + table_row(steps) + "\n";
}

// The picture.

enum class Quantity { kForce, kTorque, kTime };

struct Column {
  Quantity quantity;
  const char* label;
  double floor;  ///< what is below is drawn here
};
constexpr Column kColumns[] = {{Quantity::kForce, "force error (N)", 1e-10},
                               {Quantity::kTorque, "torque error (mN m)", 1e-8},
                               {Quantity::kTime, "time of a tick", 1e2}};
constexpr double kRowHeight = 24, kPanelWidth = 262, kColumnGap = 42, kNamesWidth = 226;
constexpr double kPictureTop = 92, kSceneGap = 86, kPictureLeft = 16;
constexpr int kBins = 72;

const char* colour_of(const HeadlineMethod& m) {
  if (m.name == kDefaultMethod) return "#d55e00";
  if (m.name.starts_with("proxy")) return "#e69f00";
  return m.name.starts_with("penalty") ? "#0072b2" : "#666666";
}

double scale_of(Quantity quantity) { return quantity == Quantity::kTorque ? kMilli : 1; }

const std::vector<double>& values_of(const HeadlineMethod& m, Quantity quantity) {
  if (quantity == Quantity::kForce) return m.force_error_n;
  return quantity == Quantity::kTorque ? m.torque_error_nm : m.ns;
}

const Spread& spread_in(const HeadlineMethod& m, Quantity quantity) {
  if (quantity == Quantity::kForce) return m.force_n;
  return quantity == Quantity::kTorque ? m.torque_nm : m.time_ns;
}

/// Range of a column over all scenes, out to powers of ten.
std::array<double, 2> range_of(const std::vector<HeadlineMeasure>& measures, const Column& column) {
  double high = 10 * column.floor;
  for (const HeadlineMeasure& measure : measures) {
    for (const HeadlineMethod& m : measure.methods) {
      if (m.drawn) {
        high = std::max(high, scale_of(column.quantity) * spread_in(m, column.quantity).largest);
      }
    }
  }
  return {column.floor, std::pow(10.0, std::ceil(std::log10(high)))};
}

/// The share of the values per bin of the axis, as a band about `y`; its width goes with the square
/// root, so that one tick in a hundred is still seen.
std::string violin(const std::vector<double>& values, double scale, const LogPanel& panel, double y,
                   const char* colour) {
  std::array<double, kBins> bins{};
  const double bin_width = panel.width / kBins;
  for (const double value : values) {
    const double at = (panel.x_of(scale * value) - panel.left) / bin_width;
    bins[std::min<std::size_t>(kBins - 1, static_cast<std::size_t>(std::max(0.0, at)))] += 1;
  }
  std::array<double, kBins> smooth{};
  for (int k = 0; k < kBins; ++k) {
    for (int j = -1; j <= 1; ++j) {
      const int from = std::clamp(k + j, 0, kBins - 1);
      smooth[static_cast<std::size_t>(k)] +=
          (j == 0 ? 0.5 : 0.25) * bins[static_cast<std::size_t>(from)];
    }
  }
  const double most = *std::ranges::max_element(smooth);
  if (!(most > 0)) return {};
  std::string svg;
  std::vector<Pixel> upper, lower;
  const auto close = [&] {
    if (!upper.empty()) {
      upper.insert(upper.end(), lower.rbegin(), lower.rend());
      svg += polygon_of(upper, formatted("fill=\"%s\" fill-opacity=\"0.45\" stroke=\"%s\" "
                                         "stroke-width=\"0.8\"",
                                         colour, colour));
    }
    upper.clear();
    lower.clear();
  };
  for (int k = 0; k < kBins; ++k) {
    const double share = smooth[static_cast<std::size_t>(k)] / most;
    if (share <= 0) {
      close();
      continue;
    }
    const double half = std::max(0.8, 0.44 * kRowHeight * std::sqrt(share));
    const double x = panel.left + (k + 0.5) * bin_width;
    upper.push_back({x, y - half});
    lower.push_back({x, y + half});
  }
  close();
  return svg;
}

/// Median as a bar, 99 % as a dot, the largest as a cross.
std::string spread_marks(const Spread& spread, double scale, const LogPanel& panel, double y) {
  const double median = panel.x_of(scale * spread.median), p99 = panel.x_of(scale * spread.p99);
  const double largest = panel.x_of(scale * spread.largest);
  return line_at({median, y - 8}, {median, y + 8}, "#000000", 2.4) +
         formatted(
             "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.2\" fill=\"#000000\" stroke=\"#ffffff\" "
             "stroke-width=\"0.8\"/>\n",
             p99, y) +
         line_at({largest - 3.5, y - 3.5}, {largest + 3.5, y + 3.5}, "#000000", 1.6) +
         line_at({largest - 3.5, y + 3.5}, {largest + 3.5, y - 3.5}, "#000000", 1.6);
}

std::string picture_legend(double y) {
  double x = kPictureLeft;
  std::string svg;
  const auto swatch = [&](const char* colour, const std::string& words, double step) {
    svg += rectangle_at({x, y - 9}, 18, 11, colour, "fill-opacity=\"0.6\"") +
           text_at(x + 24, y, words, "start", 13);
    x += step;
  };
  swatch("#d55e00", "default law", 118);
  swatch("#e69f00", "one pass of it", 132);
  swatch("#666666", "laws that sum over contacts", 234);
  swatch("#0072b2", "penalty on a library", 172);
  const auto sign = [&](const std::string& marks, const std::string& words, double step) {
    svg += marks + text_at(x + 12, y, words, "start", 13);
    x += step;
  };
  sign(line_at({x, y - 12}, {x, y + 3}, "#000000", 2.4), "median", 76);
  sign(formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.2\" fill=\"#000000\"/>\n", x, y - 4),
       "99 %", 62);
  sign(line_at({x - 3.5, y - 7.5}, {x + 3.5, y - 0.5}, "#000000", 1.6) +
           line_at({x - 3.5, y - 0.5}, {x + 3.5, y - 7.5}, "#000000", 1.6),
       "largest", 74);
  return svg + text_at(x, y, "at the left edge: there or below", "start", 13, "fill=\"#606060\"");
}

}  // namespace

ReportTable headline_table(const std::vector<HeadlineMeasure>& measures) {
  ReportTable table(
      "scene,pairs,method,scalar,ticks,ticks_in_contact,median_ns,p99_ns,max_ns,"
      "median_force_error_n,p99_force_error_n,max_force_error_n,median_torque_error_mnm,"
      "p99_torque_error_mnm,max_torque_error_mnm,force_step_n,torque_step_mnm,flawed_ticks,"
      "time_over_default,p99_force_error_over_default,p99_torque_error_over_default");
  for (const HeadlineMeasure& measure : measures) {
    const HeadlineMethod& own = *measure.method(kDefaultMethod);
    for (const HeadlineMethod& m : measure.methods) {
      table.add({measure.name,
                 measure.pairs,
                 m.name,
                 kRealName,
                 measure.ticks,
                 m.ns.size(),
                 shown_as("%.1f", m.time_ns.median),
                 shown_as("%.1f", m.time_ns.p99),
                 shown_as("%.1f", m.time_ns.largest),
                 shown_as("%.4g", m.force_n.median),
                 shown_as("%.4g", m.force_n.p99),
                 shown_as("%.4g", m.force_n.largest),
                 shown_as("%.4g", kMilli * m.torque_nm.median),
                 shown_as("%.4g", kMilli * m.torque_nm.p99),
                 shown_as("%.4g", kMilli * m.torque_nm.largest),
                 shown_as("%.4g", m.force_step_n),
                 shown_as("%.4g", kMilli * m.torque_step_nm),
                 m.flawed_ticks,
                 shown_as("%.4g", ratio(m.time_ns.median, own.time_ns.median)),
                 shown_as("%.4g", ratio(m.force_n.p99, own.force_n.p99)),
                 shown_as("%.4g", ratio(m.torque_nm.p99, own.torque_nm.p99))});
    }
  }
  return table;
}

std::string headline_ticks_csv(const HeadlineMeasure& measure) {
  std::string text = "tick,reference_force_n,reference_torque_mnm";
  for (const HeadlineMethod& m : measure.methods)
    text += "," + m.name + "_ns," + m.name + "_force_error_n," + m.name + "_torque_error_mnm";
  text += "\n";
  for (std::size_t k = 0; k < measure.reference.in_contact.size(); ++k) {
    const std::size_t tick = measure.reference.in_contact[k];
    const HandWrench& truth = measure.reference.wrenches[tick];
    text += formatted("%zu,%.5g,%.5g", tick, truth.force_n.norm(), kMilli * truth.torque_nm.norm());
    for (const HeadlineMethod& m : measure.methods) {
      text +=
          formatted(",%.1f,%.3g,%.3g", m.ns[k], m.force_error_n[k], kMilli * m.torque_error_nm[k]);
    }
    text += "\n";
  }
  return text;
}

std::string headline_markdown(const std::vector<HeadlineMeasure>& measures) {
  if (measures.empty()) return {};
  std::string text =
      "## Error against run time of the default law\n\n"
      "The same motion of the hand, tick by tick, through every method; stiffness " +
      formatted("%.0f", kHeadlineStiffness_n_per_m) + " N/m. The reference is law `proxy` with " +
      formatted("%u", kReferencePasses) +
      " passes in quarter steps. Errors and times are those of the ticks in contact; in brackets: "
      "pairs of pieces.\n\n" +
      picture_line("headline.svg",
                   "violins of force error, torque error and time of a tick, a row per method, a "
                   "block per scene") +
      "\n" + ratio_table(measures);
  const auto add = [&](const char* caption, const auto& cell) {
    text += std::string(caption) + ":\n\n" + method_table(measures, "method", cell);
  };
  using Method = HeadlineMethod;
  add("Force error, 99 % of the ticks are below",
      [](const Method& m) { return amount(m.force_n.p99, "N"); });
  add("Force error, largest", [](const Method& m) { return amount(m.force_n.largest, "N"); });
  add("Torque error, 99 % of the ticks are below",
      [](const Method& m) { return amount(kMilli * m.torque_nm.p99, "mN m"); });
  add("Time of a tick, median", [](const Method& m) { return microseconds(m.time_ns.median); });
  add("Time of a tick, largest", [](const Method& m) { return microseconds(m.time_ns.largest); });
  add("Largest step of the force from one tick to the next",
      [](const Method& m) { return amount(m.force_step_n, "N"); });
  return text + "The reference itself:\n\n" + reference_table(measures);
}

std::string headline_plot(const std::vector<HeadlineMeasure>& measures) {
  std::string svg = heading_at(kPictureLeft, 28,
                               "Error and time of every tick in contact: the default law and what "
                               "could be taken instead (left is better)") +
                    picture_legend(54);
  double top = kPictureTop + 18;
  for (const HeadlineMeasure& measure : measures) {
    std::vector<const HeadlineMethod*> drawn;
    for (const HeadlineMethod& m : measure.methods) {
      if (m.drawn) drawn.push_back(&m);
    }
    const double height = kRowHeight * static_cast<double>(drawn.size());
    svg += text_at(kPictureLeft, top - 12,
                   measure.title + ", " + std::to_string(measure.pairs) + " pairs of pieces",
                   "start", 15, "font-weight=\"bold\"");
    double left = kPictureLeft + kNamesWidth;
    for (const Column& column : kColumns) {
      const auto [low, high] = range_of(measures, column);
      const LogPanel panel{left, top, kPanelWidth, height, low, high, 1, 2};
      svg += log_panel_frame(panel, "", column.label, "", 0);
      const double scale = scale_of(column.quantity);
      for (std::size_t k = 0; k < drawn.size(); ++k) {
        const double y = top + kRowHeight * (static_cast<double>(k) + 0.5);
        svg +=
            violin(values_of(*drawn[k], column.quantity), scale, panel, y, colour_of(*drawn[k])) +
            spread_marks(spread_in(*drawn[k], column.quantity), scale, panel, y);
      }
      left += kPanelWidth + kColumnGap;
    }
    for (std::size_t k = 0; k < drawn.size(); ++k) {
      const bool own = drawn[k]->name == kDefaultMethod;
      svg += text_at(kPictureLeft + kNamesWidth - 8,
                     top + kRowHeight * (static_cast<double>(k) + 0.5) + 4, drawn[k]->title, "end",
                     12, own ? "font-weight=\"bold\"" : "");
    }
    top += height + kSceneGap;
  }
  return svg_document(kPictureLeft + kNamesWidth + 3 * (kPanelWidth + kColumnGap), top - 24, svg);
}

}  // namespace haptic::sim
