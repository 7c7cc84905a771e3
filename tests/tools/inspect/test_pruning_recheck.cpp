// SPDX-License-Identifier: Apache-2.0
// The pruning of a scene decided again from its bytes, against the compiler's own account; and
// scenes that lack something, which must not pass.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/pruned_scenes.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_inspect/explanation.hpp"
#include "tools/scene_inspect/exploded_view.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::sim::test::ScratchFolder;
namespace fs = std::filesystem;

namespace {

struct Compiled {
  explicit Compiled(const SceneFile& file, bool prune = true)
      : scene(compile_scene(file, options(prune))), bytes(scene.bytes) {
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  }
  static CompileOptions options(bool prune) {
    CompileOptions result;
    result.prune = prune;
    return result;
  }
  CompiledScene scene;
  SceneBytes bytes;
  SceneView view;
};

SceneFile own_scene(const std::string& name) {
  return read_scene_file(fs::path(HAPTIC_SCENES_DIR) / name / "scene.toml");
}

/// Orientations within 0.4 rad of the start, the grip within 5 cm of it.
void limit_motion(SceneFile& file) {
  OrientationEnvelope& envelope = file.orientation.emplace();
  const auto& q = file.moving.quaternion_wxyz;
  envelope.about_xyzw = {q[1], q[2], q[3], q[0]};
  envelope.max_angle_rad = 0.4;
  WorkspaceBox& box = file.workspace.emplace();
  for (std::size_t k = 0; k < 3; ++k) {
    box.min_m[k] = file.moving.position_m[k] - 0.05;
    box.max_m[k] = file.moving.position_m[k] + 0.05;
  }
}

/// Equal counts, nothing missing, hardly anything kept without need.
void check_agrees(const Compiled& compiled) {
  const PruningRecheck again = recheck_pruning(compiled.view);
  const PruningAccount& account = compiled.scene.pruning;
  CHECK(again.counts.nodes == account.counts.nodes);
  CHECK(again.counts.open == account.counts.open);
  // The account counts what can apply; the marks of the loop hold what can be near as well.
  const auto holds = [](const NodeCounts& near, const NodeCounts& applies) {
    return near.a >= applies.a && near.b >= applies.b && near.c >= applies.c;
  };
  CHECK(holds(again.counts.reachable, account.counts.reachable));
  CHECK(holds(again.counts.live, account.counts.live));
  CHECK(holds(again.counts.nodes, again.counts.reachable));
  HiddenCount faces, edges, vertices;
  std::size_t partly = 0;
  const auto add = [](HiddenCount& to, const HiddenCount& more) {
    to.hidden += more.hidden;
    to.all += more.all;
  };
  for (const PieceHidden& piece : again.pieces) {
    add(faces, piece.faces);
    add(edges, piece.edges);
    add(vertices, piece.vertices);
    partly += piece.partly_covered_faces;
  }
  CHECK(faces == account.faces);
  CHECK(edges == account.edges);
  CHECK(vertices == account.vertices);
  CHECK(partly == account.partly_covered_faces);
  CHECK(again.pairs.size() == account.pairs);
  CHECK(again.missing == 0);
  // Exactly on the rim of an envelope or a box the second decision asks for less.
  CHECK(again.needed <= again.counts.live.all());
  CHECK(10 * again.needed >= 9 * again.counts.live.all());
  if (!compiled.scene.scene.orientation) CHECK(again.needed == again.counts.live.all());
  CHECK(again.not_compared.empty());
}

/// Marks as the scene has them.
std::vector<PairMarks> marks_of(const SceneView& view) {
  std::vector<PairMarks> marks = haptic::test::all_marks(view);
  for (std::uint32_t i = 0; i < view.pair_count(); ++i) {
    const NodeMarks stated = view.pair(i).marks;
    for (std::uint32_t node = 0; node < marks[i].reachable.size(); ++node) {
      marks[i].reachable[node] = stated.node(NodeScope::kReachable, node);
      marks[i].exposed[node] = stated.node(NodeScope::kLive, node);
    }
  }
  return marks;
}

const SceneProof& proof(const std::vector<SceneProof>& proofs, const std::string& name) {
  return *std::ranges::find_if(proofs, [&](const SceneProof& p) { return p.name == name; });
}

}  // namespace

TEST_SUITE("tools.pruning_recheck") {
  TEST_CASE("own scenes: the decision from rounded tables is the compiler's exact one") {
    for (const char* name : {"square_peg_five", "ell_insert", "tetrahedron_on_box", "pin_field"}) {
      CAPTURE(name);
      SceneFile file = own_scene(name);
      check_agrees(Compiled(file));
      limit_motion(file);
      check_agrees(Compiled(file));
    }
  }

  TEST_CASE("real parts too, covers among them") {
    for (const std::string& name : haptic::test::compilable_parts()) {
      if (!fs::exists(haptic::test::shared_part(name) + "/task.json")) continue;
      CAPTURE(name);
      const ScratchFolder folder("recheck");
      SceneFile file = read_scene_file(haptic::test::write_part_scene(name, folder));
      check_agrees(Compiled(file));
      limit_motion(file);
      file.workspace.reset();  // their start poses are not where they meet
      check_agrees(Compiled(file));
    }
  }

  TEST_CASE("what leaving out saves is what a compilation without pruning takes more") {
    for (const bool limited : {false, true}) {
      SceneFile file = own_scene("ell_insert");
      if (limited) limit_motion(file);
      const Compiled pruned(file);
      SceneFile free = own_scene("ell_insert");
      const Compiled kept(free, false);
      const PruningRecheck again = recheck_pruning(pruned.view);
      REQUIRE(again.unpruned.has_value());
      CHECK(again.unpruned->bytes == kept.view.blob().size());
      const SceneCapacity &told = again.unpruned->capacity, &found = kept.view.header().capacity;
      CHECK(told.state_bytes == found.state_bytes);
      CHECK(told.pair_count == found.pair_count);
      CHECK(told.max_edge_pairs == found.max_edge_pairs);
      CHECK(told.max_near_nodes == found.max_near_nodes);
      CHECK(told.max_feature_evaluations == found.max_feature_evaluations);
      const PruningRecheck of_kept = recheck_pruning(kept.view);
      CHECK(!of_kept.left_something_out());
      CHECK(!of_kept.unpruned.has_value());
      CHECK(of_kept.needed < of_kept.counts.live.all());
      const std::string page = explanation(inspection_of(kept.view), {});
      CHECK(page.find("without --no-prune") != std::string::npos);
    }
  }

  TEST_CASE("a contact that carries force and is marked as hidden is found, with its pair") {
    const Compiled compiled(own_scene("square_peg_five"));
    SceneDescription description = description_of(compiled.view);
    description.marks = marks_of(compiled.view);
    const auto sound = [&] {
      const haptic::test::LoadedScene scene(description);
      return is_sound(certificates_of(inspection_of(scene.view)));
    };
    REQUIRE(sound());
    // Every live contact of one pair, one at a time; then one that cannot occur.
    PairMarks& marks = description.marks[3];
    std::size_t tried = 0;
    for (std::size_t node = 0; node < marks.exposed.size(); ++node) {
      if (!marks.exposed[node]) continue;
      marks.exposed[node] = false;
      if (tried++ % 16 == 0) {
        CAPTURE(node);
        CHECK(!sound());
      }
      marks.exposed[node] = true;
    }
    CHECK(tried == 168);
    marks.reachable[7] = marks.exposed[7] = false;
    const haptic::test::LoadedScene scene(description);
    const auto proofs = certificates_of(inspection_of(scene.view));
    const SceneProof& complete = proof(proofs, "complete");
    CHECK(complete.result == ProofResult::kFails);
    CHECK(complete.figures.find("1 contacts are MISSING, the first in the pair of piece 0 of "
                                "'peg.off' and piece 3 of 'socket.obj'") != std::string::npos);
    CHECK(proof(proofs, "convex").result == ProofResult::kHolds);
  }

  TEST_CASE("a pair that the workspace should not have dropped is found") {
    SceneFile file = own_scene("square_peg_five");
    limit_motion(file);
    const Compiled compiled(file);
    SceneDescription description = description_of(compiled.view);
    REQUIRE(compiled.view.pair_count() == 5);
    description.marks = marks_of(compiled.view);
    description.marks[1].reachable.assign(description.marks[1].reachable.size(), false);
    description.marks[1].exposed = description.marks[1].reachable;
    const haptic::test::LoadedScene scene(description);
    REQUIRE(scene.view.pair_count() == 4);
    const Inspection inspection = inspection_of(scene.view);
    CHECK(inspection.pruning.missing > 0);
    CHECK(!inspection.pruning.pairs[inspection.pruning.first_missing].in_scene);
    CHECK(!is_sound(certificates_of(inspection)));
  }

  TEST_CASE("a piece lost is found by the volumes, a cover is reported and allowed") {
    SceneDescription description = description_of(Compiled(own_scene("ell_insert")).view);
    Body& fixed = description.statics[0].body;
    const double whole_m3 = fixed.volume_m3;
    fixed.volume_m3 = 0.0;  // stated as the sum
    fixed.pieces.push_back(fixed.pieces.back());
    const haptic::test::LoadedScene doubled(description);
    const auto proofs = certificates_of(inspection_of(doubled.view));
    CHECK(proof(proofs, "disjoint").result == ProofResult::kLimited);
    CHECK(proof(proofs, "disjoint").figures.find("a cover") != std::string::npos);
    CHECK(is_sound(proofs));
    CHECK(doubled.view.bodies()[1].volume_m3 > 1.01 * whole_m3);
  }

  TEST_CASE("a surface beside a solid: sound, without volumes and without counts of contacts") {
    SceneFile file = own_scene("ell_insert");
    file.moving.kind = PartKind::kSurface;
    const Compiled compiled(file);
    const Inspection inspection = inspection_of(compiled.view);
    CHECK(inspection.facts.bodies[0].is_surface());
    CHECK_FALSE(inspection.facts.bodies[1].is_surface());
    const auto proofs = certificates_of(inspection);
    CHECK(is_sound(proofs));
    CHECK(proof(proofs, "whole").figures.find("a surface, without volume") != std::string::npos);
    const std::string text = explanation(inspection, {});
    INFO(text);
    CHECK(text.find("It is a surface of") != std::string::npos);
    CHECK(text.find("18 446") == std::string::npos);
    for (const char* word : {"nan", "inf ", "section "})
      CHECK(text.find(word) == std::string::npos);
    const auto drawn = exploded_bodies(compiled.view, inspection.pruning.exposure, 0.6);
    CHECK(exploded_obj(drawn, "exploded.mtl").find("nan") == std::string::npos);
  }

  TEST_CASE("a pruned scene whose live contacts fit is not said to lack room for them") {
    const Compiled compiled(own_scene("square_peg_five"));
    const SceneFacts facts = facts_of(compiled.view);
    CHECK(facts.capacity.unproven == 0);
    CHECK(unproven_reasons(facts).empty());
    CHECK(facts.pairs[0].live_nodes < facts.pairs[0].nodes);
  }

  TEST_CASE("memory is held against the limits that are given") {
    const Inspection inspection = inspection_of(Compiled(own_scene("ell_insert")).view);
    BudgetLimits limits;
    CHECK(within_budget(inspection.facts, limits));
    limits.file = "scene.toml";
    limits.constants = inspection.facts.bytes;
    limits.state = inspection.facts.state.total();
    CHECK(within_budget(inspection.facts, limits));
    CHECK(memory_as_text(inspection.facts, limits).find("within its budget") != std::string::npos);
    limits.state = inspection.facts.state.total() - 1;
    CHECK(!within_budget(inspection.facts, limits));
    const std::string text = memory_as_text(inspection.facts, limits);
    CHECK(text.find("OVER ITS BUDGET") != std::string::npos);
    CHECK(text.find("OVER the limit") != std::string::npos);
    CHECK(memory_as_json(inspection.facts, limits)["budget"]["fits"] == false);
    CHECK(inspection.facts.state.total() == inspection.facts.capacity.state_bytes);
  }

  TEST_CASE("lines of the page break at blanks, never within a number") {
    const std::string text(60, 'x');
    CHECK(wrapped(text + " 12 345 678", 2) == "  " + text + " 12 345 678\n");
    CHECK(wrapped(text + " " + std::string(30, 'y') + " 12 345 678 z", 2) ==
          "  " + text + " " + std::string(30, 'y') + "\n  12 345 678 z\n");
  }
}
