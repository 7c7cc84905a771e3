// SPDX-License-Identifier: Apache-2.0
/// The table of broken and awkward meshes through the whole chain, and a sample of it through the
/// program. With HAPTIC_MESH_TABLE set in the environment every outcome is printed.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>

#include "tests/support/program_run.hpp"
#include "tests/tools/mesh_table/mesh_row.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools::test {
namespace {

using sim::test::ScratchFolder;

/// Recorded for every row; the test asserts only what a busy machine keeps too.
constexpr double kWanted_s = 60.0;

struct Outcome {
  Stage stage = Stage::kAccepted;
  std::string message;
  std::size_t solids = 0;
  std::vector<std::string> warnings;
  RawMesh raw;
  Decomposition decomposition;
  Body body;
  double seconds = 0.0;
};

std::vector<Row> all_rows() {
  std::vector<Row> rows;
  for (const auto& part :
       {text_rows(), stl_rows(), file_rows(), topology_rows(), geometry_rows()}) {
    rows.insert(rows.end(), part.begin(), part.end());
  }
  return rows;
}

/// Writes the row's file, alone in its folder.
std::filesystem::path make_file(const Row& row, const ScratchFolder& folder) {
  const std::filesystem::path path = folder.file(row.file);
  if (row.source == Row::Source::kFolder) {
    std::filesystem::create_directory(path);
  } else if (row.source == Row::Source::kFile) {
    std::ofstream(path, std::ios::binary)
        .write(row.bytes.data(), static_cast<std::streamsize>(row.bytes.size()));
  }
  return path;
}

Outcome run(const Row& row) {
  const ScratchFolder folder("mesh_table");
  const std::filesystem::path path = make_file(row, folder);
  Outcome outcome;
  const auto begin = std::chrono::steady_clock::now();
  try {
    outcome.stage = Stage::kRead;
    outcome.raw = read_mesh(path);
    outcome.stage = Stage::kClean;
    const Surface surface = clean_surface(outcome.raw, row.options);
    outcome.solids = surface.solid_count;
    outcome.stage = Stage::kFlatten;
    FlatBody flat = flatten(surface, {});
    outcome.stage = Stage::kDecompose;
    outcome.decomposition = decompose(flat, outcome.raw.file, {});
    outcome.body = to_body(flat, outcome.decomposition, "row");
    outcome.stage = Stage::kAccepted;
    const std::vector<std::string>* const lists[] = {&surface.warnings, &flat.warnings,
                                                     &outcome.decomposition.warnings};
    for (const auto* list : lists) {
      outcome.warnings.insert(outcome.warnings.end(), list->begin(), list->end());
    }
  } catch (const InputError& error) {
    outcome.message = error.what();
  }
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return outcome;
}

/// Distinct file vertices among the corners of the pieces; `worst_ulp` is the largest distance of
/// one from where the file has it, in units of the last place of the part's largest coordinate.
std::size_t kept_vertices(const Row& row, const Outcome& outcome, double& worst_ulp) {
  double largest = 0.0;
  for (const RawFace& face : outcome.raw.faces) {
    for (const std::uint32_t v : face.vertices) {
      for (std::size_t i = 0; i < 3; ++i) {
        largest =
            std::max(largest, std::abs(outcome.raw.vertices[v][i] * row.options.scale_to_m[i]));
      }
    }
  }
  const double ulp = std::nextafter(largest, std::numeric_limits<double>::max()) - largest;
  std::set<std::int64_t> kept;
  for (const ConvexPiece& piece : outcome.body.pieces) {
    for (std::size_t v = 0; v < piece.vertices.size(); ++v) {
      if (piece.source_vertex[v] < 0) {
        continue;
      }
      kept.insert(piece.source_vertex[v]);
      const Point3& file = outcome.raw.vertices[static_cast<std::size_t>(piece.source_vertex[v])];
      for (std::size_t i = 0; i < 3; ++i) {
        worst_ulp = std::max(
            worst_ulp, std::abs(piece.vertices[v][i] - file[i] * row.options.scale_to_m[i]) / ulp);
      }
    }
  }
  return kept.size();
}

void check_accepted(const Row& row, const Outcome& outcome) {
  CHECK(outcome.message == "");
  CHECK(std::string(stage_name(outcome.stage)) == stage_name(Stage::kAccepted));
  if (outcome.stage != Stage::kAccepted) {
    return;
  }
  CHECK(outcome.decomposition.certificate.holds());
  CHECK(outcome.solids == row.solids);
  CHECK(outcome.body.pieces.size() == row.pieces);
  CHECK(std::abs(outcome.body.volume_m3 - row.volume_m3) <= row.volume_tolerance * row.volume_m3);
  double worst_ulp = 0.0;
  CHECK(kept_vertices(row, outcome, worst_ulp) == row.vertices);
  if (row.vertices_keep_places) {
    CHECK(worst_ulp <= 4.0);
  }
  const bool warned =
      std::any_of(outcome.warnings.begin(), outcome.warnings.end(),
                  [&](const std::string& text) { return contains(text, row.warning); });
  CHECK((row.warning.empty() || warned));
}

void check_refused(const Row& row, const Outcome& outcome) {
  CHECK(std::string(stage_name(outcome.stage)) == stage_name(row.stage));
  CAPTURE(outcome.message);
  CHECK(contains(outcome.message, row.file));
  CHECK(contains(outcome.message, row.place));
  const std::size_t fix_at = outcome.message.find("; ");
  CHECK(fix_at != std::string::npos);
  CHECK(outcome.message.find(row.fix, std::min(fix_at, outcome.message.size())) !=
        std::string::npos);
  CHECK(outcome.message.size() < 600);
}

void print(const Row& row, const Outcome& outcome) {
  if (outcome.stage != Stage::kAccepted) {
    const std::size_t at = outcome.message.find(row.file);
    std::printf("%-56s %-20s %6.3f s  %s\n", row.name.c_str(), stage_name(outcome.stage),
                outcome.seconds, outcome.message.substr(at == std::string::npos ? 0 : at).c_str());
    return;
  }
  std::printf("%-56s %-20s %6.3f s  %zu solids, %zu pieces, %.12g m^3%s%s\n", row.name.c_str(),
              stage_name(outcome.stage), outcome.seconds, outcome.solids,
              outcome.body.pieces.size(), outcome.body.volume_m3,
              outcome.warnings.empty() ? "" : ", warning: ",
              outcome.warnings.empty() ? "" : outcome.warnings.front().c_str());
}

}  // namespace

TEST_SUITE("tools.mesh_table") {
  TEST_CASE("table: at least a hundred rows, named once") {
    const std::vector<Row> rows = all_rows();
    std::set<std::string> names;
    for (const Row& row : rows) {
      CAPTURE(row.name);
      CHECK(names.insert(row.name).second);
    }
    CHECK(rows.size() >= 100);
  }

  TEST_CASE("table: every mesh comes to the outcome that is written in its row") {
    const bool shown = std::getenv("HAPTIC_MESH_TABLE") != nullptr;
    double slowest_s = 0.0;
    std::string slowest;
    for (const Row& row : all_rows()) {
      CAPTURE(row.name);
      const Outcome outcome = run(row);
      if (shown) {
        print(row, outcome);
      }
      if (outcome.seconds > slowest_s) {
        slowest_s = outcome.seconds;
        slowest = row.name;
      }
      if (row.stage == Stage::kAccepted) {
        check_accepted(row, outcome);
      } else {
        check_refused(row, outcome);
      }
    }
    MESSAGE("slowest row: " << slowest << ", " << slowest_s << " s, wanted " << kWanted_s << " s");
    CHECK(slowest_s < 3.0 * kWanted_s);
  }

  TEST_CASE("program: a refused mesh gives exit code 3, its message, and no output file") {
    std::size_t tried = 0;
    for (const Row& row : all_rows()) {
      // One of each kind, with names that a shell and TOML take as they are.
      static const std::set<std::string> kSample = {"obj: 0 bytes",
                                                    "obj: index out of range",
                                                    "obj: UTF-16 with its mark",
                                                    "off: too few faces announced",
                                                    "text stl: without endsolid",
                                                    "binary stl: 2^32 - 1 triangles announced",
                                                    "file: OFF named obj",
                                                    "one face missing, obj",
                                                    "Klein bottle, off",
                                                    "a plate thinner than the limit, binary stl",
                                                    "n-gons that are not flat, obj",
                                                    "more than 300 reflex edges, text stl",
                                                    "pentagram prism of triangles, obj"};
      if (!kSample.contains(row.name)) {
        continue;
      }
      CAPTURE(row.name);
      ++tried;
      const ScratchFolder folder("mesh_table");
      make_file(row, folder);
      std::ofstream(folder.file("hand.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                                "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
      std::ofstream(folder.file("scene.toml"))
          << "format = 1\nname = \"row\"\n[moving]\nmesh = \"hand.obj\"\nscale_to_m = 1.0\n"
             "position_m = [0.0, 0.0, 9.0]\n[[static]]\nmesh = \""
          << row.file
          << "\"\nscale_to_m = 1.0\n[rendering]\nlaw = \"paper\"\nk_f_n_per_m = 1000.0\n";
      const auto result =
          sim::test::run_program(HAPTIC_GRAPH_COMPILER, "'" + folder.file("scene.toml") + "' -o '" +
                                                            folder.file("scene.rtscene") + "'");
      CAPTURE(result.err);
      CHECK(result.exit_code == kExitBadInput);
      CHECK(contains(result.err, row.place));
      CHECK(contains(result.err, row.fix));
      CHECK(!std::filesystem::exists(folder.file("scene.rtscene")));
    }
    CHECK(tried == 13);
  }
}

}  // namespace haptic::tools::test
