// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The budget of a scene file against what the compiled scene needs: where the bytes go, and what
/// to leave out, each proposal with the bytes that it saves.

#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

/// The scene is in order but does not fit: kExitCheckFailed, not kExitBadInput.
class BudgetError : public InputError {
 public:
  using InputError::InputError;
};

/// Something to leave out. The bytes are computed for this scene, not estimated.
struct BudgetProposal {
  std::string what;  ///< with the key of the scene file that does it
  std::uint64_t constants_saved = 0, state_saved = 0;
};

/// Parts of the scene that can be left out, most saved bytes first. `state_budget`: the state that
/// must fit, 0: none (then the fewest visits are proposed). Cost: that of a few openings of the
/// blob.
std::vector<BudgetProposal> budget_proposals(const SceneView& scene, std::uint64_t state_budget);

/// Bytes of a blob of `scene` whose stored graphs hold `nodes` nodes and `neighbors` list entries
/// of `neighbor_bytes` each; with the scene's own numbers, the size of its blob.
std::uint64_t blob_bytes(const SceneView& scene, std::uint64_t nodes, std::uint64_t neighbors,
                         std::uint32_t neighbor_bytes);

/// Stack that the whole core may need from step() downwards [bytes]; the build holds it to that.
std::uint64_t core_stack_bytes();

/// @throws BudgetError "file:line:column: ..." with the breakdown and the proposals when the
/// constants or the state exceed the limits of `[budget]`, or the stack of the whole core does.
/// `image`: of the core that is compiled for this scene, which its build holds to the stack.
void check_budgets(const SceneFile& file, const SceneView& scene, bool image);

}  // namespace haptic::tools
