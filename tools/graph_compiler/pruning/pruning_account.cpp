// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/pruning_account.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace haptic::tools {
namespace {

nlohmann::ordered_json counts_json(const NodeCounts& counts) {
  return {{"all", counts.all()}, {"a", counts.a}, {"b", counts.b}, {"c", counts.c}};
}

nlohmann::ordered_json hidden_json(const HiddenCount& count) {
  return {{"hidden", count.hidden}, {"all", count.all}};
}

std::string counts_line(const char* name, const NodeCounts& counts) {
  char text[128];
  std::snprintf(text, sizeof text, "    %-28s %10zu  (A %zu, B %zu, C %zu)\n", name, counts.all(),
                counts.a, counts.b, counts.c);
  return text;
}

}  // namespace

double PruningAccount::live_percent() const {
  const double all = static_cast<double>(counts.nodes.all());
  return all > 0.0 ? 100.0 * static_cast<double>(counts.live.all()) / all : 0.0;
}

nlohmann::ordered_json account_as_json(const PruningAccount& account) {
  return {{"pruned", account.pruned},
          {"moving_pieces", account.moving_pieces},
          {"static_pieces", account.static_pieces},
          {"nodes", counts_json(account.counts.nodes)},
          {"reachable", counts_json(account.counts.reachable)},
          {"exposed", counts_json(account.counts.open)},
          {"live", counts_json(account.counts.live)},
          {"live_percent", account.live_percent()},
          {"largest_pair_before", account.largest_pair_before},
          {"largest_pair_after", account.largest_pair_after},
          {"pairs", account.pairs},
          {"pairs_out_of_reach", account.pairs_out_of_reach},
          {"faces", hidden_json(account.faces)},
          {"edges", hidden_json(account.edges)},
          {"vertices", hidden_json(account.vertices)},
          {"partly_covered_faces", account.partly_covered_faces}};
}

std::string account_as_text(const PruningAccount& account) {
  char text[256];
  std::snprintf(text, sizeof text,
                "needed basic contacts: %zu moving and %zu static pieces, %.1f + %.1f ms%s\n",
                account.moving_pieces, account.static_pieces, account.exposure_ms, account.marks_ms,
                account.pruned ? "" : "; all are kept, as asked");
  std::string result = text;
  result += counts_line("nodes", account.counts.nodes);
  result += counts_line("reachable", account.counts.reachable);
  result += counts_line("exposed", account.counts.open);
  result += counts_line("both", account.counts.live);
  std::snprintf(text, sizeof text,
                "    %.1f %% of the nodes; largest pair %zu, of which %zu; %zu of %zu pairs out of "
                "reach\n",
                account.live_percent(), account.largest_pair_before, account.largest_pair_after,
                account.pairs_out_of_reach, account.pairs);
  result += text;
  std::snprintf(text, sizeof text,
                "    hidden: faces %zu of %zu, edges %zu of %zu, vertices %zu of %zu; covered in "
                "part: faces %zu\n",
                account.faces.hidden, account.faces.all, account.edges.hidden, account.edges.all,
                account.vertices.hidden, account.vertices.all, account.partly_covered_faces);
  return result + text;
}

}  // namespace haptic::tools
