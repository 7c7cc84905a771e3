// SPDX-License-Identifier: Apache-2.0
// Every bit of a compiled scene matters: a flip is refused, or something that is counted changes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "rt_core/haptic_core.hpp"
#include "tests/support/shapes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/scene_facts/facts_text.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// Bodies in general position: no coordinate and no component of a normal is zero (a flipped low
/// exponent bit of a zero is still zero for every purpose), and no vertex of a face is as far from
/// an edge as another (either may be the edge's apex).
tools::SceneDescription general_scene() {
  const tools::Body moving = tetrahedron({0.011, 0.007, 0.003}, {0.113, 0.017, -0.009},
                                         {0.029, 0.097, 0.013}, {0.037, 0.041, 0.127});
  // Base at z = 0; a negative height mirrors it, so its loops turn round.
  const auto pyramid = [](double height, double side) {
    std::vector<std::vector<std::uint32_t>> faces{
        {0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    if (height < 0) {
      for (auto& loop : faces) std::reverse(loop.begin(), loop.end());
    }
    return convex_body({{-0.1, -0.09, 0.0},
                        {0.11, -0.1, 0.0},
                        {0.12, 0.1 + side, 0.0},
                        {-0.13, 0.08, 0.0},
                        {0.02, 0.01, height}},
                       faces);
  };
  tools::SceneDescription scene =
      scene_of(moving, {join({pyramid(0.1, 0.0), pyramid(-0.07, 0.02)}), pyramid(0.05, 0.011)});
  scene.name = "general position";
  scene.statics[0].position_m = {0.31, -0.17, 0.23};
  scene.statics[0].quaternion_wxyz = {0.5, 0.1, 0.7, std::sqrt(0.25)};
  scene.statics[1].position_m = {-0.053, 0.071, 0.019};
  scene.statics[1].quaternion_wxyz = {0.1, 0.3, 0.3, 0.9};
  scene.grip_m = {0.047, 0.053, 0.061};
  scene.moving.position_m = {0.3, 0.2, 0.1};
  scene.moving.quaternion_wxyz = {0.1, 0.5, 0.7, 0.5};
  scene.parameters.exact_band_m = 0.37;
  scene.parameters.motion_limits_given = 1;
  scene.parameters.max_linear_speed_m_per_s = 0.7;
  scene.parameters.max_angular_speed_rad_per_s = 5.0;
  scene.parameters.device = {0.1,
                             1.5,
                             0.2,
                             1e-5,
                             {1.1e-4, 1.3e-4, 1.7e-4},
                             {1e-3, 2e-3, 3e-3},
                             0.01,
                             1e-4,
                             9.0,
                             0.7,
                             1e3,
                             50.0,
                             2e3,
                             3.0,
                             1.9,
                             0.001,
                             1,
                             0};
  scene.parameters.coupling = {900.0, 0.7, 0.9,  0.45, 0.31, 0.011, 0.0015, 0.025,
                               9.0,   0.7, 3e-7, 4e-6, 4,    0,     1,      0};
  scene.parameters.held.mass_kg = 0.37;
  scene.parameters.held.gravity_m_per_s2[2] = -9.81;
  scene.statics[0].friction = 0.3;
  scene.statics[0].friction_static = 0.4;
  scene.statics[1].friction = 0.17;
  scene.statics[1].simplified = {3.1e-4, -2.7e-8};
  return scene;
}

tools::SceneBytes with_hash(tools::SceneBytes bytes) {
  const std::uint64_t hash = scene_content_hash(bytes.span());
  std::memcpy(bytes.span().data() + offsetof(SceneHeader, content_hash), &hash, sizeof hash);
  return bytes;
}

template <typename T>
void append_bits(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// All that is counted: what scene_inspect reports (without the hash) and the results of a short
/// motion, to the bit. Empty when the scene is refused.
std::string signature(const tools::SceneBytes& bytes) {
  SceneView view;
  if (SceneView::open(bytes.span(), view) != RtStatus::kOk) return "";
  // A damaged size of the state must not make the test allocate it.
  if (HapticCore::state_bytes(view) != view.header().capacity.state_bytes) return "";
  tools::SceneBytes memory(HapticCore::state_bytes(view));
  HapticCore* core = nullptr;
  if (HapticCore::create(memory.span(), view, core) != RtStatus::kOk) return "";
  nlohmann::ordered_json facts = tools::facts_as_json(tools::facts_of(view));
  facts.erase("content_hash");
  std::string result = facts.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  for (int k = 0; k < 120; ++k) {
    const double t = k / 119.0;
    // From apart into and through both statics, turning about a general axis.
    StepInput input;
    input.pose_wa.p_wa = {static_cast<Real>(0.34 - 0.5 * t), static_cast<Real>(-0.25 + 0.4 * t),
                          static_cast<Real>(0.3 - 0.4 * t)};
    const double angle = 0.4 + 2.0 * t;
    const double s = std::sin(angle / 2);
    input.pose_wa.q_wa = Quat(static_cast<Real>(std::cos(angle / 2)), static_cast<Real>(0.36 * s),
                              static_cast<Real>(0.48 * s), static_cast<Real>(0.8 * s));
    const StepResult r = core->step(input);
    for (int i = 0; i < 3; ++i) {
      append_bits(result, r.wrench_w.force_w[i]);
      append_bits(result, r.wrench_w.torque_w[i]);
    }
    append_bits(result, r.d_near_m);
    append_bits(result, r.near_count);
    for (std::uint32_t pair = 0; pair < core->pair_count(); ++pair) {
      const PairReport report = core->pair_report(pair);
      append_bits(result, report.d_near_m);
      for (const NearNode& n : report.near) append_bits(result, n.node);
    }
  }
  return result;
}

struct Tally {
  std::size_t refused = 0, changed = 0, unchanged = 0;
};

struct Region {
  std::string name;
  std::size_t begin = 0, bytes = 0, element_bytes = 1;
};

std::vector<Region> regions_of(const SceneView& view) {
  std::vector<Region> regions{{"header", 0, sizeof(SceneHeader), 8},
                              {"table of sections", sizeof(SceneHeader),
                               view.sections().size_bytes(), sizeof(SectionEntry)}};
  for (const SectionEntry& s : view.sections()) {
    regions.push_back({tools::section_name(s.id), static_cast<std::size_t>(s.offset),
                       static_cast<std::size_t>(s.count * s.element_bytes), s.element_bytes});
  }
  return regions;
}

/// Bytes of an element of a record section that belong to a floating-point number of `width` bytes.
struct NumberField {
  std::size_t offset, width, count;
};
std::vector<NumberField> numbers_in(const std::string& section) {
  constexpr std::size_t kReal = sizeof(Real);
  if (section == "planes" || section == "edge directions") return {{0, kReal, 4}};
  if (section == "vertices") return {{0, kReal, 3}};
  if (section == "bodies") return {{0, 8, 5}};
  if (section == "pieces") return {{offsetof(PieceRecord, volume_m3), 8, 8}};
  if (section == "edge arcs") return {{0, kReal, 14}};
  return {};
}

/// True for a mantissa bit below the top eight: such a flip may be lost in rounding. Centres of
/// pieces are kept in double but, in single precision, known to 256 roundings of the largest
/// coordinate only, of which a component of a centre may be a small share: top five.
bool is_low_bit(const Region& region, std::size_t byte, unsigned bit) {
  const std::size_t in_element = (byte - region.begin) % region.element_bytes;
  // A height that is stated in double, and told and used as the nearest Real.
  constexpr std::size_t kClimb =
      offsetof(SceneParameters, coupling) + offsetof(CouplingParameters, climb_m);
  if (sizeof(Real) == sizeof(float) && region.name == "parameters" && in_element >= kClimb &&
      in_element < kClimb + sizeof(double)) {
    return 8 * (in_element - kClimb) + bit < 52 - 23;
  }
  for (const NumberField& field : numbers_in(region.name)) {
    if (in_element < field.offset || in_element >= field.offset + field.width * field.count) {
      continue;
    }
    const std::size_t in_number = (in_element - field.offset) % field.width;
    const std::size_t position = 8 * in_number + bit;
    const std::size_t mantissa = field.width == 8 ? 52 : 23;
    const bool of_rounded =
        sizeof(Real) == sizeof(float) && (region.name == "pieces" || region.name == "edge arcs");
    return position < mantissa - (of_rounded ? 5 : 8);
  }
  return false;
}

void flip_everywhere(std::size_t per_region) {
  const tools::SceneBytes good{tools::write_scene(general_scene())};
  SceneView view;
  REQUIRE(SceneView::open(good.span(), view) == RtStatus::kOk);
  const std::string expected = signature(good);
  REQUIRE(!expected.empty());
  Random random(7);
  std::size_t stale_accepted = 0, unchanged_index_or_high = 0;
  for (const Region& region : regions_of(view)) {
    Tally strict, low;
    const std::size_t bits = 8 * region.bytes;
    const bool all = bits <= per_region;
    for (std::size_t i = 0; i < (all ? bits : per_region); ++i) {
      const std::size_t at = all ? i : static_cast<std::size_t>(random.next() % bits);
      const std::size_t byte = region.begin + at / 8;
      const auto bit = static_cast<unsigned>(at % 8);
      // The hash is recomputed below, so a flip in its own field is undone there.
      const std::size_t hash_at = offsetof(SceneHeader, content_hash);
      const bool is_hash = byte >= hash_at && byte < hash_at + sizeof(std::uint64_t);
      tools::SceneBytes damaged{good.span()};
      damaged.span()[byte] ^= static_cast<std::byte>(1u << bit);
      SceneView ignored;
      if (SceneView::open(damaged.span(), ignored) == RtStatus::kOk) ++stale_accepted;
      if (is_hash) continue;
      const std::string got = signature(with_hash(std::move(damaged)));
      const bool is_low = is_low_bit(region, byte, bit);
      Tally& tally = is_low ? low : strict;
      if (got.empty()) {
        ++tally.refused;
      } else if (got != expected) {
        ++tally.changed;
      } else {
        ++tally.unchanged;
        if (!is_low) {
          ++unchanged_index_or_high;
          MESSAGE(region.name << ": byte " << (byte - region.begin) << " bit " << bit
                              << " makes no difference");
        }
      }
    }
    MESSAGE(region.name << ": refused " << strict.refused << ", changed " << strict.changed
                        << ", unchanged " << strict.unchanged << "; low bits of numbers: refused "
                        << low.refused << ", changed " << low.changed << ", unchanged "
                        << low.unchanged);
  }
  CHECK(stale_accepted == 0);
  CHECK(unchanged_index_or_high == 0);
}

}  // namespace

TEST_SUITE("tools.scene_damage") {
  TEST_CASE("a flipped bit is refused by the hash; with the hash recomputed, refused or visible") {
    flip_everywhere(200);
  }

  TEST_CASE("the same for thousands of bits of every table [long]") { flip_everywhere(20000); }
}
