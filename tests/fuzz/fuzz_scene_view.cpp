// SPDX-License-Identifier: Apache-2.0
/// Any bytes as a compiled scene: refused, or good for a core whose ticks stay within memory and
/// within the bounds that the header states. Length and hash are corrected first, or hardly any
/// mutation would reach the checks behind them.
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>

#include "rt_core/haptic_core.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace {

using haptic::fuzz::require;

struct FreeAligned {
  void operator()(std::byte* p) const {
    ::operator delete (p, std::align_val_t{haptic::kSceneAlignment});
  }
};
using AlignedBytes = std::unique_ptr<std::byte[], FreeAligned>;

/// Exactly `size` bytes, so that the sanitizer sees the first access beyond them.
AlignedBytes aligned_bytes(std::size_t size) {
  return AlignedBytes(
      static_cast<std::byte*>(::operator new (size, std::align_val_t{haptic::kSceneAlignment})));
}

void correct_header(std::byte* blob, std::size_t size) {
  if (size < sizeof(haptic::SceneHeader)) {
    return;
  }
  haptic::SceneHeader header;
  std::memcpy(&header, blob, sizeof header);
  std::memcpy(header.magic, haptic::kSceneMagic, sizeof header.magic);
  header.version = haptic::kSceneVersion;
  header.byte_count = size;
  header.content_hash = 0;
  std::memcpy(blob, &header, sizeof header);
  header.content_hash = haptic::scene_content_hash({blob, size});
  std::memcpy(blob, &header, sizeof header);
}

haptic::Real real(double x) { return static_cast<haptic::Real>(x); }

/// The scene's start, moved along y and z by shares of the part's radius.
haptic::StepInput beside_start(const haptic::SceneView& scene, double share_y, double share_z) {
  const haptic::SceneParameters& p = scene.parameters();
  const double radius_m = scene.piece(0).record->radius_m;
  const double* q = p.start_q_wa_xyzw;
  haptic::StepInput input;
  input.pose_wa.p_wa =
      haptic::Vec3(real(p.start_p_wa_m[0]), real(p.start_p_wa_m[1] + share_y * radius_m),
                   real(p.start_p_wa_m[2] + share_z * radius_m));
  input.pose_wa.q_wa = haptic::Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2]));
  return input;
}

/// From the start down and aside so slowly that a proxy keeps up and is pressed on what is below.
constexpr unsigned kPressedTicks = 20;
haptic::StepInput pressed(const haptic::SceneView& scene, unsigned tick) {
  return beside_start(scene, 0.02 * tick, -0.1 * tick);
}

/// Leaps about the start: apart, touching, deep, turned, and two that must be refused.
constexpr unsigned kLeaps = 12;
haptic::StepInput leap(const haptic::SceneView& scene, unsigned tick) {
  const double share = tick == 0 ? 0.0 : 0.3 * (tick - 4.0);
  haptic::StepInput input = beside_start(scene, share, -3.0 * share);
  const double half = 0.3 * tick;
  if (tick % 3 == 2) {
    input.pose_wa.q_wa = haptic::Quat(real(std::cos(half)), real(0.6 * std::sin(half)), real(0.0),
                                      real(0.8 * std::sin(half)));
  }
  if (tick == 7) {
    input.pose_wa.p_wa[1] = std::nan("");
  } else if (tick == 8) {
    input.pose_wa.q_wa.w() = real(2.0);
  }
  return input;
}

struct Bound {
  const char* what;
  std::uint32_t haptic::StepCounters::*counter;
  std::uint32_t haptic::SceneCapacity::*most;
};
using Done = haptic::StepCounters;
using Most = haptic::SceneCapacity;
constexpr Bound kBounds[] = {
    {"pairs searched per tick", &Done::pair_visits, &Most::max_pair_visits},
    {"support pairs per tick", &Done::support_pairs, &Most::max_support_pairs},
    {"features per tick", &Done::feature_evaluations, &Most::max_feature_evaluations},
    {"edge pairs per tick", &Done::edge_pairs, &Most::max_edge_pairs},
    {"near nodes per tick", &Done::near_nodes, &Most::max_near_nodes},
    {"points of a contact polygon", &Done::hull_points, &Most::max_hull_points},
    {"pairs of near nodes compared", &Done::node_pairs, &Most::max_node_pairs},
    {"gaps along planes per tick", &Done::plane_gaps, &Most::max_plane_gaps},
    {"nodes of valid sets per tick", &Done::valid_nodes, &Most::max_valid_nodes},
    {"searches without history", &Done::full_searches, &Most::max_full_searches},
    {"work of searches without history", &Done::search_work, &Most::max_search_work},
    {"passes of the proxy", &Done::proxy_passes, &Most::max_proxy_passes},
    {"rejected passes", &Done::proxy_rejected, &Most::max_proxy_rejected},
    {"rounds of one pass", &Done::proxy_rounds, &Most::max_proxy_rounds},
    {"rows of one quadratic program", &Done::proxy_rows, &Most::max_qp_rows},
    {"iterations of one quadratic program", &Done::qp_iterations, &Most::max_qp_iterations},
    {"quadratic programs", &Done::qp_programs, &Most::max_qp_programs},
    {"iterations of all quadratic programs", &Done::qp_steps, &Most::max_qp_steps}};

void check_tick(const haptic::SceneView& scene, const haptic::StepResult& result) {
  for (const Bound& bound : kBounds) {
    require(result.counters.*bound.counter <= scene.header().capacity.*bound.most, bound.what);
  }
  const haptic::Wrench& w = result.wrench_w;
  bool finite = std::isfinite(static_cast<double>(result.d_near_m));
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(static_cast<double>(w.force_w[i])) &&
             std::isfinite(static_cast<double>(w.torque_w[i]));
  }
  require(finite, "force and torque are finite");
}

void run_core(const haptic::SceneView& scene) {
  const std::size_t size = haptic::HapticCore::state_bytes(scene);
  require(size <= (std::size_t{1} << 28), "the memory of a core follows from the scene's size");
  const AlignedBytes memory = aligned_bytes(size);
  haptic::HapticCore* core = nullptr;
  const haptic::RtStatus created = haptic::HapticCore::create({memory.get(), size}, scene, core);
  require((created == haptic::RtStatus::kOk) == (core != nullptr), "a core exists if created");
  if (core == nullptr) {
    return;
  }
  for (unsigned tick = 0; tick < kPressedTicks; ++tick) {
    check_tick(scene, core->step(pressed(scene, tick)));
  }
  for (unsigned tick = 0; tick < kLeaps; ++tick) {
    check_tick(scene, core->step(leap(scene, tick)));
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const AlignedBytes blob = aligned_bytes(size == 0 ? 1 : size);
  std::memcpy(blob.get(), data, size);
  for (const bool corrected : {false, true}) {
    if (corrected) {
      correct_header(blob.get(), size);
    }
    haptic::SceneView scene;
    if (haptic::SceneView::open({blob.get(), size}, scene) == haptic::RtStatus::kOk) {
      run_core(scene);
    }
  }
  return 0;
}
