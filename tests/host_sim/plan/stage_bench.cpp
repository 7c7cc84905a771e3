// SPDX-License-Identifier: Apache-2.0
#include "tests/host_sim/plan/stage_bench.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <utility>

#include "rt_core/base/rotation.hpp"
#include "tools/c_space/pose_text.hpp"

namespace haptic::sim::test {

void write_text(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

void write_boxes(const std::string& path, const std::vector<MillimetreBox>& boxes) {
  std::ofstream file(path);
  for (const MillimetreBox& box : boxes)
    for (std::size_t k = 0; k < 8; ++k)
      file << "v " << box[k & 1][0] << ' ' << box[k >> 1 & 1][1] << ' ' << box[k >> 2][2] << '\n';
  constexpr int kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (std::size_t box = 0; box < boxes.size(); ++box) {
    for (const auto& face : kFaces) {
      file << 'f';
      for (const int corner : face) file << ' ' << 8 * static_cast<int>(box) + corner + 1;
      file << '\n';
    }
  }
}

std::string part_text(const std::string& name, const std::string& role, const std::string& more) {
  return "[[part]]\nname = \"" + name + "\"\nrole = \"" + role + "\"\nmesh = \"" + name +
         ".obj\"\nscale_to_m = 0.001\n" + more;
}

void write_case(const ScratchFolder& folder) {
  // Slots for the bar in the two walls across x.
  std::vector<MillimetreBox> walls{{{{-30, -30, -10}, {30, 30, 0}}},
                                   {{{-30, -30, -5}, {30, -20, 40}}},
                                   {{{-30, 20, -5}, {30, 30, 40}}}};
  for (const double x : {-30.0, 20.0}) {
    walls.push_back({{{x, -30, -5}, {x + 10, -4.1, 40}}});
    walls.push_back({{{x, 4.1, -5}, {x + 10, 30, 40}}});
    walls.push_back({{{x, -5, -5}, {x + 10, 5, 22.9}}});
    walls.push_back({{{x, -5, 28.1}, {x + 10, 5, 40}}});
  }
  write_boxes(folder.file("case.obj"), walls);
  constexpr double a = 19.9;
  // The block lies on the floor, and the pin on the block.
  write_boxes(folder.file("block.obj"), {{{{-a, -a, 0}, {a, -5, 10}}},
                                         {{{-a, 5, 0}, {a, a, 10}}},
                                         {{{-a, -a, 0}, {-5, a, 10}}},
                                         {{{5, -a, 0}, {a, a, 10}}}});
  write_boxes(folder.file("pin.obj"),
              {{{{-4.9, -4.9, 1}, {4.9, 4.9, 12}}}, {{{-10, -10, 10}, {10, 10, 15}}}});
  write_boxes(folder.file("cover.obj"), {{{{-a, -a, 15}, {a, a, 22.95}}}});
  write_boxes(folder.file("bar.obj"), {{{{-35, -4, 23}, {35, 4, 28}}}});
  write_text(folder.file("case.toml"), kAssemblyHead + part_text("case", "fixed") +
                                           part_text("cover", "hand") + part_text("bar", "placed") +
                                           part_text("block", "placed") +
                                           part_text("pin", "placed"));
}

void write_chain(const ScratchFolder& folder) {
  const auto link = [](double x, bool upright) {
    const auto turned = [&](const MillimetreBox& box) {
      MillimetreBox out = box;
      for (auto& corner : out) {
        corner[0] += x;
        if (upright) std::swap(corner[1], corner[2]);
      }
      return out;
    };
    return std::vector<MillimetreBox>{
        turned({{{-20, -20, -4}, {20, -12, 4}}}), turned({{{-20, 12, -4}, {20, 20, 4}}}),
        turned({{{-20, -20, -4}, {-12, 20, 4}}}), turned({{{12, -20, -4}, {20, 20, 4}}})};
  };
  write_boxes(folder.file("one.obj"), link(0, false));
  write_boxes(folder.file("two.obj"), link(24, true));
  write_boxes(folder.file("floor.obj"), {{{{-40, -40, -60}, {80, 40, -50}}}});
  write_boxes(folder.file("brick.obj"), {{{{-40, -40, -50}, {-30, -30, -40}}}});
  write_text(folder.file("chain.toml"), kAssemblyHead + part_text("floor", "fixed") +
                                            part_text("one", "hand") + part_text("two", "placed") +
                                            part_text("brick", "placed"));
}

LedHand::LedHand(const SceneView& scene, double length_m)
    : pose_(tools::pose_from_text(scene, "start", "start")),
      per_turn_(static_cast<Real>(1 / (length_m * length_m))) {
  for (int k = 0; k < 3; ++k) grip_a_[k] = static_cast<Real>(scene.bodies()[0].reference_m[k]);
}

void LedHand::follow(const StepResult& result) {
  constexpr Real kPerForce = 2.0e-5_r;  // [m/N] a tick
  const Wrench& guide_w = result.guidance.wrench_w;
  const Vec3 force = guide_w.force_w + result.wrench_w.force_w;
  const Vec3 torque = guide_w.torque_w + result.wrench_w.torque_w;
  const Vec3 grip_w = pose_.p_wa + pose_.q_wa * grip_a_ + kPerForce * force;
  pose_.q_wa = (so3_exp(kPerForce * per_turn_ * torque) * pose_.q_wa).normalized();
  pose_.p_wa = grip_w - pose_.q_wa * grip_a_;
}

}  // namespace haptic::sim::test
