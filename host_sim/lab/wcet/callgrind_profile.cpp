// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/callgrind_profile.hpp"

#include <algorithm>
#include <charconv>
#include <istream>
#include <map>
#include <string_view>

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

}  // namespace

CallgrindProfile read_callgrind(std::istream& stream, const std::string& name) {
  return Reader(stream, name).read();
}

}  // namespace haptic::sim
