// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "host_sim/motion_log/log_rows.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

/// Members deeper than this hold no pose.
constexpr int kDeepestMember = 8;

/// "pose.position.x", "state.0": members of objects and arrays by their way.
struct FlatMembers {
  std::vector<std::string> names, values;

  void add(const std::string& name, const Json& value, int depth) {
    if (names.size() >= kMostLogColumns || depth > kDeepestMember) return;
    const std::string before = name.empty() ? "" : name + ".";
    if (value.is_object()) {
      for (const auto& [key, member] : value.items()) add(before + key, member, depth + 1);
    } else if (value.is_array()) {
      std::size_t k = 0;
      for (const Json& member : value) add(before + std::to_string(k++), member, depth + 1);
    } else {
      names.push_back(name);
      if (value.is_number()) {
        values.push_back(value.dump());
      } else if (value.is_string()) {
        values.push_back(value.get_ref<const std::string&>());
      } else {
        values.emplace_back(value.is_null() ? "null" : "a truth value");
      }
    }
  }
};

class JsonRows : public LogRows {
 public:
  JsonRows(const std::string& path, std::string text) : text_(std::move(text)), rest_(text_) {
    path_ = path;
    form_ = "JSON, an object a line";
    // The first object names the members.
    const std::string_view whole = rest_;
    if (read_object()) names_ = members_.names;
    rest_ = whole;
    line_ = 0;
  }

  bool next() override {
    if (!read_object()) return false;
    cells_.assign(names_.size(), {});
    for (std::size_t k = 0; k < names_.size(); ++k) {
      std::size_t at = k;  // mostly in the same order
      if (at >= members_.names.size() || members_.names[at] != names_[k]) {
        const auto found = std::find(members_.names.begin(), members_.names.end(), names_[k]);
        at = static_cast<std::size_t>(found - members_.names.begin());
      }
      if (at < members_.values.size()) cells_[k] = trimmed(members_.values[at]);
    }
    return true;
  }

 private:
  bool read_object() {
    while (!rest_.empty()) {
      ++line_;
      const std::string_view line = trimmed(take_log_line(rest_));
      if (line.empty()) continue;
      if (line.size() > kMostLogLineBytes) {
        refuse("the line has more than " + std::to_string(kMostLogLineBytes) +
               " bytes; leave pictures out of the log");
      }
      const Json object = Json::parse(line, nullptr, false);
      if (!object.is_object()) {
        refuse(
            "is no JSON object; write each sample as one object on a line of its own, with "
            "numbers that are finite");
      }
      members_ = {};
      members_.add("", object, 0);
      return true;
    }
    return false;
  }

  std::string text_;
  std::string_view rest_;
  FlatMembers members_;
};

}  // namespace

std::unique_ptr<LogRows> json_rows(const std::string& path, std::string text) {
  return std::make_unique<JsonRows>(path, std::move(text));
}

}  // namespace haptic::sim
