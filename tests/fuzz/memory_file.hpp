// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A file in memory, for readers that take a path: its text is another in each run.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "tools/common/file_roles.hpp"

namespace haptic::fuzz {

class MemoryFile {
 public:
  MemoryFile() : file_(::memfd_create("fuzz", 0)), path_("/proc/self/fd/" + std::to_string(file_)) {
    if (file_ < 0) std::abort();
  }
  ~MemoryFile() { ::close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }

  /// Also forgets which files earlier runs read and wrote.
  void set(std::string_view text) {
    tools::forget_file_roles();
    const bool whole = ::ftruncate(file_, 0) == 0 && ::pwrite(file_, text.data(), text.size(), 0) ==
                                                         static_cast<ssize_t>(text.size());
    if (!whole) std::abort();
  }

 private:
  int file_;
  std::string path_;
};

/// True where `text` is "PATH: ..." or, with `numbers` of them after it, "PATH:1:2: ...".
inline bool names_place(std::string_view text, const std::string& path, int numbers) {
  if (!text.starts_with(path)) return false;
  text.remove_prefix(path.size());
  for (int i = 0; i < numbers; ++i) {
    if (!text.starts_with(":")) return false;
    text.remove_prefix(1);
    const std::size_t end = text.find_first_not_of("0123456789");
    if (end == 0 || end == std::string_view::npos || text.front() == '0') return false;
    text.remove_prefix(end);
  }
  return text.starts_with(": ") && text.size() > 2;
}

}  // namespace haptic::fuzz
