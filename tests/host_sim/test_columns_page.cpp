// SPDX-License-Identifier: Apache-2.0
// host_sim/COLUMNS.md against what the programs write: each file's columns in their order, the bits
// of the flags, and no column that a source writes and the page does not know.
#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "hal/realtime/flight_report.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/session/contact_log.hpp"
#include "host_sim/session/replay_summary.hpp"
#include "rt_core/safety/arming.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

using Words = std::vector<std::string>;

/// The tables of the page, by section and word in front of their first column: the first cell of
/// each row, without back quotes, or all of its cells.
class ColumnsPage {
 public:
  ColumnsPage() {
    std::istringstream text(test::text_of_file(std::string(HAPTIC_SCENES_DIR) + "/../COLUMNS.md"));
    std::string line, section, table;
    while (std::getline(text, line)) {
      if (line.starts_with("## ")) section = line.substr(3);
      if (line.starts_with("|--")) continue;
      if (!line.starts_with("| ")) {
        table.clear();
        continue;
      }
      const Words cells = cells_of(line);
      if (table.empty()) {
        table = section + ": " + cells.front();
        continue;
      }
      rows_[table].push_back(cells);
    }
  }

  /// Of the rows of a table: cell `k`.
  [[nodiscard]] Words column(const std::string& table, std::size_t k = 0) const {
    const auto found = rows_.find(table);
    Words words;
    if (found == rows_.end()) return words;
    for (const Words& cells : found->second) words.push_back(k < cells.size() ? cells[k] : "");
    return words;
  }
  [[nodiscard]] std::set<std::string> all_first_cells() const {
    std::set<std::string> all;
    for (const auto& [table, rows] : rows_)
      for (const Words& cells : rows) all.insert(cells.front());
    return all;
  }

 private:
  static Words cells_of(const std::string& line) {
    Words cells;
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) {
      std::erase(cell, '`');
      const std::size_t from = cell.find_first_not_of(' ');
      cells.push_back(from == std::string::npos
                          ? ""
                          : cell.substr(from, cell.find_last_not_of(' ') - from + 1));
    }
    return cells;
  }
  std::map<std::string, std::vector<Words>> rows_;
};

std::string listed(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ",") + word;
  return text;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// Numbers that are zero with a sign.
std::size_t signed_zeros(const std::string& csv) {
  const std::regex zero("(^|[,\n; ])-0(\\.0*)?(e[+-]?\\d+)?(?=[,\n; ]|$)");
  return static_cast<std::size_t>(
      std::distance(std::sregex_iterator(csv.begin(), csv.end(), zero), std::sregex_iterator()));
}

void check_rows(const std::string& csv) {
  const auto columns = [](const std::string& line) { return std::ranges::count(line, ','); };
  std::istringstream text(csv);
  std::string head, line;
  REQUIRE(std::getline(text, head));
  std::size_t rows = 0, uneven = 0;
  for (; std::getline(text, line); ++rows) uneven += columns(line) == columns(head) ? 0u : 1u;
  CHECK(rows > 0);
  CHECK(uneven == 0);
  CHECK(signed_zeros(csv) == 0);
}

std::set<std::string> words_in_back_quotes(const std::string& page) {
  std::set<std::string> words;
  const std::regex quoted("`([A-Za-z0-9_.]+)`");
  for (std::sregex_iterator at(page.begin(), page.end(), quoted), end; at != end; ++at)
    words.insert((*at)[1].str());
  return words;
}

/// Literals of a source, joined where they stand behind each other, that are names with three
/// commas or more: heads of tables.
std::vector<std::string> table_heads(const std::string& source) {
  std::vector<std::string> heads;
  std::string joined_literals;
  const auto finish = [&] {
    const auto commas = std::ranges::count(joined_literals, ',');
    const bool names = !joined_literals.empty() && std::isdigit(joined_literals[0]) == 0 &&
                       joined_literals.find_first_not_of(
                           "abcdefghijklmnopqrstuvwxyz0123456789_,") == std::string::npos;
    if (commas >= 3 && names) heads.push_back(joined_literals);
    joined_literals.clear();
  };
  for (std::size_t at = 0; at < source.size();) {
    if (source[at] == '"') {
      for (++at; at < source.size() && source[at] != '"' && source[at] != '\n'; ++at) {
        if (source[at] != '\\') {
          joined_literals += source[at];
        } else if (source[++at] != 'n') {
          joined_literals += '?';
        }
      }
      ++at;
    } else {
      if (std::isspace(static_cast<unsigned char>(source[at])) == 0) finish();
      ++at;
    }
  }
  return heads;
}

const std::string kReplay = "Ticks of a replay: ";

}  // namespace

TEST_SUITE("host_sim.columns_page") {
  TEST_CASE("columns: the page has those of every file that the programs write, in their order") {
    const ColumnsPage page;
    const test::ScratchFolder folder("columns");
    const std::string scenes(HAPTIC_SCENES_DIR);
    const std::string scene = folder.file("s.rtscene"), motion = folder.file("m.csv");
    REQUIRE(test::run_program(HAPTIC_GRAPH_COMPILER,
                              scenes + "/square_peg_five/scene.toml --quiet -o " + scene)
                .exit_code == 0);
    REQUIRE(
        test::run_program(HAPTIC_HOST_SIM, "motion --for " + scene + " -o " + motion).exit_code ==
        0);
    const std::string samples = test::text_of_file(motion);
    CHECK(first_line(samples) == listed(page.column("Motion: column")));
    check_rows(samples);

    const std::string ticks = folder.file("t.csv"), contacts = folder.file("c.csv");
    REQUIRE(test::run_program(HAPTIC_HOST_SIM, "replay " + scene + " --motion " + motion + " -o " +
                                                   ticks + " --contacts " + contacts)
                .exit_code == 0);
    const std::string of_replay = listed(page.column(kReplay + "column"));
    const std::string of_poses = listed(page.column(kReplay + "pose column"));
    const std::string added = listed(page.column(kReplay + "added column"));
    const std::string of_added = added.empty() ? "" : "," + added;
    const std::string played = test::text_of_file(ticks), touched = test::text_of_file(contacts);
    CHECK(first_line(played) == of_replay + "," + of_poses + of_added);
    check_rows(played);
    CHECK(first_line(touched) == listed(page.column("Contacts of a replay: column")));
    check_rows(touched);

    const std::string of_run = listed(page.column("Ticks of a run: run column"));
    const std::string of_stack = listed(page.column("Ticks of a run: stack column"));
    for (const bool stack : {false, true}) {
      CAPTURE(stack);
      const std::string out = folder.file(stack ? "stack" : "run");
      const auto run =
          test::run_program(HAPTIC_HOST_SIM, "run " + scene + " --seconds 1 --out " + out +
                                                 (stack ? " --carrier direct" : ""));
      CAPTURE(run.err);
      REQUIRE(run.exit_code == 0);
      const std::string csv = test::text_of_file(out + "/run.csv");
      CHECK(first_line(csv) ==
            of_replay + "," + of_poses + "," + of_run + (stack ? "," + of_stack : "") + of_added);
      check_rows(csv);
    }

    const std::string space = folder.file("space");
    REQUIRE(
        test::run_program(HAPTIC_SCENE_INSPECT, scene + " --cspace 0,0,0.05 --cspace-dir " + space)
            .exit_code == 0);
    const std::string drawn = test::text_of_file(space + "/cspace.csv");
    CHECK(first_line(drawn) == listed(page.column("C-space: column")));
    check_rows(drawn);

    CHECK(first_line(hal::flight_csv({})) == listed(page.column("Crash file: column")));
    CHECK(kContactCsvHeader == listed(page.column("Contacts of a replay: column")));
  }

  TEST_CASE("columns: a number of a file that is zero has no sign") {
    CHECK(signed_zeros("a,b\n-0,1\n0,-0\n") == 2);
    CHECK(signed_zeros("a\n-0.000\n-0e+00\n-0.5\n0.0-0\n") == 2);
    TickRecord tick;
    tick.force_n[0] = -0.0;
    tick.proxy_wa.p_m[0] = -0.0;
    CHECK(signed_zeros(tick_csv({&tick, 1})) == 0);
    StepTrace trace;
    trace.command_force_n[1] = -0.0;
    CHECK(signed_zeros(hal::flight_csv({&trace, 1})) == 0);
    const test::ScratchFolder folder("zeros");
    write_motion_csv(folder.file("m.csv"), {{0, {-1e-12, -0.0, 0.5}, {1, -1e-15, 0, 0}}});
    CHECK(signed_zeros(test::text_of_file(folder.file("m.csv"))) == 0);
  }

  TEST_CASE("columns: the page names every flag by its bit") {
    const ColumnsPage page;
    Words bits, values, names;
    for (std::size_t bit = 0; bit < kFlagCount; ++bit) {
      bits.push_back(std::to_string(bit));
      values.push_back(std::to_string(1u << bit));
      names.emplace_back(flag_name(bit));
    }
    CHECK(page.column(kReplay + "bit") == bits);
    CHECK(page.column(kReplay + "bit", 1) == values);
    CHECK(page.column(kReplay + "bit", 2) == names);

    const Words faults = page.column("Crash file: fault bit", 2);
    for (std::size_t bit = 0; bit < faults.size(); ++bit)
      CHECK(faults[bit] == fault_text(1u << bit));
    CHECK(fault_text(1u << faults.size()) == std::string("unknown fault"));
    const Words at = page.column("Crash file: device fault bit");
    const Words said = page.column("Crash file: device fault bit", 2);
    std::uint32_t known = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
      known |= 1u << std::stoul(at[k]);
      CHECK(hal::device_fault_texts(1u << std::stoul(at[k])) == said[k]);
    }
    for (std::uint32_t bit = 0; bit < 32; ++bit) {
      if ((known >> bit & 1u) == 0) CHECK(hal::device_fault_texts(1u << bit) == "unknown fault");
    }
  }

  TEST_CASE("columns: what a source writes as the head of a table is on the page") {
    const std::string page = test::text_of_file(std::string(HAPTIC_SCENES_DIR) + "/../COLUMNS.md");
    const std::set<std::string> known = words_in_back_quotes(page);
    std::size_t heads = 0;
    const std::filesystem::path root = std::filesystem::path(HAPTIC_SCENES_DIR) / ".." / "..";
    for (const char* const folder : {"host_sim", "tools/scene_inspect", "hal/realtime"}) {
      for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".cpp" && extension != ".hpp") continue;
        for (const std::string& head : table_heads(test::text_of_file(entry.path().string()))) {
          heads += 1;
          std::istringstream names(head);
          for (std::string name; std::getline(names, name, ',');) {
            if (name.empty()) continue;
            CHECK_MESSAGE(known.contains(name), entry.path().filename().string(), " writes ", name);
          }
        }
      }
    }
    CHECK(heads > 40);
    CHECK(table_heads("f(\"a,b\"\n  \",c_m,d\\n\");") == std::vector<std::string>{"a,b,c_m,d"});
    CHECK(table_heads("f(\"one, two, three, four\"); g(\"0,0,1,0\");").empty());
  }
}
