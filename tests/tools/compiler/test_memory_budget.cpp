// SPDX-License-Identifier: Apache-2.0
// Budgets of memory and the header of an image: every number that a refusal states is checked by
// doing what it proposes.
#include <doctest/doctest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/scene_needs.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/memory_budget.hpp"
#include "tools/graph_compiler/program/traits_header.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::sim::test::ScratchFolder;

namespace {

/// With every basic contact: a pair with marks stores no graph, of which these tests speak.
CompiledScene compile_whole(const SceneFile& file) {
  CompileOptions options;
  options.prune = false;
  return compile_scene(file, options);
}

/// A compiled scene that stays open.
struct Opened {
  explicit Opened(const SceneFile& file) : bytes(compile_whole(file).bytes) {
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  }
  SceneBytes bytes;
  SceneView view;
};

/// With everything that can be asked of it.
SceneFile own_scene(const std::string& name) {
  SceneFile file = read_scene_file(std::string(HAPTIC_SCENES_DIR) + "/" + name + "/scene.toml");
  file.parameters.goal_contact = 1;
  return file;
}

SceneFile peg() { return own_scene("square_peg_five"); }

SceneFile peg_with_device() {
  SceneFile file = peg();
  file.parameters.device.given = 1;
  return file;
}

const BudgetProposal* find(const std::vector<BudgetProposal>& all, const std::string& words) {
  for (const BudgetProposal& p : all) {
    if (p.what.find(words) != std::string::npos) return &p;
  }
  return nullptr;
}

std::string refusal(const SceneFile& file) {
  try {
    static_cast<void>(compile_whole(file));
  } catch (const BudgetError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_SUITE("tools.memory_budget") {
  TEST_CASE("the parts of the state make up the state, and the sections the blob") {
    for (const bool with_device : {false, true}) {
      const Opened scene(with_device ? peg_with_device() : peg());
      const StateAccount account = HapticCore::state_account(scene.view);
      CHECK(account.total() == HapticCore::state_bytes(scene.view));
      CHECK((account.of(StatePart::kOutput) > 0) == with_device);
      for (const StatePart part : {StatePart::kCore, StatePart::kPairs, StatePart::kBounds,
                                   StatePart::kSearch, StatePart::kContacts, StatePart::kLaw}) {
        CHECK(account.of(part) > 0);
      }
      std::uint64_t nodes = 0, neighbors = 0;
      for (const SectionEntry& s : scene.view.sections()) {
        if (s.id == SectionId::kNodes) nodes = s.count;
        if (s.id == SectionId::kNeighbors) neighbors = s.count;
      }
      CHECK(blob_bytes(scene.view, nodes, neighbors, 2) == scene.view.blob().size());
    }
  }

  TEST_CASE("proposal: without stored graphs the blob is smaller by exactly what is said") {
    SceneFile file = peg();
    const Opened scene(file);
    const auto all = budget_proposals(scene.view, 0);
    const BudgetProposal* graphs = find(all, "graph_bytes = 0");
    REQUIRE(graphs != nullptr);
    file.graph_bytes = 0;
    const Opened without(file);
    CHECK(graphs->constants_saved > 0);
    CHECK(scene.view.blob().size() - without.view.blob().size() == graphs->constants_saved);
  }

  TEST_CASE("proposal: another law and no device save exactly the state that is said") {
    // One pair: what the other laws keep of its near set is less than what the proxy keeps.
    SceneFile file = own_scene("tetrahedron_on_box");
    file.parameters.device.given = 1;
    const Opened scene(file);
    const auto all = budget_proposals(scene.view, 0);
    const std::uint64_t now = HapticCore::state_bytes(scene.view);
    const BudgetProposal* paper = find(all, "law = \"paper\"");
    REQUIRE(paper != nullptr);
    SceneFile other = file;
    other.parameters.law = LawId::kPaper;
    CHECK(now - HapticCore::state_bytes(Opened(other).view) == paper->state_saved);
    const BudgetProposal* device = find(all, "leave out [device]");
    REQUIRE(device != nullptr);
    file.parameters.device.given = 0;
    CHECK(now - HapticCore::state_bytes(Opened(file).view) == device->state_saved);
  }

  TEST_CASE("proposal: without the search at the goal pose the state is smaller by what is said") {
    SceneFile file = peg();
    const std::uint64_t now = HapticCore::state_bytes(Opened(file).view);
    const auto all = budget_proposals(Opened(file).view, 0);
    const BudgetProposal* goal = find(all, "leave out [rendering] goal_contact");
    REQUIRE(goal != nullptr);
    file.parameters.goal_contact = 0;
    const Opened without(file);
    CHECK(now - HapticCore::state_bytes(without.view) == goal->state_saved);
    CHECK(2 * goal->state_saved > now / 2);
    CHECK(HapticCore::state_account(without.view).of(StatePart::kBounds) == 0);
    CHECK(find(budget_proposals(without.view, 0), "goal_contact") == nullptr);
    CHECK(find(budget_proposals(without.view, 0), "pair_visits") == nullptr);
  }

  TEST_CASE("proposal: the visits that are said fit the budget, and one more does not") {
    SceneFile file = peg();
    const std::uint64_t now = HapticCore::state_bytes(Opened(file).view);
    file.budget.pair_visits = 2;
    const std::uint64_t two = HapticCore::state_bytes(Opened(file).view);
    REQUIRE(two < now);
    const auto all = budget_proposals(Opened(peg()).view, two);
    const BudgetProposal* visits = find(all, "pair_visits = 2 ");
    REQUIRE(visits != nullptr);
    CHECK(visits->state_saved == now - two);
    CHECK(find(budget_proposals(Opened(peg()).view, two - 1), "pair_visits = 1 ") != nullptr);
  }

  TEST_CASE("proposal: the near pairs that are said fit the budget, and one more does not") {
    SceneFile file = own_scene("nut_on_bolt");
    file.parameters.goal_contact = 0;
    const std::uint64_t now = HapticCore::state_bytes(Opened(file).view);
    const std::uint32_t slots = Opened(file).view.header().capacity.near_slots;
    file.budget.near_pairs = 300;
    const std::uint64_t few = HapticCore::state_bytes(Opened(file).view);
    REQUIRE(few < now);
    file.budget.near_pairs.reset();
    const std::string words = "near_pairs = 300, now " + std::to_string(slots) + " ";
    const auto all = budget_proposals(Opened(file).view, few);
    const BudgetProposal* pairs = find(all, words);
    REQUIRE(pairs != nullptr);
    CHECK(pairs->state_saved == now - few);
    CHECK(find(budget_proposals(Opened(file).view, few - 1), "near_pairs = 299, ") != nullptr);
    // The refusal names it.
    SceneFile tight = file;
    tight.budget.state = BudgetLimit{few, 4, 1};
    CHECK(refusal(tight).find("[budget] " + words) != std::string::npos);
    // The probe: a scene of few pairs has nothing to give.
    CHECK(find(budget_proposals(Opened(peg()).view, 0), "near_pairs") == nullptr);
  }

  TEST_CASE("over budget: refused with place, breakdown and proposals; at the budget accepted") {
    SceneFile file = peg();
    const Opened scene(file);
    const std::uint64_t state = HapticCore::state_bytes(scene.view);
    file.budget.constants = BudgetLimit{scene.view.blob().size(), 3, 1};
    file.budget.state = BudgetLimit{state, 4, 1};
    CHECK(refusal(file) == "accepted");
    file.budget.state->bytes = state - 1;
    const std::string of_state = refusal(file);
    for (const char* words : {"scene.toml:4:1: the scene needs", "bytes of state", "bounds of the",
                              "to leave out:", "pair_visits = 4 "}) {
      CAPTURE(of_state);
      CHECK(of_state.find(words) != std::string::npos);
    }
    file.budget.constants->bytes -= 1;
    const std::string of_constants = refusal(file);
    for (const char* words : {"scene.toml:3:1: the scene needs", "bytes of constants", "neighbors",
                              "graph_bytes = 0", "one of its 5 pieces less"}) {
      CAPTURE(of_constants);
      CHECK(of_constants.find(words) != std::string::npos);
    }
  }

  TEST_CASE("a stack below that of the whole core is refused, except for an image") {
    SceneFile file = peg();
    file.budget.stack = BudgetLimit{core_stack_bytes(), 5, 2};
    CHECK(refusal(file) == "accepted");
    file.budget.stack->bytes -= 1;
    const std::string of_stack = refusal(file);
    CAPTURE(of_stack);
    for (const char* words : {"scene.toml:5:2: the whole core may need", "bytes of stack",
                              "the budget allows", "build an image of the scene"}) {
      CHECK(of_stack.find(words) != std::string::npos);
    }
    CompileOptions options;
    options.image = true;
    CHECK_NOTHROW(static_cast<void>(compile_scene(file, options)));
  }
}

TEST_SUITE("tools.traits_header") {
  TEST_CASE("the needs of a scene follow its parameters") {
    const Opened scene(peg());
    const SceneTraits needs = needs_of(scene.view);
    CHECK(needs.image);
    CHECK(needs.content_hash == scene.view.header().content_hash);
    CHECK(needs.laws == law_set(LawId::kProxy));
    CHECK((!needs.friction && !needs.device));
    CHECK(needs.free_orientation);
    CHECK(needs.qp_rows == kMaxProxyRows);
    CHECK(needs.valid_visits == 240);
    SceneFile other = peg_with_device();
    other.parameters.law = LawId::kPaper;
    const Opened changed(other);
    const SceneTraits of_other = needs_of(changed.view);
    CHECK((of_other.laws == law_set(LawId::kPaper) && of_other.device));
    const Opened still(own_scene("tetrahedron_fixed"));
    CHECK_FALSE(needs_of(still.view).free_orientation);
  }

  TEST_CASE("the general program covers every scene; an image its own, and no less") {
    const Opened scene(peg());
    const SceneTraits needs = needs_of(scene.view);
    CHECK(covers(SceneTraits{}, needs));
    CHECK(covers(needs, needs));
    SceneTraits other = needs;
    other.content_hash ^= 1;
    CHECK_FALSE(covers(other, needs));
    SceneTraits other_law = needs, no_turn = needs;
    other_law.laws = law_set(LawId::kPaper);
    no_turn.free_orientation = false;
    CHECK_FALSE(covers(other_law, needs));
    CHECK_FALSE(covers(no_turn, needs));
    for (std::uint32_t SceneTraits::*room : {&SceneTraits::qp_rows, &SceneTraits::valid_visits}) {
      SceneTraits less = needs;
      less.*room -= 1;
      CHECK_FALSE(covers(less, needs));
    }
  }

  TEST_CASE("features can be left out and put in by name; unknown names are refused") {
    const Opened scene(peg());
    const SceneTraits plain = image_traits(scene.view, {}, {});
    CHECK((plain.contact_geometry && !plain.table_checks && !plain.friction));
    const SceneTraits less =
        image_traits(scene.view, {"contact_geometry"}, {"friction", "table_checks"});
    CHECK((!less.contact_geometry && less.friction && less.table_checks));
    CHECK(less.qp_rows == SceneTraits{}.qp_rows);
    CHECK(covers(less, needs_of(scene.view)));
    CHECK_THROWS_AS(image_traits(scene.view, {"proxy"}, {}), InputError);
    CHECK_THROWS_AS(image_traits(scene.view, {}, {"nonsense"}), InputError);
    const std::string header = traits_header(less, "a\nb\\");
    CHECK(header.find("scene 'a?b?'") != std::string::npos);
    CHECK(header.find("    .laws = 4u,") != std::string::npos);
    for (const std::string& name : trait_names()) {
      CAPTURE(name);
      if (find_law(name.c_str()) != nullptr) continue;
      CHECK(header.find("    ." + name + " = ") != std::string::npos);
    }
  }
}
