// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/lane_kernels.hpp"

#include <algorithm>
#include <bit>

namespace haptic {
namespace any_processor {

#if defined(__SSE2__) || defined(__wasm_simd128__)
using four_lanes::all_lanes;
using four_lanes::FloatLanes;
using four_lanes::lanes_below;
using four_lanes::larger;
using four_lanes::load_floats;
using four_lanes::smaller;
using four_lanes::store_floats;
using four_lanes::where_below;
#else
using each_lane::all_lanes;
using each_lane::FloatLanes;
using each_lane::lanes_below;
using each_lane::larger;
using each_lane::load_floats;
using each_lane::smaller;
using each_lane::store_floats;
using each_lane::where_below;
#endif
#include "rt_core/proxy/lane_kernels.inc"

}  // namespace any_processor

#if defined(__x86_64__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
namespace with_avx2 {

using eight_lanes::all_lanes;
using eight_lanes::FloatLanes;
using eight_lanes::lanes_below;
using eight_lanes::larger;
using eight_lanes::load_floats;
using eight_lanes::smaller;
using eight_lanes::store_floats;
using eight_lanes::where_below;
#include "rt_core/proxy/lane_kernels.inc"

}  // namespace with_avx2
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

}  // namespace haptic
