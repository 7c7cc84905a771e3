// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/sha256.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <system_error>

namespace haptic::hal {
namespace {

// FIPS 180-4, 4.2.2: fractional parts of the cube roots of the first 64 primes.
constexpr std::array<std::uint32_t, 64> kRoundConstants = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

std::uint32_t big_endian(const std::uint8_t* bytes) noexcept {
  return std::uint32_t{bytes[0]} << 24U | std::uint32_t{bytes[1]} << 16U |
         std::uint32_t{bytes[2]} << 8U | std::uint32_t{bytes[3]};
}

}  // namespace

// FIPS 180-4, 6.2.2.
void Sha256::take_block(const std::uint8_t* block) noexcept {
  std::array<std::uint32_t, 64> w{};
  for (std::size_t t = 0; t < 16; ++t) w[t] = big_endian(block + 4 * t);
  for (std::size_t t = 16; t < w.size(); ++t) {
    const std::uint32_t a = w[t - 15], b = w[t - 2];
    w[t] = (std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10U)) + w[t - 7] +
           (std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3U)) + w[t - 16];
  }
  std::array<std::uint32_t, 8> s = state_;
  for (std::size_t t = 0; t < w.size(); ++t) {
    const std::uint32_t sum1 = std::rotr(s[4], 6) ^ std::rotr(s[4], 11) ^ std::rotr(s[4], 25);
    const std::uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]);
    const std::uint32_t first = s[7] + sum1 + choice + kRoundConstants[t] + w[t];
    const std::uint32_t sum0 = std::rotr(s[0], 2) ^ std::rotr(s[0], 13) ^ std::rotr(s[0], 22);
    const std::uint32_t majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
    std::rotate(s.begin(), s.end() - 1, s.end());
    s[4] += first;
    s[0] = first + sum0 + majority;
  }
  for (std::size_t k = 0; k < s.size(); ++k) state_[k] += s[k];
}

void Sha256::add(std::span<const std::uint8_t> bytes) noexcept {
  while (!bytes.empty()) {
    const std::size_t filled = bytes_ % kBlockBytes;
    const std::size_t taken = std::min(bytes.size(), kBlockBytes - filled);
    std::copy_n(bytes.begin(), taken, block_.begin() + static_cast<std::ptrdiff_t>(filled));
    bytes_ += taken;
    bytes = bytes.subspan(taken);
    if (bytes_ % kBlockBytes == 0) take_block(block_.data());
  }
}

Sha256Digest Sha256::finish() noexcept {
  const std::uint64_t bits = 8 * bytes_;
  const std::size_t filled = bytes_ % kBlockBytes;
  const std::size_t to_length = (filled < kBlockBytes - 8 ? kBlockBytes : 2 * kBlockBytes) - 8;
  std::array<std::uint8_t, 2 * kBlockBytes> padding{};
  padding[0] = 0x80;
  const std::size_t zeros = to_length - filled;
  for (std::size_t k = 0; k < 8; ++k)
    padding[zeros + k] = static_cast<std::uint8_t>(bits >> (56 - 8 * k));
  add(std::span(padding).first(zeros + 8));
  Sha256Digest digest{};
  for (std::size_t k = 0; k < digest.size(); ++k)
    digest[k] = static_cast<std::uint8_t>(state_[k / 4] >> (24 - 8 * (k % 4)));
  return digest;
}

bool parse_sha256(std::string_view text, Sha256Digest& digest) noexcept {
  Sha256Digest parsed{};
  if (text.size() != 2 * parsed.size()) return false;
  for (std::size_t k = 0; k < parsed.size(); ++k) {
    const char* begin = text.data() + 2 * k;
    const auto result = std::from_chars(begin, begin + 2, parsed[k], 16);
    if (result.ec != std::errc{} || result.ptr != begin + 2) return false;
  }
  digest = parsed;
  return true;
}

}  // namespace haptic::hal
