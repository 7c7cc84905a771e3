// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Account of what a reader leaves out of a file, by the reason, for the person to know.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace haptic::tools {

class LeftOut {
 public:
  /// @param reason  such as "of type 'support'". @param what  such as "object '2' (line 4)".
  void add(const std::string& reason, const std::string& what) {
    for (auto& [known, first, count] : reasons_) {
      if (known != reason) continue;
      ++count;
      return;
    }
    reasons_.push_back({reason, what, 1});
  }
  [[nodiscard]] bool empty() const { return reasons_.empty(); }
  /// One sentence a reason: the first that was left out for it, and how many more.
  [[nodiscard]] std::vector<std::string> sentences() const {
    std::vector<std::string> all;
    for (const auto& [reason, first, count] : reasons_) {
      std::string text = "left out: " + first;
      if (count > 1) text += " and " + std::to_string(count - 1) + " more";
      all.push_back(text + ", " + reason);
    }
    return all;
  }

 private:
  struct Reason {
    std::string reason, first;
    std::size_t count = 0;
  };
  std::vector<Reason> reasons_;
};

}  // namespace haptic::tools
