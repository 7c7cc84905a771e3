// SPDX-License-Identifier: Apache-2.0
// The studies of several moving bodies by name, and their tables.
#include "host_sim/lab/bodies_study/bodies_study.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

/// Three digits, and whole numbers as they are.
std::string figure_text(double value) {
  return tools::formatted(std::abs(value) >= 100 && std::abs(value) < 1e9 ? "%.0f" : "%.3g", value);
}

std::string shown_figure(const StudyFigure& figure) {
  if (std::isnan(figure.value)) return "-";
  const std::string text = figure_text(figure.value);
  return figure.kept() ? text : "**" + text + "**";
}

/// The nearest bound in words: "at most 1".
std::string bound_text(const StudyFigure& figure) {
  std::string text;
  if (figure.least > -StudyFigure::kNone) text = "at least " + figure_text(figure.least);
  if (figure.most < StudyFigure::kNone)
    text += (text.empty() ? "at most " : ", at most ") + figure_text(figure.most);
  return text;
}

std::string page_table(const BodiesStudy& study) {
  std::string text;
  for (const StudyRow& row : study.rows) {
    std::vector<std::string> heads{""}, cells{row.name};
    for (const StudyFigure& figure : row.figures) {
      if (heads.back() == figure.words) {
        cells.back() += " / " + shown_figure(figure);
        continue;
      }
      heads.push_back(figure.words);
      cells.push_back(shown_figure(figure));
    }
    if (text.empty()) text = table_head(heads);
    text += table_row(cells);
  }
  return text;
}

std::string page_of(std::span<const BodiesStudy> studies) {
  std::string text = "# Several bodies\n";
  for (const BodiesStudy& study : studies) {
    text += "\n## " + study.title + "\n\n" + study.about + "\n" + page_table(study);
    text += "\nBounds: " + std::to_string(study.bounds()) +
            ", missed: " + std::to_string(study.missed()) + (study.missed() > 0 ? " (bold)" : "") +
            ".\n";
  }
  return text;
}

Cell bound_cell(double bound) { return std::isinf(bound) ? Cell() : Cell(bound); }

std::string csv_of(std::span<const BodiesStudy> studies) {
  ReportTable table("study,case,figure,value,least,most,kept");
  for (const BodiesStudy& study : studies) {
    for (const StudyRow& row : study.rows) {
      for (const StudyFigure& f : row.figures) {
        table.add({study.name, quoted(row.name), f.name,
                   std::isnan(f.value) ? Cell() : Cell(f.value), bound_cell(f.least),
                   bound_cell(f.most), yes_or_no(f.kept())});
      }
    }
  }
  return table.csv();
}

nlohmann::ordered_json json_of(std::span<const BodiesStudy> studies) {
  nlohmann::ordered_json j = nlohmann::ordered_json::object();
  for (const BodiesStudy& study : studies) {
    nlohmann::ordered_json& of = j[study.name];
    of["bounds"] = study.bounds();
    of["missed"] = study.missed();
    for (const StudyRow& row : study.rows) {
      nlohmann::ordered_json line;
      line["case"] = row.name;
      for (const StudyFigure& f : row.figures) {
        if (!std::isnan(f.value)) line[f.name] = f.value;
      }
      of["rows"].push_back(std::move(line));
    }
  }
  return j;
}

std::string missed_lines(const BodiesStudy& study) {
  std::string text;
  for (const StudyRow& row : study.rows) {
    for (const StudyFigure& f : row.figures) {
      if (f.kept()) continue;
      text += "  " + study.name + ", " + row.name + ": " + f.name + " " + figure_text(f.value) +
              ", " + bound_text(f) + "\n";
    }
  }
  return text;
}

}  // namespace

const StudyFigure* StudyRow::find(const std::string& figure) const {
  const auto at = std::ranges::find(figures, figure, &StudyFigure::name);
  return at == figures.end() ? nullptr : &*at;
}

std::size_t BodiesStudy::bounds() const {
  std::size_t count = 0;
  for (const StudyRow& row : rows)
    count += static_cast<std::size_t>(std::ranges::count_if(row.figures, &StudyFigure::is_bound));
  return count;
}

std::size_t BodiesStudy::missed() const {
  std::size_t count = 0;
  for (const StudyRow& row : rows) {
    count += static_cast<std::size_t>(
        std::ranges::count_if(row.figures, [](const StudyFigure& f) { return !f.kept(); }));
  }
  return count;
}

const std::vector<std::string>& bodies_study_names() {
  static const std::vector<std::string> names{"squeeze", "push", "carry", "cost", "size"};
  return names;
}

BodiesStudy run_bodies_study(const std::string& name, const BodiesStudySize& size) {
  if (name == "squeeze") return squeeze_study(size);
  if (name == "push") return push_study(size);
  if (name == "carry") return carry_study(size);
  if (name == "cost") return bodies_cost_study(size);
  return bodies_size_study(size);
}

CampaignEnd bodies_study_end(std::span<const BodiesStudy> studies) {
  std::size_t bounds = 0, missed = 0;
  std::string lines;
  for (const BodiesStudy& study : studies) {
    bounds += study.bounds();
    missed += study.missed();
    lines += missed_lines(study);
  }
  const std::string page = page_of(studies);
  const std::string last =
      missed == 0 ? "all " + std::to_string(bounds) + " bounds kept\n"
                  : std::to_string(missed) + " of " + std::to_string(bounds) + " bounds MISSED\n";
  return {page + "\n" + lines + last,
          campaign_files("bodies", csv_of(studies), json_of(studies), page), missed == 0};
}

}  // namespace haptic::sim
