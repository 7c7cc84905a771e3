// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/output_folder.hpp"

#include <filesystem>
#include <system_error>

#include "host_sim/report/output_file.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

void make_output_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path)) {
    throw tools::InputError(path + ": the folder cannot be made" +
                            (error ? ": " + error.message() : "") + "; name another");
  }
  require_writable_folder(path + "/any");
}

}  // namespace haptic::sim
