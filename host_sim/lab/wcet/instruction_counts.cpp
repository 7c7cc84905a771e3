// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/instruction_counts.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <istream>
#include <map>
#include <string_view>

#include "host_sim/report/quantile.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

struct Cost {
  std::uint64_t self = 0, inclusive = 0;
};
using Costs = std::map<std::uint32_t, Cost>;  // by the profile's number of the function

/// "haptic::(anonymous namespace)::f(haptic::Pose const&) [clone .cold]" -> "haptic::f [part]",
/// what the compiler has split from f; names that begin with a parenthesis stay as they are.
std::string without_parameters(std::string name) {
  constexpr std::string_view kAnonymous = "(anonymous namespace)::";
  for (std::size_t at = name.find(kAnonymous); at != std::string::npos; at = name.find(kAnonymous))
    name.erase(at, kAnonymous.size());
  const std::size_t at = name.find('(');
  const bool split = name.find("[clone .cold") != std::string::npos ||
                     name.find("[clone .part") != std::string::npos;
  if (at != std::string::npos && at > 0) name.erase(at);
  if (split) name += " [part]";
  return name;
}

class Reader {
 public:
  Reader(std::istream& stream, const std::string& name) : stream_(stream), name_(name) {}

  CallgrindProfile read() {
    for (std::string line; std::getline(stream_, line);) take(line);
    if (profile_.per_tick.empty()) fail("no tick in the profile");
    profile_.whole = listed(whole_);
    profile_.dearest = listed(dearest_);
    return std::move(profile_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw tools::InputError(name_ + ": " + what);
  }

  std::uint64_t number(std::string_view text) const {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
      fail("'" + std::string(text) + "' is no number");
    return value;
  }

  /// The number in "(12) name" or "(12)"; a name is given once and kept.
  std::uint32_t function(std::string_view text) {
    const std::size_t close = text.find(')');
    if (!text.starts_with('(') || close == std::string_view::npos) fail("function without number");
    const auto id = static_cast<std::uint32_t>(number(text.substr(1, close - 1)));
    if (text.size() > close + 2)
      names_[id] = without_parameters(std::string(text.substr(close + 2)));
    return id;
  }

  void take(std::string_view line) {
    const auto rest = [&](std::string_view key) { return line.substr(key.size()); };
    if (line.starts_with("part: ")) {
      part_.clear();
      is_tick_ = false;
    } else if (line.starts_with("desc: Trigger: --dump-after=")) {
      is_tick_ = true;
    } else if (line.starts_with("desc: Trigger: --dump-before=")) {
      profile_ = CallgrindProfile{};
      whole_.clear();
    } else if (line.starts_with("fn=")) {
      current_ = function(rest("fn="));
    } else if (line.starts_with("cfn=")) {
      static_cast<void>(function(rest("cfn=")));
    } else if (line.starts_with("calls=")) {
      called_ = true;
    } else if (line.starts_with("totals: ")) {
      end_part(number(rest("totals: ")));
    } else if (!line.empty() && (line[0] == '+' || line[0] == '-' || line[0] == '*' ||
                                 (line[0] >= '0' && line[0] <= '9'))) {
      const std::uint64_t cost = number(line.substr(line.rfind(' ') + 1));
      Cost& of = part_[current_];
      if (!called_) of.self += cost;
      of.inclusive += cost;
      called_ = false;
    }
  }

  void end_part(std::uint64_t total) {
    std::uint64_t sum = 0;
    for (const auto& [id, cost] : part_) sum += cost.self;
    if (sum != total) fail("the functions of a part do not add up to its total");
    if (!is_tick_) {
      if (total != 0) fail("instructions outside the ticks");
      return;
    }
    for (const auto& [id, cost] : part_) {
      whole_[id].self += cost.self;
      whole_[id].inclusive += cost.inclusive;
    }
    if (profile_.per_tick.empty() || total > profile_.per_tick[profile_.dearest_tick]) {
      profile_.dearest_tick = profile_.per_tick.size();
      dearest_ = part_;
    }
    profile_.per_tick.push_back(total);
    profile_.total += total;
  }

  /// Overloads are one entry.
  std::vector<FunctionCost> listed(const Costs& costs) const {
    std::map<std::string, Cost> by_name;
    for (const auto& [id, cost] : costs) {
      if (cost.self == 0) continue;
      const auto name = names_.find(id);
      Cost& sum = by_name[name == names_.end() ? "?" : name->second];
      sum.self += cost.self;
      sum.inclusive += cost.inclusive;
    }
    std::vector<FunctionCost> list;
    for (const auto& [name, cost] : by_name) list.push_back({name, cost.self, cost.inclusive});
    std::ranges::sort(list, [](const FunctionCost& l, const FunctionCost& r) {
      return l.self != r.self ? l.self > r.self : l.name < r.name;
    });
    return list;
  }

  std::istream& stream_;
  std::string name_;
  CallgrindProfile profile_;
  std::map<std::uint32_t, std::string> names_;
  Costs part_, whole_, dearest_;
  std::uint32_t current_ = 0;
  bool called_ = false, is_tick_ = false;
};

constexpr std::size_t kShownFunctions = 12;

std::vector<std::string> command_of(const InstructionQuestion& question,
                                    const std::string& profile) {
  // The tick alone is collected; each of its returns ends a part of the profile. What callgrind
  // calls a function is matched as a whole, so that a cold part split from it does not switch.
  std::vector<std::string> command = {"valgrind",
                                      "--tool=callgrind",
                                      "--callgrind-out-file=" + profile,
                                      "--combine-dumps=yes",
                                      "--dump-line=no",
                                      "--toggle-collect=" + question.tick,
                                      "--dump-after=" + question.tick,
                                      "--dump-before=" + question.run,
                                      question.program};
  command.insert(command.end(), question.arguments.begin(), question.arguments.end());
  return command;
}

InstructionCounts not_measured(std::string why) {
  InstructionCounts counts;
  counts.why_not = std::move(why);
  return counts;
}

void line_of(std::string& text, const char* name, const FunctionCost* whole,
             const FunctionCost* dearest, const CallgrindProfile& p) {
  const auto share = [](std::uint64_t part, std::uint64_t all) {
    return 100.0 * static_cast<double>(part) / static_cast<double>(std::max<std::uint64_t>(all, 1));
  };
  const double ticks = static_cast<double>(p.per_tick.size());
  const FunctionCost none{};
  const FunctionCost& w = whole != nullptr ? *whole : none;
  const FunctionCost& d = dearest != nullptr ? *dearest : none;
  char line[256];
  std::snprintf(line, sizeof line, "  %-40.40s %9.0f %5.1f%% %10.0f %9llu %5.1f%% %10llu\n", name,
                static_cast<double>(w.self) / ticks, share(w.self, p.total),
                static_cast<double>(w.inclusive) / ticks, static_cast<unsigned long long>(d.self),
                share(d.self, p.per_tick[p.dearest_tick]),
                static_cast<unsigned long long>(d.inclusive));
  text += line;
}

const FunctionCost* found(const std::vector<FunctionCost>& list, const std::string& name) {
  const auto at = std::ranges::find(list, name, &FunctionCost::name);
  return at == list.end() ? nullptr : &*at;
}

}  // namespace

CallgrindProfile read_callgrind(std::istream& stream, const std::string& name) {
  return Reader(stream, name).read();
}

std::uint64_t run_once(CoreSession& session, std::span<const MotionSample> motion,
                       GoalContact goal) {
  session.core().reset();
  std::uint64_t hash = 0;
  for (std::size_t i = 0; i < motion.size(); ++i)
    hash = session.core().step(input_of(motion[i], i, goal)).state_hash;
  return hash;
}

InstructionCounts count_instructions(const InstructionQuestion& question) {
  if (question.program.empty()) return not_measured("not asked for");
  const TemporaryFolder folder;
  const std::string profile = folder.file("profile");
  const int status =
      run_to_end(command_of(question, profile), folder.file("out"), folder.file("err"));
  if (status == -1) {
    return not_measured(errno == ENOENT ? "valgrind is missing, apt-get install valgrind"
                                        : "valgrind: " + std::string(std::strerror(errno)));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return not_measured("the run under valgrind failed: " +
                        last_line(file_text(folder.file("err"))));
  char expected[80];
  std::snprintf(expected, sizeof expected, "%zu ticks, final state hash %016llx", question.ticks,
                static_cast<unsigned long long>(question.state_hash));
  const std::string ended = last_line(file_text(folder.file("out")));
  if (ended != expected) {
    return not_measured("the run under valgrind ended in '" + ended + "' and not in '" + expected +
                        "'");
  }
  InstructionCounts counts;
  try {
    std::ifstream stream(profile, std::ios::binary);
    counts.profile = read_callgrind(stream, "callgrind's profile");
  } catch (const tools::InputError& error) {
    return not_measured(error.what());
  }
  std::vector<std::uint64_t> sorted = counts.profile.per_tick;
  if (sorted.size() != question.ticks)
    return not_measured("the profile has " + std::to_string(sorted.size()) + " ticks");
  std::ranges::sort(sorted);
  counts.median = quantile(sorted, 0.5);
  counts.largest = sorted.back();
  counts.measured = true;
  return counts;
}

std::string instruction_table(const InstructionCounts& counts) {
  if (!counts.measured) return "instructions per tick: not measured: " + counts.why_not + "\n";
  const CallgrindProfile& p = counts.profile;
  char line[200];
  std::snprintf(
      line, sizeof line,
      "instructions per tick, exact, of %zu ticks: median %llu, largest %llu in tick %zu\n",
      p.per_tick.size(), static_cast<unsigned long long>(counts.median),
      static_cast<unsigned long long>(counts.largest), p.dearest_tick);
  std::string text = line;
  std::snprintf(line, sizeof line, "  %-40s %9s %6s %10s %9s %6s %10s\n",
                "mean tick | largest tick", "self", "share", "with calls", "self", "share",
                "with calls");
  text += line;
  std::vector<std::string> names;
  for (const auto* list : {&p.dearest, &p.whole}) {
    for (std::size_t k = 0; k < std::min(kShownFunctions, list->size()); ++k) {
      const std::string& name = (*list)[k].name;
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  for (const std::string& name : names) {
    std::string shown = name;
    if (shown.starts_with("haptic::")) shown.erase(0, std::strlen("haptic::"));
    line_of(text, shown.c_str(), found(p.whole, name), found(p.dearest, name), p);
  }
  return text;
}

}  // namespace haptic::sim
