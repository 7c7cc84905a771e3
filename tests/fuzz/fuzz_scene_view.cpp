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

/// Poses about the scene's start: apart, touching, deep, turned, and two that must be refused.
haptic::StepInput input_of(const haptic::SceneParameters& p, unsigned tick) {
  haptic::StepInput input;
  const auto real = [](double x) { return static_cast<haptic::Real>(x); };
  const double shift = tick == 0 ? 0.0 : 0.02 * (tick - 4.0);
  input.pose_wa.p_wa = haptic::Vec3(real(p.start_p_wa_m[0]), real(p.start_p_wa_m[1] + shift),
                                    real(p.start_p_wa_m[2] - 3.0 * shift));
  const double half = 0.3 * tick;
  const bool turned = tick % 3 == 2;
  const double* q = p.start_q_wa_xyzw;
  input.pose_wa.q_wa = turned ? haptic::Quat(real(std::cos(half)), real(0.6 * std::sin(half)),
                                             real(0.0), real(0.8 * std::sin(half)))
                              : haptic::Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2]));
  if (tick == 7) {
    input.pose_wa.p_wa[1] = std::nan("");
  } else if (tick == 8) {
    input.pose_wa.q_wa.w() = real(2.0);
  }
  return input;
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
  const haptic::SceneCapacity& capacity = scene.header().capacity;
  for (unsigned tick = 0; tick < 12; ++tick) {
    const haptic::StepResult result = core->step(input_of(scene.parameters(), tick));
    const haptic::StepCounters& c = result.counters;
    require(c.pair_visits <= capacity.max_pair_visits, "pairs searched per tick");
    require(c.support_pairs <= capacity.max_support_pairs, "support pairs per tick");
    require(c.feature_evaluations <= capacity.max_feature_evaluations, "features per tick");
    require(c.edge_pairs <= capacity.max_edge_pairs, "edge pairs per tick");
    require(c.near_nodes <= capacity.max_near_nodes, "near nodes per tick");
    require(c.hull_points <= capacity.max_hull_points, "points of a contact polygon");
    require(c.node_pairs <= capacity.max_node_pairs, "pairs of near nodes compared");
    require(c.proxy_passes <= capacity.max_proxy_passes, "passes of the proxy");
    require(c.proxy_rounds <= capacity.max_proxy_rounds, "rounds of one pass");
    require(c.proxy_rows <= capacity.max_qp_rows, "rows of one quadratic program");
    require(c.qp_steps <= capacity.max_qp_steps, "iterations of all quadratic programs");
    require(c.search_work <= capacity.max_search_work, "work of searches without history");
    const haptic::Wrench& w = result.wrench_w;
    bool finite = std::isfinite(static_cast<double>(result.d_near_m));
    for (int i = 0; i < 3; ++i) {
      finite = finite && std::isfinite(static_cast<double>(w.force_w[i])) &&
               std::isfinite(static_cast<double>(w.torque_w[i]));
    }
    require(finite, "force and torque are finite");
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
