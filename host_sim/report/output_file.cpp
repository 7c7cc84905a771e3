// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/output_file.hpp"

#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "tools/common/error.hpp"

namespace haptic::sim {

void write_whole_file(const std::string& path, std::string_view content) {
  require_writable_folder(path);
  const std::string beside = path + ".part" + std::to_string(::getpid());
  std::FILE* file = std::fopen(beside.c_str(), "wb");
  bool good = file != nullptr;
  if (good) {
    good = std::fwrite(content.data(), 1, content.size(), file) == content.size();
    good = std::fclose(file) == 0 && good;
  }
  std::error_code error;
  if (good) {
    std::filesystem::rename(beside, path, error);
    good = !error;
  }
  if (good) return;
  std::filesystem::remove(beside, error);
  throw tools::InputError(path + ": cannot be written; check the folder, the space and the rights");
}

void append_number(std::string& text, double value) {
  char buffer[40];
  const auto end =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 17);
  text.append(buffer, end.ptr);
}

void require_writable_folder(const std::string& path) {
  const std::filesystem::path target(path);
  const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    throw tools::InputError(path + ": the folder '" + folder.string() +
                            "' does not exist; make it first");
  }
  if (std::filesystem::is_directory(target, error)) {
    throw tools::InputError(path + ": is a folder; name a file");
  }
}

}  // namespace haptic::sim
