// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A vendor's shared library, loaded at run time: nothing of it is needed to build, and nothing of
/// it is in the package.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace haptic::tools {

/// Owner: one thread. A library that is loaded stays for the life of the process: it may have
/// threads of its own, which code that is gone would bring down.
class VendorLibrary {
 public:
  /// Loads the file at `path`; where that is empty, the first of `names` that the loader finds.
  /// @return false: `why` has each name that was tried, the loader's reason, and that the key
  /// `library` of the configuration names the file.
  [[nodiscard]] bool load(const std::string& path, std::span<const std::string_view> names,
                          std::string& why);

  /// Fills `function` by the name of C; one that is not there is counted among the missing.
  template <class Function>
  void bind(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(symbol(name));
    if (function == nullptr) missing_.emplace_back(name);
  }
  /// The same; null where it is not there.
  template <class Function>
  void bind_optional(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(symbol(name));
  }

  /// The functions that were bound and are not there, with what that means; empty: none.
  [[nodiscard]] std::string defect() const;
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  [[nodiscard]] void* symbol(const char* name) const noexcept;

  void* handle_ = nullptr;
  std::string file_;  ///< as it was asked for
  std::vector<std::string> missing_;
};

}  // namespace haptic::tools
