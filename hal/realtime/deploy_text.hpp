// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The files of deploy/ inside the program, as they were when it was built: what an installed
/// program can print without its sources.

#include <span>
#include <string_view>

namespace haptic::hal {

/// One file: where it goes is said in its first lines.
struct DeployFile {
  std::string_view name;  ///< "60-haptic.rules"
  std::string_view text;  ///< byte for byte
};

[[nodiscard]] std::span<const DeployFile> deploy_files() noexcept;

/// The text of one; empty for a name that is none of theirs.
[[nodiscard]] std::string_view deploy_text(std::string_view name) noexcept;

}  // namespace haptic::hal
