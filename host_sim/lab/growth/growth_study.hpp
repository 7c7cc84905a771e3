// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How time and memory of the scene compiler grow with a part: parts of one kind, each larger than
/// the one before, compiled one after the other.

#include <cstdint>
#include <string>
#include <vector>

namespace haptic::sim {

/// A kind of part, and its sizes in features: reflex edges of a comb, facets of a sphere.
struct GrowthSeries {
  std::string name;   ///< for files and tables
  std::string words;  ///< what grows
  std::vector<std::uint32_t> sizes;
};

/// Combs of one length whose teeth get narrower; combs whose teeth stay as wide and that get
/// longer; spheres as surfaces. `quick`: small ones, for tests.
[[nodiscard]] std::vector<GrowthSeries> growth_series(bool quick);

/// A part of a series, compiled as the obstacle of a box.
struct GrownPart {
  std::uint32_t size = 0;
  double processor_s = 0;
  std::uint64_t peak_bytes = 0, scene_bytes = 0;
  std::string refusal;  ///< last line of the compiler where it made no scene
};

struct GrowthRun {
  GrowthSeries series;
  std::vector<GrownPart> parts;
};

/// d log(value) / d log(size) between the last two parts; 0 where there are no two, or one was
/// refused.
struct GrowthExponents {
  double processor = 0, peak = 0, scene = 0;
};
[[nodiscard]] GrowthExponents exponents_of(const GrowthRun& run);

/// Compiles all parts of a series with the graph_compiler beside this program; says on standard
/// error which one it is at.
/// @throws tools::InputError  the compiler cannot be started.
[[nodiscard]] GrowthRun run_growth(const GrowthSeries& series);

/// A row for each part: series,size,processor_s,peak_bytes,scene_bytes,refusal.
[[nodiscard]] std::string growth_csv(const std::vector<GrowthRun>& runs);
[[nodiscard]] std::string growth_table(const std::vector<GrowthRun>& runs);

/// True if every part was compiled and no time grows with more than this power of the size.
[[nodiscard]] bool grows_as_it_should(const std::vector<GrowthRun>& runs, double most_exponent);

}  // namespace haptic::sim
