// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a stranger gets who brings a pair of parts, by defaults: the programs themselves, one after
/// another, as README has them, on the files of a pair; and the judgement of what they give.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/lab/strangers/stranger_judge.hpp"

namespace haptic::sim {

struct TrialOptions {
  bool is_short = false;  ///< the hand's motion and the open air alone
  bool full = false;      ///< the reference with large budgets always, also with friction
  double friction = 0.2;  ///< of the second scene
  std::vector<std::string> hands = {"light", "firm"};  ///< of `run`
  std::string keep;  ///< folder under which a folder of every pair stays; empty: none does
  std::string more;  ///< lines of TOML for every scene, to try a remedy
  std::optional<StrangerFault> fault;  ///< made on purpose
};

/// A motion that was played, by name: "hand", "motion --for", "friction", "run light", ..
struct NamedAccount {
  std::string name;
  PlayedAccount account;
};

struct StrangerTrial {
  std::string family;
  std::uint64_t seed = 0;
  double clearance_mm = 0;
  std::size_t moving_triangles = 0, fixed_triangles = 0;
  std::string parts;  ///< "solid 12, surface 320": as what, and pieces or facets
  std::size_t pairs = 0, near_slots = 0;
  bool certifiable = false;
  int init_exit = 0;
  double contact_share = -1;  ///< of the ticks of `motion --for`; < 0: not made
  std::vector<NamedAccount> motions;
  std::vector<FoundFault> faults;  ///< worst first

  [[nodiscard]] bool right() const { return faults.empty(); }
  /// "STUCK+LATE", or "right".
  [[nodiscard]] std::string verdict() const;
};

/// @throws tools::InputError  a program is not built; OsError: a file cannot be written.
[[nodiscard]] StrangerTrial try_pair(const StrangerPair& pair, const TrialOptions& options);

/// The text of a scene file with keys of a section replaced or added: `lines` as a file has them,
/// section by section.
[[nodiscard]] std::string with_keys(const std::string& scene, const std::string& lines);
/// The text of `init` with the unit, the start and the places of a pair put in.
[[nodiscard]] std::string placed_scene(const std::string& init, const StrangerPair& pair,
                                       bool as_meant, double friction);

}  // namespace haptic::sim
