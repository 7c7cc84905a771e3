// SPDX-License-Identifier: Apache-2.0
#pragma once
/// SHA-256 (FIPS 180-4), for checking that a firmware image is one that is known. Not for secrets:
/// comparisons take as long as they take.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace haptic::hal {

using Sha256Digest = std::array<std::uint8_t, 32>;

/// Owner: one thread. No heap.
class Sha256 {
 public:
  void add(std::span<const std::uint8_t> bytes) noexcept;
  /// Hash of all that was added; nothing may be added after it.
  [[nodiscard]] Sha256Digest finish() noexcept;

 private:
  static constexpr std::size_t kBlockBytes = 64;
  void take_block(const std::uint8_t* block) noexcept;

  std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                         0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, kBlockBytes> block_{};
  std::uint64_t bytes_ = 0;
};

/// 64 hexadecimal digits. False: `text` is something else.
[[nodiscard]] bool parse_sha256(std::string_view text, Sha256Digest& digest) noexcept;

}  // namespace haptic::hal
