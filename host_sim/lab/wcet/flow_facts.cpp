// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/flow_facts.hpp"

#include <cstdio>

#include "host_sim/lab/wcet/core_stack.hpp"
#include "rt_core/scene/capacity.hpp"

namespace haptic::sim {
namespace {

// A new field of the header wants a line here.
static_assert(sizeof(SceneCapacity) == 104);

std::string comment_safe(const std::string& text) {
  std::string safe = text;
  for (char& c : safe) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return safe;
}

class Facts {
 public:
  void add(const char* name, std::uint64_t bound, const char* what) {
    text_ += std::string(name) + "\t" + std::to_string(bound) + "\t" + what + "\n";
  }
  void comment(const std::string& words) { text_ += "# " + words + "\n"; }
  [[nodiscard]] std::string text() const { return text_; }

 private:
  std::string text_;
};

void add_capacity(Facts& facts, const SceneCapacity& c) {
  facts.comment("of the scene's header; iterations of all runs of the loop in one tick");
  facts.add("state_bytes", c.state_bytes, "bytes of all mutable state; only create touches all");
  facts.add("moving_lanes", c.moving_lanes, "loop that turns the vertices of A, padded to lanes");
  facts.add("pair_count", c.pair_count, "loops over all pairs: gate, order of visits, report");
  facts.add("total_features", c.total_features, "faces and edges over all pairs: keys that age");
  facts.add("largest_pair_features", c.largest_pair_features,
            "faces and edges of one pair: one run of the search's loop over its keys");
  facts.add("largest_near", c.largest_near, "nodes of one pair's near set: one run");
  facts.add("max_pair_visits", c.max_pair_visits, "loop over the pairs that a tick searches");
  facts.add("max_support_pairs", c.max_support_pairs,
            "support pairs of gate, verdicts and edge pairs");
  facts.add("max_feature_evaluations", c.max_feature_evaluations,
            "faces and edges whose bound is computed");
  facts.add("max_edge_pairs", c.max_edge_pairs, "pairs of active edges tested");
  facts.add("max_near_nodes", c.max_near_nodes, "near nodes collected, all pairs together");
  facts.add("max_hull_points", c.max_hull_points, "points that enter one contact region");
  facts.add("near_slots", c.near_slots, "law proxy: loops over the pairs near the part");
  facts.add("max_work_units", c.max_work_units,
            "law proxy: units of all that follows but programs, with 4 for a step of a program");
  facts.add("max_list_visits", c.max_list_visits, "law proxy: nodes of the trees of pieces");
  facts.add("max_plane_gaps", c.max_work_units, "law proxy: gaps along C-face planes");
  facts.add("max_valid_nodes", c.max_work_units, "law proxy: nodes looked at for valid planes");
  facts.add("max_full_searches", c.max_full_searches, "law proxy: searches without history");
  facts.add("max_search_work", c.max_work_units,
            "law proxy: faces, edges, edge pairs, support pairs and nodes of those searches");
  facts.add("max_proxy_passes", c.max_proxy_passes, "law proxy: loop over the passes");
  facts.add("max_proxy_rejected", c.max_proxy_rejected, "law proxy: passes that find no step");
  facts.add("max_proxy_rounds", c.max_proxy_rounds, "law proxy: rounds of one pass: one run");
  facts.add("max_qp_rows", c.max_qp_rows, "law proxy: rows of one quadratic program: one run");
  facts.add("max_qp_iterations", c.max_qp_iterations,
            "law proxy: iterations of one quadratic program: one run");
  facts.add("max_qp_programs", c.max_qp_programs, "law proxy: quadratic programs solved");
  facts.add("max_qp_steps", c.max_qp_steps, "law proxy: iterations of all programs together");
}

void add_compiled(Facts& facts) {
  facts.comment("compiled into the core");
  facts.add("kMaxSupportPairsPerAttempt", kMaxSupportPairsPerAttempt,
            "support pairs of one attempt of a verdict");
  facts.add("kMaxSupportPairsPerVerdict", kMaxSupportPairsPerVerdict,
            "support pairs of a verdict: warm attempt, cold attempt");
  facts.add("kGateSupportPairs", kGateSupportPairs, "support pairs of the gate, per pair");
  facts.add("kProxyRounds", kProxyRounds, "rounds of a pass before it tries smaller steps");
  facts.add("kProxyRetries", kProxyRetries, "times that a pass tries within a smaller step");
  facts.add("kProxyRetryRounds", kProxyRetryRounds, "rounds of one such try");
  facts.add("kMaxCorrections", kMaxCorrections, "displaced steps that a pass tries, twice");
  facts.add("kMaxBoundPrograms", kMaxBoundPrograms,
            "programs that a pass solves again for what the part may move by");
  facts.add("kMaxBackOffs", kMaxBackOffs, "shortened steps that a pass tries");
  facts.add("kMaxFrictionCones", kMaxFrictionCones, "contact points with friction in one program");
  facts.add("kMaxConePrograms", kMaxConePrograms,
            "programs of a pass solved again for a cone of friction");
  facts.add("kMaxImposedPlanes", kMaxImposedPlanes, "planes of one quadratic program");
  facts.add("kMaxValidPlanes", kMaxValidPlanes, "planes kept of a pair's valid set");
  facts.add("kMaxValidVisits", kMaxValidVisits, "nodes of one search for valid planes");
  facts.add("kMaxValidSearches", kMaxValidSearches, "pairs whose valid sets a pass has room for");
}

void add_stack(Facts& facts) {
  const CoreStack& stack = core_stack();
  if (!stack.measured) {
    facts.comment("stack: not measured: " + std::string(stack.why_not));
    return;
  }
  facts.comment("of this program's core, added up from the compiler's frames");
  facts.add("stack_bytes_tick", stack.tick.bytes, "stack of HapticCore::step and all it calls");
  facts.add("stack_bytes_servo_tick", stack.core.bytes,
            "stack of the servo tick with its safety stages");
  std::string chain;
  for (const StackFrame& frame : stack.core.chain)
    chain += (chain.empty() ? "" : " > ") + std::string(frame.function);
  facts.comment("deepest chain: " + chain);
}

}  // namespace

std::string flow_facts(const SceneView& view, const std::string& name) {
  const SceneHeader& header = view.header();
  Facts facts;
  facts.comment("flow facts of " + comment_safe(name));
  char line[96];
  std::snprintf(line, sizeof line, "content hash %016llx, scalar of %u bytes",
                static_cast<unsigned long long>(header.content_hash), header.scalar_bytes);
  facts.comment(line);
  facts.comment("name, bound, what it bounds; separated by tabs");
  add_capacity(facts, header.capacity);
  if (header.capacity.unproven != 0) {
    facts.comment("unproven " + std::to_string(header.capacity.unproven) +
                  ": to keep these bounds a tick may have to give up exactness, flagged");
  }
  add_compiled(facts);
  add_stack(facts);
  return facts.text();
}

}  // namespace haptic::sim
