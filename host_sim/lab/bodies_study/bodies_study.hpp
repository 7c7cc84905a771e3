// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Several moving bodies in figures: who yields where a driver squeezes, pushes or carries a hand's
/// part, what a hand feels of it, and what a tick costs. Each figure may have a bound.

#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/report/campaign_text.hpp"

namespace haptic::sim {

/// A figure of a row, in the unit that its name ends in.
struct StudyFigure {
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  std::string name;   ///< in files: "free_lag_um"
  std::string words;  ///< heading on the page; neighbours of one heading share a cell
  double value = 0;   ///< not a number: not measured
  double least = -kNone, most = kNone;

  [[nodiscard]] bool is_bound() const { return least > -kNone || most < kNone; }
  [[nodiscard]] bool kept() const { return !is_bound() || (value >= least && value <= most); }
};

struct StudyRow {
  std::string name;
  std::vector<StudyFigure> figures;  ///< the same ones in all rows of a study

  /// The figure of this name, or none.
  [[nodiscard]] const StudyFigure* find(const std::string& figure) const;
};

struct BodiesStudy {
  std::string name, title;
  std::string about;  ///< lines of the page in front of its table
  std::vector<StudyRow> rows;

  [[nodiscard]] std::size_t bounds() const;
  [[nodiscard]] std::size_t missed() const;
};

struct BodiesStudySize {
  bool is_short = false;     ///< a few rows, and few ticks, for tests
  bool instructions = true;  ///< count them under valgrind
  std::optional<BodiesFault> fault;
};

/// A bound, and its value in a build whose Real is single.
[[nodiscard]] constexpr double bound_in(double in_double, double in_single) {
  return sizeof(Real) == sizeof(double) ? in_double : in_single;
}

/// "squeeze", "push", "carry", "cost", "size".
[[nodiscard]] const std::vector<std::string>& bodies_study_names();
/// @throws tools::InputError when a pair cannot be compiled.
[[nodiscard]] BodiesStudy run_bodies_study(const std::string& name, const BodiesStudySize& size);

/// With their files: bodies.csv, .json and .md.
[[nodiscard]] CampaignEnd bodies_study_end(std::span<const BodiesStudy> studies);

// Each in a file of its own.
[[nodiscard]] BodiesStudy squeeze_study(const BodiesStudySize& size);
[[nodiscard]] BodiesStudy push_study(const BodiesStudySize& size);
[[nodiscard]] BodiesStudy carry_study(const BodiesStudySize& size);
[[nodiscard]] BodiesStudy bodies_cost_study(const BodiesStudySize& size);
[[nodiscard]] BodiesStudy bodies_size_study(const BodiesStudySize& size);

}  // namespace haptic::sim
