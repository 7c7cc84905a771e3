// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Proofs repeated from the bytes of a scene, each with what it means, its figures, and
/// whether it holds.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/scene_facts/scene_facts.hpp"
#include "tools/scene_inspect/pruning_recheck.hpp"

namespace haptic::tools {

/// Everything that scene_inspect knows of a scene.
struct Inspection {
  SceneFacts facts;
  PruningRecheck pruning;
};

enum class ProofResult : std::uint8_t {
  kHolds,
  kLimited,  ///< does not hold, which the scene is allowed to; the figures say what follows
  kFails     ///< the scene is not what it must be
};

struct SceneProof {
  std::string name;     ///< one word: "convex"
  std::string proves;   ///< a sentence
  std::string figures;  ///< what was found
  ProofResult result = ProofResult::kHolds;
};

std::vector<SceneProof> certificates_of(const Inspection& inspection);

/// No certificate fails.
bool is_sound(const std::vector<SceneProof>& certificates);

/// `[holds]` and the sentences, wrapped.
std::string certificates_as_text(const std::vector<SceneProof>& certificates);
nlohmann::ordered_json certificates_as_json(const std::vector<SceneProof>& certificates);

/// Breaks `text` into lines of at most 100 characters, each after `indent` blanks, never within a
/// number; ends the last line.
std::string wrapped(const std::string& text, std::size_t indent);

}  // namespace haptic::tools
