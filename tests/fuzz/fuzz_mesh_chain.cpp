// SPDX-License-Identifier: Apache-2.0
/// Any small mesh that cleaning accepts: flattened, decomposed with its certificate and rounded, or
/// refused with InputError.
#include <cmath>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/mesh_input.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace {

/// A single run stays below seconds under the sanitizers.
constexpr std::size_t kMostFaces = 48;
constexpr std::size_t kMostReflexEdges = 16;
constexpr std::size_t kMostPieces = 100;
constexpr double kMostWork = 2.0e6;

void check_body(const haptic::tools::Body& body) {
  using haptic::fuzz::require;
  double volume = 0.0;
  for (const haptic::tools::ConvexPiece& piece : body.pieces) {
    require(piece.vertices.size() >= 4 && piece.faces.size() >= 4, "a piece has four corners");
    require(piece.source_vertex.size() == piece.vertices.size(), "each corner has a source");
    require(std::isfinite(piece.volume_m3) && piece.volume_m3 > 0.0, "pieces have volume");
    volume += piece.volume_m3;
    for (const haptic::tools::PieceFace& face : piece.faces) {
      require(face.plane < body.planes.size() && face.loop.size() >= 3, "faces have planes");
      for (const std::uint32_t v : face.loop) {
        require(v < piece.vertices.size(), "loops refer to corners");
      }
    }
  }
  require(std::abs(volume - body.volume_m3) <= 1e-9 * volume, "volumes add up");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  const auto mesh = haptic::fuzz::parse_input(data, size);
  if (!mesh || mesh->faces.size() > kMostFaces) {
    return 0;
  }
  try {
    const haptic::tools::Surface surface = haptic::tools::clean_surface(*mesh, {});
    haptic::tools::FlatBody flat = haptic::tools::flatten(
        surface, {.max_reflex_edges = kMostReflexEdges, .first_bits = 1000, .max_bits = 2000});
    flat.world.work_limit = kMostWork;
    const haptic::tools::Decomposition result =
        haptic::tools::decompose(flat, "fuzz", {.max_pieces = kMostPieces});
    require(result.certificate.holds(), "what is accepted is certified");
    check_body(haptic::tools::to_body(flat, result, "fuzz"));
  } catch (const haptic::tools::InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("fuzz:"), "a refusal begins with the file");
    require(text.find("; ") != std::string_view::npos, "a refusal names the fix");
    // Only where the surface may be at fault too.
    require(text.find("internal error") == std::string_view::npos ||
                text.find("passes through") != std::string_view::npos,
            "no internal error");
  }
  return 0;
}
