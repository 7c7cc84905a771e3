// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/growth/growth_study.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <numbers>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;
using tools::formatted;

constexpr const char* kShortComb = "narrow_teeth";
constexpr const char* kLongComb = "long_comb";
constexpr const char* kSphere = "sphere";

/// Length of all combs with teeth that get narrower, pitch of those that get longer, and sizes of
/// both [mm].
constexpr double kCombLength_mm = 100, kPitch_mm = 2;
constexpr double kBase_mm = 3, kHeight_mm = 8, kDepth_mm = 10;
constexpr double kSphereRadius_mm = 50;
/// Beyond the compiler's own limit, from which on it makes a surface of a part.
constexpr std::uint32_t kMostReflexEdges = 4000;

/// Two walls of each gap between two teeth meet its ground in a reflex edge.
std::uint32_t teeth_of(std::uint32_t reflex_edges) { return reflex_edges / 2 + 1; }

/// A comb along x from the origin, its teeth upwards along y: cells of a grid in the plane of x and
/// y, as deep as all are, with the walls between what is full and what is not.
std::string comb_mesh(std::uint32_t teeth, double length_mm) {
  const std::uint32_t columns = 2 * teeth - 1;
  const double width_mm = length_mm / columns;
  const double level_mm[3] = {0, kBase_mm, kHeight_mm};
  std::string obj;
  append_line(obj, "# SPDX-License-Identifier: Apache-2.0\n# comb of %u teeth", teeth);
  for (std::uint32_t i = 0; i <= columns; ++i) {
    for (const double y_mm : level_mm) {
      append_line(obj, "v %.9g %.9g 0\nv %.9g %.9g %.9g", i * width_mm, y_mm, i * width_mm, y_mm,
                  kDepth_mm);
    }
  }
  const auto corner = [](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    return 6 * i + 2 * j + k + 1;
  };
  const auto is_full = [&](std::int64_t i, std::int64_t j) {
    return i >= 0 && i < columns && (j == 0 || (j == 1 && i % 2 == 0));
  };
  for (std::uint32_t i = 0; i < columns; ++i) {
    for (std::uint32_t j = 0; j < 2; ++j) {
      if (!is_full(i, j)) continue;
      // Corners in the order of a turn about z.
      const std::uint32_t at[4][2] = {{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}};
      const std::int64_t beside[4][2] = {{i, std::int64_t{j} - 1},
                                         {std::int64_t{i} + 1, j},
                                         {i, std::int64_t{j} + 1},
                                         {std::int64_t{i} - 1, j}};
      const auto face = [&](std::uint32_t k) { return corner(at[k][0], at[k][1], 0); };
      append_line(obj, "f %u %u %u %u", face(3), face(2), face(1), face(0));
      append_line(obj, "f %u %u %u %u", face(0) + 1, face(1) + 1, face(2) + 1, face(3) + 1);
      for (std::uint32_t k = 0; k < 4; ++k) {
        if (is_full(beside[k][0], beside[k][1])) continue;
        const std::uint32_t next = (k + 1) % 4;
        append_line(obj, "f %u %u %u %u", face(k), face(next), face(next) + 1, face(k) + 1);
      }
    }
  }
  return obj;
}

/// A sphere about the origin, of about so many triangles.
std::string sphere_mesh(std::uint32_t facets) {
  const auto rows = static_cast<std::uint32_t>(std::lround(std::sqrt(0.25 * facets)));
  const std::uint32_t columns = 2 * rows;
  std::string obj;
  append_line(obj, "# SPDX-License-Identifier: Apache-2.0\n# sphere\nv 0 0 %.9g\nv 0 0 %.9g",
              kSphereRadius_mm, -kSphereRadius_mm);
  for (std::uint32_t i = 1; i < rows; ++i) {
    const double down = std::numbers::pi * i / rows;
    for (std::uint32_t j = 0; j < columns; ++j) {
      const double round = 2 * std::numbers::pi * j / columns;
      append_line(obj, "v %.9g %.9g %.9g", kSphereRadius_mm * std::sin(down) * std::cos(round),
                  kSphereRadius_mm * std::sin(down) * std::sin(round),
                  kSphereRadius_mm * std::cos(down));
    }
  }
  const auto corner = [&](std::uint32_t i, std::uint32_t j) {
    return i == 0 ? 1 : i == rows ? 2 : 3 + (i - 1) * columns + j % columns;
  };
  for (std::uint32_t i = 0; i < rows; ++i) {
    for (std::uint32_t j = 0; j < columns; ++j) {
      if (i > 0) append_line(obj, "f %u %u %u", corner(i, j), corner(i + 1, j), corner(i, j + 1));
      if (i + 1 < rows)
        append_line(obj, "f %u %u %u", corner(i, j + 1), corner(i + 1, j), corner(i + 1, j + 1));
    }
  }
  return obj;
}

/// The scene file of a part, and what it names beside itself in `folder`.
std::string scene_of(const GrowthSeries& series, std::uint32_t size,
                     const TemporaryFolder& folder) {
  std::string fixed;
  double above_m = 0;
  if (series.name == kSphere) {
    above_m = 1.5e-3 * kSphereRadius_mm;
    write_whole_file(folder.file("sphere.obj"), sphere_mesh(size));
    fixed = "mesh = \"sphere.obj\"\nscale_to_m = 0.001\nas = \"surface\"\n";
  } else {
    const std::uint32_t teeth = teeth_of(size);
    const double length_mm =
        series.name == kLongComb ? kPitch_mm * (2 * teeth - 1) / 2 : kCombLength_mm;
    write_whole_file(folder.file("comb.obj"), comb_mesh(teeth, length_mm));
    above_m = 5e-3 * kHeight_mm;
    fixed = "mesh = \"comb.obj\"\nscale_to_m = 0.001\nas = \"solid\"\n";
  }
  return "format = 1\nname = \"" + series.name + "\"\n[moving]\nshape = \"box\"\n" +
         formatted("size_m = [0.01, 0.01, 0.01]\nposition_m = [0.0, 0.0, %.9g]\n", above_m) +
         (series.name == kSphere ? "as = \"surface\"\n" : "") + "[[static]]\n" + fixed +
         "[rendering]\nk_f_n_per_m = 1000.0\n[loop]\nrate_hz = 1000\n";
}

GrownPart compile(const GrowthSeries& series, std::uint32_t size) {
  const TemporaryFolder folder;
  write_whole_file(folder.file("scene.toml"), scene_of(series, size, folder));
  GrownPart part;
  part.size = size;
  ChildCost cost;
  const std::string blob = folder.file("scene.rtscene");
  const std::vector<std::string> command = {program_beside("graph_compiler"),
                                            folder.file("scene.toml"),
                                            "-o",
                                            blob,
                                            "--quiet",
                                            "--max-reflex",
                                            std::to_string(kMostReflexEdges)};
  const int status = run_to_end(command, folder.file("out"), folder.file("err"), &cost);
  if (status == -1) throw tools::InputError(command[0] + ": " + std::strerror(errno));
  part.processor_s = cost.processor_s;
  part.peak_bytes = cost.peak_bytes;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    part.scene_bytes = std::filesystem::file_size(blob);
  } else {
    part.refusal = last_line(file_text(folder.file("err")));
    if (part.refusal.empty()) part.refusal = "it ended without a word";
  }
  return part;
}

}  // namespace

std::vector<GrowthSeries> growth_series(bool quick) {
  using Sizes = std::vector<std::uint32_t>;
  return {{kShortComb, "reflex edges of a solid comb 100 mm long",
           quick ? Sizes{20, 50} : Sizes{100, 250, 500, 1000}},
          {kLongComb, "reflex edges of a solid comb with a tooth every 2 mm",
           quick ? Sizes{20, 50} : Sizes{100, 250, 500, 1000}},
          {kSphere, "facets of a sphere as a surface",
           quick ? Sizes{2000, 10000} : Sizes{10000, 100000, 1000000}}};
}

GrowthExponents exponents_of(const GrowthRun& run) {
  GrowthExponents e;
  if (run.parts.size() < 2) return e;
  const GrownPart &last = run.parts.back(), &before = run.parts[run.parts.size() - 2];
  if (!last.refusal.empty() || !before.refusal.empty()) return e;
  const double size = std::log(double{1} * last.size / before.size);
  const auto power = [&](double now, double then) { return std::log(now / then) / size; };
  e.processor = power(last.processor_s, before.processor_s);
  e.peak = power(static_cast<double>(last.peak_bytes), static_cast<double>(before.peak_bytes));
  e.scene = power(static_cast<double>(last.scene_bytes), static_cast<double>(before.scene_bytes));
  return e;
}

GrowthRun run_growth(const GrowthSeries& series) {
  GrowthRun run{series, {}};
  for (const std::uint32_t size : series.sizes) {
    std::fprintf(stderr, "growth: %s, %u\n", series.name.c_str(), size);
    run.parts.push_back(compile(series, size));
  }
  return run;
}

std::string growth_csv(const std::vector<GrowthRun>& runs) {
  std::string csv = "series,size,processor_s,peak_bytes,scene_bytes,refusal\n";
  for (const GrowthRun& run : runs) {
    for (const GrownPart& part : run.parts) {
      std::string refusal = part.refusal;
      std::ranges::replace(refusal, '"', '\'');
      append_line(csv, "%s,%u,%.3f,%llu,%llu,\"%s\"", run.series.name.c_str(), part.size,
                  part.processor_s, static_cast<unsigned long long>(part.peak_bytes),
                  static_cast<unsigned long long>(part.scene_bytes), refusal.c_str());
    }
  }
  return csv;
}

std::string growth_table(const std::vector<GrowthRun>& runs) {
  constexpr double kMega = 1e6;
  std::string text;
  for (const GrowthRun& run : runs) {
    append_line(text, "%s (%s)", run.series.name.c_str(), run.series.words.c_str());
    append_line(text, "  %10s %14s %12s %12s", "size", "processor s", "peak MB", "scene MB");
    for (const GrownPart& part : run.parts) {
      append_line(text, "  %10u %14.2f %12.1f %12.3f %s", part.size, part.processor_s,
                  static_cast<double>(part.peak_bytes) / kMega,
                  static_cast<double>(part.scene_bytes) / kMega,
                  part.refusal.empty() ? "" : ("REFUSED: " + part.refusal).c_str());
    }
    const GrowthExponents e = exponents_of(run);
    append_line(text, "  %10s %14.2f %12.2f %12.2f  (of the last two)\n", "exponent", e.processor,
                e.peak, e.scene);
  }
  return text;
}

bool grows_as_it_should(const std::vector<GrowthRun>& runs, double most_exponent) {
  return std::ranges::all_of(runs, [&](const GrowthRun& run) {
    return std::ranges::all_of(run.parts,
                               [](const GrownPart& part) { return part.refusal.empty(); }) &&
           exponents_of(run).processor <= most_exponent;
  });
}

}  // namespace haptic::sim
