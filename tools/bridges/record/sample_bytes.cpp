// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/record/sample_bytes.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

namespace haptic::tools {
namespace {

template <std::size_t count>
class Writer {
 public:
  void add(std::uint64_t word) noexcept {
    std::memcpy(bytes_.data() + at_, &word, sizeof word);
    at_ += sizeof word;
  }
  template <typename Number, std::size_t size>
  void add(const Number (&numbers)[size]) noexcept {
    for (const Number number : numbers) add(std::bit_cast<std::uint64_t>(double{number}));
  }
  [[nodiscard]] const std::array<std::byte, count>& bytes() const noexcept { return bytes_; }

 private:
  std::array<std::byte, count> bytes_{};
  std::size_t at_ = 0;
};

}  // namespace

SampleBytes bytes_of(const hal::BridgeSample& sample) noexcept {
  Writer<kSampleBytes> out;
  const TwistRecord twist = sample.twist_valid ? sample.twist_d : TwistRecord{};
  out.add(static_cast<std::uint64_t>(sample.sampled_ns));
  out.add(sample.pose_dh.p_m);
  out.add(sample.pose_dh.q_xyzw);
  out.add(twist.linear_m_per_s);
  out.add(twist.angular_rad_per_s);
  out.add((sample.twist_valid ? 1u : 0u) | (sample.calibrated ? 2u : 0u) |
          (sample.emergency_stop ? 4u : 0u));
  out.add(sample.switches);
  out.add(sample.faults);
  return out.bytes();
}

WrenchBytes bytes_of(const Wrench& wrench) noexcept {
  Writer<kWrenchBytes> out;
  for (const Vec3* const each : {&wrench.force_w, &wrench.torque_w}) {
    const double numbers[3] = {static_cast<double>(each->x()), static_cast<double>(each->y()),
                               static_cast<double>(each->z())};
    out.add(numbers);
  }
  return out.bytes();
}

Wrench wrench_of_bytes(std::span<const std::byte> bytes) noexcept {
  double n[6] = {};
  std::memcpy(n, bytes.data(), std::min(bytes.size(), sizeof n));
  const auto real = [&](int k) { return static_cast<Real>(n[k]); };
  return {Vec3(real(0), real(1), real(2)), Vec3(real(3), real(4), real(5))};
}

}  // namespace haptic::tools
