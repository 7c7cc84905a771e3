// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/vendor/vendor_library.hpp"

#include <dlfcn.h>

#include <filesystem>

namespace haptic::tools {
namespace {

// All symbols at once: a library whose own dependencies are missing is refused here, not at the
// first call with force on. Local: its names stay its own.
constexpr int kHow = RTLD_NOW | RTLD_LOCAL;

std::string loader_reason() {
  const char* const reason = dlerror();
  return reason != nullptr ? reason : "the loader gives no reason";
}

}  // namespace

bool VendorLibrary::load(const std::string& path, std::span<const std::string_view> names,
                         std::string& why) {
  missing_.clear();
  if (!path.empty()) {
    // A name without a slash would be looked for elsewhere.
    std::error_code error;
    const std::filesystem::path absolute = std::filesystem::absolute(path, error);
    file_ = error ? path : absolute.string();
    handle_ = dlopen(file_.c_str(), kHow);
    if (handle_ == nullptr)
      why = "the library cannot be loaded: " + loader_reason() +
            "; check the key library, and by ldd that all that it needs is there";
    return handle_ != nullptr;
  }
  std::string tried, other;
  for (const std::string_view name : names) {
    file_ = name;
    handle_ = dlopen(file_.c_str(), kHow);
    if (handle_ != nullptr) return true;
    tried += (tried.empty() ? "" : ", ") + file_;
    // A library that is there, and lacks one of its own, is named by the loader's reason.
    const std::string reason = loader_reason();
    if (!reason.starts_with(file_ + ": cannot open shared object file")) other += "; " + reason;
  }
  why = "the vendor's library is not there (none of " + tried + " can be loaded" + other +
        "): install it, or name the file by the key library";
  return false;
}

std::string VendorLibrary::defect() const {
  if (missing_.empty()) return {};
  std::string names;
  for (const std::string& name : missing_) names += (names.empty() ? "" : ", ") + name;
  return file_ + " has no " + names +
         ": it is another library or another version of it; install the one that README.md of "
         "tools/bridges names";
}

void* VendorLibrary::symbol(const char* name) const noexcept {
  return handle_ != nullptr ? dlsym(handle_, name) : nullptr;
}

}  // namespace haptic::tools
