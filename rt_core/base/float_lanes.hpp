// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Eight numbers of single precision at a time. Only arithmetic element by element, smallest and
/// largest: no instruction set changes a bit of the result. No product is joined with a sum.

#include <bit>
#include <cstdint>
#include <cstring>

namespace haptic {

inline constexpr std::uint32_t kFloatLanes = 8;

/// One after the other, on any machine.
namespace each_lane {

struct FloatLanes {
  float x[kFloatLanes];
};
/// `from`: aligned to 16 bytes.
inline FloatLanes load_floats(const float* from) noexcept {
  FloatLanes out;
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) out.x[k] = from[k];
  return out;
}
inline void store_floats(const FloatLanes& x, float* to) noexcept {
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) to[k] = x.x[k];
}
template <typename Of>
inline FloatLanes lane_by_lane(const Of& of) noexcept {
  FloatLanes out;
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) out.x[k] = of(k);
  return out;
}
inline FloatLanes all_lanes(float x) noexcept {
  return lane_by_lane([&](std::uint32_t) { return x; });
}
inline FloatLanes operator+(const FloatLanes& l, const FloatLanes& r) noexcept {
  return lane_by_lane([&](std::uint32_t k) { return l.x[k] + r.x[k]; });
}
inline FloatLanes operator-(const FloatLanes& l, const FloatLanes& r) noexcept {
  return lane_by_lane([&](std::uint32_t k) { return l.x[k] - r.x[k]; });
}
inline FloatLanes operator*(const FloatLanes& l, const FloatLanes& r) noexcept {
  return lane_by_lane([&](std::uint32_t k) { return l.x[k] * r.x[k]; });
}
/// l < r ? l : r, in each lane.
inline FloatLanes smaller(const FloatLanes& l, const FloatLanes& r) noexcept {
  return lane_by_lane([&](std::uint32_t k) { return l.x[k] < r.x[k] ? l.x[k] : r.x[k]; });
}
inline FloatLanes larger(const FloatLanes& l, const FloatLanes& r) noexcept {
  return lane_by_lane([&](std::uint32_t k) { return l.x[k] > r.x[k] ? l.x[k] : r.x[k]; });
}
/// A bit for each lane, the first one lowest: whether l < r.
inline std::uint32_t lanes_below(const FloatLanes& l, const FloatLanes& r) noexcept {
  std::uint32_t bits = 0;
  for (std::uint32_t k = 0; k < kFloatLanes; ++k) bits |= (l.x[k] < r.x[k] ? 1u : 0u) << k;
  return bits;
}
/// Lane by lane `x` where l < r, else `other`.
inline FloatLanes where_below(const FloatLanes& l, const FloatLanes& r, const FloatLanes& x,
                              const FloatLanes& other) noexcept {
  return lane_by_lane([&](std::uint32_t k) { return l.x[k] < r.x[k] ? x.x[k] : other.x[k]; });
}

}  // namespace each_lane

#if defined(__SSE2__) || defined(__wasm_simd128__)

/// In registers of four.
namespace four_lanes {

using Four = float __attribute__((vector_size(16)));
struct FloatLanes {
  Four low, high;
};
inline FloatLanes load_floats(const float* from) noexcept {
  FloatLanes out;
  std::memcpy(&out, from, sizeof out);
  return out;
}
inline void store_floats(const FloatLanes& x, float* to) noexcept { std::memcpy(to, &x, sizeof x); }
inline FloatLanes all_lanes(float x) noexcept { return {Four{x, x, x, x}, Four{x, x, x, x}}; }
inline FloatLanes operator+(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {l.low + r.low, l.high + r.high};
}
inline FloatLanes operator-(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {l.low - r.low, l.high - r.high};
}
inline FloatLanes operator*(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {l.low * r.low, l.high * r.high};
}
#if defined(__SSE2__)
inline Four smaller_of(const Four& l, const Four& r) noexcept { return __builtin_ia32_minps(l, r); }
inline Four larger_of(const Four& l, const Four& r) noexcept { return __builtin_ia32_maxps(l, r); }
inline int signs_of(const Four& x) noexcept { return __builtin_ia32_movmskps(x); }
#else  // WebAssembly's take the second where it is smaller, larger
inline Four smaller_of(const Four& l, const Four& r) noexcept {
  return __builtin_wasm_pmin_f32x4(r, l);
}
inline Four larger_of(const Four& l, const Four& r) noexcept {
  return __builtin_wasm_pmax_f32x4(r, l);
}
inline int signs_of(const Four& x) noexcept {
  using Words = int __attribute__((vector_size(16)));
  return static_cast<int>(__builtin_wasm_bitmask_i32x4(std::bit_cast<Words>(x)));
}
#endif
inline FloatLanes smaller(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {smaller_of(l.low, r.low), smaller_of(l.high, r.high)};
}
inline FloatLanes larger(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {larger_of(l.low, r.low), larger_of(l.high, r.high)};
}
inline std::uint32_t lanes_below(const FloatLanes& l, const FloatLanes& r) noexcept {
  const auto bits = [](const auto& below) {
    return static_cast<std::uint32_t>(signs_of(std::bit_cast<Four>(below)));
  };
  return bits(l.low < r.low) | bits(l.high < r.high) << 4;
}
inline FloatLanes where_below(const FloatLanes& l, const FloatLanes& r, const FloatLanes& x,
                              const FloatLanes& other) noexcept {
  return {l.low < r.low ? x.low : other.low, l.high < r.high ? x.high : other.high};
}

}  // namespace four_lanes

#endif

#if defined(__x86_64__)

/// In one register, for what is compiled for AVX2 (base/wide_lanes.hpp says who may call that).
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
namespace eight_lanes {

using Eight = float __attribute__((vector_size(32)));
struct FloatLanes {
  Eight all;
};
inline FloatLanes load_floats(const float* from) noexcept {
  FloatLanes out;
  std::memcpy(&out, from, sizeof out);
  return out;
}
inline void store_floats(const FloatLanes& x, float* to) noexcept { std::memcpy(to, &x, sizeof x); }
inline FloatLanes all_lanes(float x) noexcept { return {Eight{x, x, x, x, x, x, x, x}}; }
inline FloatLanes operator+(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {l.all + r.all};
}
inline FloatLanes operator-(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {l.all - r.all};
}
inline FloatLanes operator*(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {l.all * r.all};
}
inline FloatLanes smaller(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {__builtin_ia32_minps256(l.all, r.all)};
}
inline FloatLanes larger(const FloatLanes& l, const FloatLanes& r) noexcept {
  return {__builtin_ia32_maxps256(l.all, r.all)};
}
inline std::uint32_t lanes_below(const FloatLanes& l, const FloatLanes& r) noexcept {
  const auto below = l.all < r.all;
  Eight bits;
  std::memcpy(&bits, &below, sizeof bits);
  return static_cast<std::uint32_t>(__builtin_ia32_movmskps256(bits));
}
inline FloatLanes where_below(const FloatLanes& l, const FloatLanes& r, const FloatLanes& x,
                              const FloatLanes& other) noexcept {
  return {l.all < r.all ? x.all : other.all};
}

}  // namespace eight_lanes
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif

#if defined(__SSE2__) || defined(__wasm_simd128__)
using namespace four_lanes;
#else
using namespace each_lane;
#endif

/// The smallest of all lanes.
inline float least_lane(const FloatLanes& x) noexcept {
  alignas(16) float each[kFloatLanes];
  store_floats(x, each);
  float least = each[0];
  for (std::uint32_t k = 1; k < kFloatLanes; ++k) least = each[k] < least ? each[k] : least;
  return least;
}

/// Single precision, rounded down or up by enough: for bounds.
inline constexpr float kFloatRound = 1.2e-7f;  // a unit in the last place of a number
template <typename T>
inline float rounded_down(T x) noexcept {
  const float f = static_cast<float>(x);
  return f - (f < 0 ? -f : f) * kFloatRound;
}
template <typename T>
inline float rounded_up(T x) noexcept {
  const float f = static_cast<float>(x);
  return f + (f < 0 ? -f : f) * kFloatRound;
}

}  // namespace haptic
