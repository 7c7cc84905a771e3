// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <vector>

#include "tests/rt_core/damaged_scene.hpp"
#include "tests/support/pruned_scenes.hpp"

using namespace haptic;
using namespace haptic::test;

TEST_SUITE("rt_core.scene_view") {
  TEST_CASE("open: accepts what the writer made and tells its tables") {
    const LoadedScene scene(tetra_box_blob());
    CHECK(scene.view.bodies().size() == 2);
    CHECK(scene.view.pair_count() == 1);
    CHECK(scene.view.pair_record(0).node_count == 128);
    CHECK(scene.view.text(scene.view.parameters().name_offset,
                          scene.view.parameters().name_bytes) == "test scene");
  }

  TEST_CASE("open: every truncation is refused") {
    const std::vector<std::byte> blob = tetra_box_blob();
    for (std::size_t size = 0; size < blob.size(); size += size < 512 ? 1 : 61) {
      DamagedCopy copy(blob, size);
      CHECK(copy.open() == RtStatus::kBlobTooSmall);
    }
    DamagedCopy longer(blob, blob.size() + 1);
    CHECK(longer.open() == RtStatus::kBlobTooSmall);
  }

  TEST_CASE("open: says what is wrong with a header") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto damaged = [&](auto damage) {
      DamagedCopy copy(blob, blob.size());
      damage(copy.header());
      copy.rehash();
      return copy.open();
    };
    CHECK(damaged([](SceneHeader& h) { h.magic[0] = 'X'; }) == RtStatus::kBlobBadMagic);
    CHECK(damaged([](SceneHeader& h) { h.version += 1; }) == RtStatus::kBlobBadVersion);
    CHECK(damaged([](SceneHeader& h) { h.scalar_bytes = h.scalar_bytes == 8 ? 4 : 8; }) ==
          RtStatus::kBlobWrongScalar);
    CHECK(damaged([](SceneHeader& h) { h.section_count = 65; }) == RtStatus::kBlobBadSectionTable);
    CHECK(damaged([](SceneHeader& h) { h.section_count -= 1; }) != RtStatus::kOk);
    CHECK(damaged([](SceneHeader& h) { h.section_table += 8; }) == RtStatus::kBlobBadSectionTable);
    CHECK(damaged([](SceneHeader& h) { h.capacity.largest_near += 1; }) ==
          RtStatus::kBlobBadCapacity);
    DamagedCopy stale(blob, blob.size());
    stale.bytes()[blob.size() / 2] ^= std::byte{1};
    CHECK(stale.open() == RtStatus::kBlobBadHash);
    std::vector<CacheLine> lines(blob.size() / 64 + 2);
    std::byte* const shifted = reinterpret_cast<std::byte*>(lines.data()) + 8;
    std::memcpy(shifted, blob.data(), blob.size());
    SceneView view;
    CHECK(SceneView::open({shifted, blob.size()}, view) == RtStatus::kBlobMisaligned);
  }

  TEST_CASE("open: refuses stiffness and lengths that would overflow a force") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters,
                                              [&](SceneParameters* p) { change(*p); });
    };
    CHECK(with([](SceneParameters&) {}) == RtStatus::kOk);
    CHECK(with([](SceneParameters& p) { p.k_f_n_per_m = kMaxStiffness_n_per_m; }) == RtStatus::kOk);
    CHECK(with([](SceneParameters& p) { p.k_f_n_per_m = 1e308; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters& p) { p.epsilon_m = 1e7; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters& p) { p.start_p_wa_m[1] = -1e7; }) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: refuses laws and bands that are none") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters, change);
    };
    CHECK(with([](SceneParameters* p) { p->law = LawId::kProxy; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneParameters* p) { p->law = static_cast<LawId>(4); }) ==
          RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters* p) { p->exact_band_m = kMaxSceneLength_m; }) == RtStatus::kOk);
    CHECK(with([](SceneParameters* p) { p->exact_band_m = -1; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters* p) { p->exact_band_m = 1e300 * 1e300; }) ==
          RtStatus::kBlobBadNumber);
    // The arcs belong to one epsilon.
    CHECK(with([](SceneParameters* p) { p->epsilon_m *= 2; }) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: refuses couplings out of their ranges") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters,
                                              [&](SceneParameters* p) { change(p->coupling); });
    };
    using Member = double CouplingParameters::*;
    struct Range {
      Member member;
      double least, most, below, above;
    };
    const double k_t = 1000.0, infinite = std::numeric_limits<double>::infinity();
    const Range ranges[] = {{&CouplingParameters::k_r_nm_per_rad, k_t * 1.1e-18, k_t * 1e12,
                             k_t * 0.9e-18, k_t * 1.1e12},
                            {&CouplingParameters::damping_ns_per_m, 0, 1e12, -1e-300, 1.1e12},
                            {&CouplingParameters::damping_share, 0, 1, -0.1, 1.1},
                            {&CouplingParameters::max_rotation_error_rad, 1e-9, 3, 0, 3.1},
                            {&CouplingParameters::max_translation_error_m, 0, 1e6, -1e-9, 1.1e6},
                            {&CouplingParameters::min_window_s, 0, 0.02, -0.001, 0.021},
                            {&CouplingParameters::max_window_s, 0.001, 1e3, 0.0009, 1.1e3},
                            {&CouplingParameters::max_pull_n, 0, 1e300, -1e-9, infinite},
                            {&CouplingParameters::max_turn_nm, 0, 1e300, -1e-9, infinite}};
    for (const Range& r : ranges) {
      CAPTURE(&r - ranges);
      for (const double x : {r.least, r.most}) {
        CHECK(with([&](CouplingParameters& c) { c.*r.member = x; }) == RtStatus::kOk);
      }
      for (const double x : {r.below, r.above, std::nan(""), infinite}) {
        CHECK(with([&](CouplingParameters& c) { c.*r.member = x; }) == RtStatus::kBlobBadNumber);
      }
    }
    const auto k = [&](double stiffness, double length) {
      return with([&](CouplingParameters& c) {
        c.k_t_n_per_m = stiffness;
        c.k_r_nm_per_rad = stiffness * length * length;
      });
    };
    CHECK(k(kMinStiffness_n_per_m, 1.0) == RtStatus::kOk);
    CHECK(k(kMaxStiffness_n_per_m, 1.0) == RtStatus::kOk);
    for (const double x : {0.0, 0.9e-12, 1.1e12, -1.0, std::nan("")}) {
      CHECK(k(x, 1.0) == RtStatus::kBlobBadNumber);
    }
    CHECK(with([](CouplingParameters& c) { c.passivity = 2; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](CouplingParameters& c) { c.allow_active = 2; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](CouplingParameters& c) { c.passivity = c.allow_active = 1; }) == RtStatus::kOk);
  }

  TEST_CASE("open: static bodies rub with a coefficient from 0 to 2, the moving one has none") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](std::size_t body, double sliding, double sticking) {
      return changed_section<BodyRecord>(blob, SectionId::kBodies, [&](BodyRecord* b) {
        b[body].friction = sliding;
        b[body].friction_static = sticking;
      });
    };
    CHECK(with(1, 0.3, 0.3) == RtStatus::kOk);
    CHECK(with(1, 0.0, kMaxFriction) == RtStatus::kOk);
    CHECK(with(1, kMaxFriction, kMaxFriction) == RtStatus::kOk);
    for (const double x : {-0.1, 2.1, std::nan("")}) {
      CHECK(with(1, x, x) == RtStatus::kBlobBadNumber);
      CHECK(with(1, 0.0, x) == RtStatus::kBlobBadNumber);
    }
    CHECK(with(1, 0.3, 0.29) == RtStatus::kBlobBadNumber);
    CHECK(with(0, 0.3, 0.3) == RtStatus::kBlobBadNumber);
    CHECK(with(0, 0.0, 0.3) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: a device states no negative number, and a rotor about all axes or none") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters,
                                              [&](SceneParameters* p) { change(p->device); });
    };
    const double infinite = std::numeric_limits<double>::infinity();
    for (const auto member :
         {&DeviceParameters::mass_kg, &DeviceParameters::coulomb_friction_n,
          &DeviceParameters::coulomb_torque_nm, &DeviceParameters::encoder_step_rad,
          &DeviceParameters::max_rotary_stiffness_nm_per_rad, &DeviceParameters::delay_s}) {
      CHECK(with([&](DeviceParameters& d) { d.*member = 1.0; }) == RtStatus::kOk);
      for (const double x : {-1e-300, infinite, std::nan("")}) {
        CHECK(with([&](DeviceParameters& d) { d.*member = x; }) == RtStatus::kBlobBadNumber);
      }
    }
    const auto rotor = [&](std::array<double, 3> inertia, std::array<double, 3> damping) {
      return with([&](DeviceParameters& d) {
        std::ranges::copy(inertia, d.rotor_inertia_kg_m2);
        std::ranges::copy(damping, d.rotor_damping_nms_per_rad);
      });
    };
    CHECK(rotor({1e-4, 2e-4, 3e-4}, {0, 1e-3, 0}) == RtStatus::kOk);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const double x : {0.0, -1e-4, infinite, std::nan("")}) {
        std::array<double, 3> inertia{1e-4, 2e-4, 3e-4}, damping{1e-3, 1e-3, 1e-3};
        inertia[axis] = x;
        CHECK(rotor(inertia, damping) == RtStatus::kBlobBadNumber);
        if (x == 0.0) continue;
        damping[axis] = x;
        CHECK(rotor({1e-4, 2e-4, 3e-4}, damping) == RtStatus::kBlobBadNumber);
      }
    }
  }

  TEST_CASE("open: a held part is all zero or has the inertia of a body about its grip") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(
          blob, SectionId::kParameters, [&](SceneParameters* p) {
            // A rod of 0.3 kg and 0.2 m along z, held at its end.
            p->held = {0.3, {0.004, 0.004, 0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.1}, {0.0, 0.0, -9.81}};
            change(p->held);
          });
    };
    CHECK(with([](HeldPartParameters&) {}) == RtStatus::kOk);
    CHECK(with([](HeldPartParameters& h) { h = HeldPartParameters{}; }) == RtStatus::kOk);
    CHECK(with([](HeldPartParameters& h) { h.mass_kg = 0; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](HeldPartParameters& h) { h.mass_kg = -0.3; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](HeldPartParameters& h) { h.mass_kg = 1.1e6; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](HeldPartParameters& h) { h.inertia_kg_m2[0] = 0.0; }) ==
          RtStatus::kBlobBadNumber);
    CHECK(with([](HeldPartParameters& h) { h.inertia_kg_m2[3] = 0.001; }) ==
          RtStatus::kBlobBadNumber);
    CHECK(with([](HeldPartParameters& h) { h.inertia_kg_m2[5] = std::nan(""); }) ==
          RtStatus::kBlobBadNumber);
    // Its centre would have more inertia about the grip than the whole part.
    CHECK(with([](HeldPartParameters& h) { h.centre_m[2] = 0.12; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](HeldPartParameters& h) { h.gravity_m_per_s2[1] = 1.1e4; }) ==
          RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: a section with an unknown id is skipped") {
    // The last section is renamed; it was required, so the answer names what is missing, not the
    // unknown one.
    const std::vector<std::byte> blob = tetra_box_blob();
    DamagedCopy copy(blob, blob.size());
    auto* sections =
        reinterpret_cast<SectionEntry*>(copy.bytes().data() + copy.header().section_table);
    sections[copy.header().section_count - 1].id = static_cast<SectionId>(777);
    copy.rehash();
    CHECK(copy.open() == RtStatus::kBlobMissingSection);
  }

  TEST_CASE("open: survives any damage with a correct hash") {
    const std::vector<std::byte> blob = tetra_box_blob();
    Random random(20);
    int refused = 0;
    for (int round = 0; round < 4000; ++round) {
      DamagedCopy copy(blob, blob.size());
      const int flips = 1 + static_cast<int>(random.next() % 4);
      for (int k = 0; k < flips; ++k) {
        const std::size_t at = random.next() % blob.size();
        copy.bytes()[at] ^= static_cast<std::byte>(1u << (random.next() % 8));
      }
      copy.header().byte_count = blob.size();
      copy.rehash();
      SceneView view;
      if (SceneView::open(copy.bytes(), view) != RtStatus::kOk) {
        ++refused;
        continue;
      }
      step_a_little(view);
    }
    CHECK(
        refused >
        2500);  // what is accepted changed a low bit of a coordinate, a parameter or a source index
  }
}
