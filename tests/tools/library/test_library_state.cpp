// SPDX-License-Identifier: Apache-2.0
// Contacts of a tick, and states that are saved and loaded.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "tests/tools/library/block_on_plate.hpp"

using namespace haptic::test;

namespace {

/// A block that is pressed on the plate, slid and turned a little: by the number of the tick.
haptic_step_input pressed(int k) {
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  input.time_s = 0.001 * k;
  input.pose[0] = k > 300 ? 1e-5 * (k - 300) : 0;
  input.pose[1] = 0.0005;
  input.pose[2] = 0.035 - std::min(1e-4 * k, 0.023);
  input.pose[3] = 0.02 * std::sin(0.01 * k);
  input.pose[6] = std::sqrt(1 - input.pose[3] * input.pose[3]);
  return input;
}

haptic_step_output step(haptic_core* core, int k) {
  const haptic_step_input input = pressed(k);
  haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
  REQUIRE(haptic_core_step(core, &input, &output) == HAPTIC_OK);
  return output;
}

std::vector<std::byte> saved(haptic_core* core) {
  std::size_t count = 0;
  REQUIRE(haptic_core_save(core, nullptr, 0, &count) == HAPTIC_ERROR_SIZE);
  std::vector<std::byte> bytes(count);
  REQUIRE(haptic_core_save(core, bytes.data(), count - 1, &count) == HAPTIC_ERROR_SIZE);
  REQUIRE(haptic_core_save(core, bytes.data(), bytes.size(), &count) == HAPTIC_OK);
  REQUIRE(count == bytes.size());
  return bytes;
}

int load(haptic_core* core, const std::vector<std::byte>& bytes, std::string& text) {
  char said[256] = "?";
  const int error = haptic_core_load(core, bytes.data(), bytes.size(), said, sizeof said);
  text = said;
  return error;
}

CompiledHandle block_scene_of(double stiffness_n_per_m, double friction) {
  BlockOnPlate block;
  block.input.stiffness_n_per_m = stiffness_n_per_m;
  block.input.friction = friction;
  return compiled(block.input);
}

struct Sum {
  double force[3] = {}, torque[3] = {};
};
/// Of the contacts, with torques about the grip point of the felt pose: the block's centre.
Sum sum_of(const std::vector<haptic_contact>& contacts, const haptic_step_output& output) {
  Sum sum;
  for (const haptic_contact& c : contacts) {
    double arm[3];
    for (int k = 0; k < 3; ++k) arm[k] = c.point_m[k] - output.felt_pose[k];
    for (int k = 0; k < 3; ++k) {
      sum.force[k] += c.force_n[k];
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      sum.torque[k] += arm[i] * c.force_n[j] - arm[j] * c.force_n[i];
    }
  }
  return sum;
}

std::vector<haptic_contact> contacts_of(haptic_core* core, double (&rest)[6]) {
  std::vector<haptic_contact> contacts(48);
  std::size_t count = 0;
  REQUIRE(haptic_core_contacts(core, contacts.data(), contacts.size(), sizeof contacts[0], &count,
                               rest) == HAPTIC_OK);
  contacts.resize(count);
  return contacts;
}

}  // namespace

TEST_SUITE("tools.library") {
  TEST_CASE("contacts: points on the plate, that push within friction, and make the wrench") {
    for (const double friction : {0.0, 0.4}) {
      CAPTURE(friction);
      const CompiledHandle scene = block_scene_of(500, friction);
      const CoreBench bench(bytes_of(scene));
      unsigned pressed_ticks = 0, small_rests = 0;
      double rest[6];
      for (int k = 0; k < 800; ++k) {
        const haptic_step_output output = step(bench.core(), k);
        const std::vector<haptic_contact> contacts = contacts_of(bench.core(), rest);
        if (output.situation == 0) {
          REQUIRE(contacts.empty());
          continue;
        }
        for (const haptic_contact& c : contacts) {
          REQUIRE(c.part == 1);
          REQUIRE(std::abs(c.point_m[2] - 0.005) < 1e-6);
          REQUIRE(c.normal[2] > 1 - 1e-6);
          REQUIRE(c.force_n[2] >= 0);
          REQUIRE(std::hypot(c.force_n[0], c.force_n[1]) <= friction * c.force_n[2] + 1e-9);
        }
        const Sum sum = sum_of(contacts, output);
        for (int i = 0; i < 3; ++i) {
          REQUIRE(std::abs(output.wrench[i] - sum.force[i] - rest[i]) < 1e-9);
          REQUIRE(std::abs(output.wrench[3 + i] - sum.torque[i] - rest[3 + i]) < 1e-9);
        }
        const double size_n = std::hypot(output.wrench[0], output.wrench[1], output.wrench[2]);
        if (size_n < 0.05) continue;
        pressed_ticks += 1;
        // A pyramid of 8 sides has at least 0.92 of its cone's width.
        const double most = 1e-4 + 0.08 * friction;
        if (std::hypot(rest[0], rest[1], rest[2]) <= most * size_n) small_rests += 1;
      }
      CHECK(pressed_ticks > 500);
      // All the rest: the planes hold the pull, but for the ticks in which the block tips.
      CHECK(small_rests > 9 * pressed_ticks / 10);
      MESSAGE("friction " << friction << ": a small rest in " << small_rests << " of "
                          << pressed_ticks << " ticks");
    }
  }

  TEST_CASE("contacts: a short list, a refused pose, and calls that cannot be meant") {
    const CoreBench bench;
    haptic_contact two[2] = {};
    double rest[6];
    std::size_t count = 7;
    haptic_core* const core = bench.core();
    CHECK(haptic_core_contacts(core, two, 2, sizeof two[0], &count, rest) == HAPTIC_OK);
    CHECK(count == 0);  // no tick yet
    for (int k = 0; k < 320; ++k) (void)step(core, k);
    CHECK(haptic_core_contacts(core, two, 2, sizeof two[0], &count, nullptr) == HAPTIC_OK);
    CHECK(count > 2);
    CHECK(two[1].part == 1);
    CHECK(haptic_core_contacts(core, two, 0, sizeof two[0], &count, rest) == HAPTIC_ERROR_SIZE);
    CHECK(haptic_core_contacts(core, two, 2, 8, &count, rest) == HAPTIC_ERROR_VERSION);
    CHECK(haptic_core_contacts(core, two, 2, sizeof two[0], nullptr, rest) == HAPTIC_ERROR_NULL);
    CHECK(haptic_core_contacts(nullptr, two, 2, sizeof two[0], &count, rest) == HAPTIC_ERROR_NULL);
    haptic_step_input bad = pressed(320);
    bad.pose[0] = std::nan("");
    haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
    CHECK(haptic_core_step(core, &bad, &output) == HAPTIC_ERROR_POSE);
    CHECK(haptic_core_contacts(core, two, 2, sizeof two[0], &count, rest) == HAPTIC_OK);
    CHECK(count == 0);
  }

  TEST_CASE("state: another core in other memory goes on with the same bits, the first one gone") {
    const CompiledHandle scene = block_scene_of(500, 0.3);
    for (const int at : {0, 1, 150, 231, 450, 700}) {
      CAPTURE(at);
      std::vector<std::byte> state;
      std::vector<std::uint64_t> hashes;
      std::vector<double> up_n;
      haptic_verdict verdict = HAPTIC_VERDICT_INIT;
      {
        const CoreBench first(bytes_of(scene));
        for (int k = 0; k < at; ++k) (void)step(first.core(), k);
        state = saved(first.core());
        for (int k = at; k < at + 300; ++k) {
          const haptic_step_output output = step(first.core(), k);
          hashes.push_back(output.state_hash);
          up_n.push_back(output.wrench[2]);
        }
        REQUIRE(haptic_core_verdict(first.core(), &verdict) == HAPTIC_OK);
        std::memset(static_cast<void*>(first.core()), 0xa5, 4096);  // and its handle spoilt
      }
      const CoreBench second(bytes_of(scene));
      for (int k = 0; k < 77; ++k) (void)step(second.core(), 2 * k);  // of another history
      std::string text;
      REQUIRE(load(second.core(), state, text) == HAPTIC_OK);
      CHECK(text.empty());
      CHECK(saved(second.core()) == state);  // no address in it
      for (int k = at; k < at + 300; ++k) {
        const haptic_step_output output = step(second.core(), k);
        REQUIRE(output.state_hash == hashes[static_cast<std::size_t>(k - at)]);
        REQUIRE(output.wrench[2] == up_n[static_cast<std::size_t>(k - at)]);
      }
      haptic_verdict after = HAPTIC_VERDICT_INIT;
      REQUIRE(haptic_core_verdict(second.core(), &after) == HAPTIC_OK);
      CHECK(std::memcmp(&after, &verdict, sizeof after) == 0);
    }
  }

  TEST_CASE("state: what is refused says why, and changes nothing") {
    const CoreBench bench, other;
    for (int k = 0; k < 400; ++k) (void)step(bench.core(), k);
    const std::vector<std::byte> good = saved(bench.core());
    for (int k = 0; k < 100; ++k) (void)step(other.core(), k);
    const std::vector<std::byte> before = saved(other.core());
    std::string text;
    const auto refused = [&](const std::vector<std::byte>& bytes, int error, const char* words) {
      CAPTURE(words);
      CHECK(load(other.core(), bytes, text) == error);
      CAPTURE(text);
      CHECK(text.find(words) != std::string::npos);
    };
    const auto changed = [&](std::size_t at, unsigned by) {
      std::vector<std::byte> bytes = good;
      bytes[at] ^= static_cast<std::byte>(by);
      return bytes;
    };
    refused(changed(0, 1), HAPTIC_ERROR_INPUT, "no state of a core");
    refused(changed(8, 1), HAPTIC_ERROR_VERSION, "another version");
    refused(changed(12, 12), HAPTIC_ERROR_VERSION, "precision");
    refused(changed(16, 1), HAPTIC_ERROR_VERSION, "another version");
    refused(changed(32, 1), HAPTIC_ERROR_VERSION, "another build");
    refused(changed(64, 1), HAPTIC_ERROR_SCENE, "another scene");
    refused(changed(good.size() - 9, 64), HAPTIC_ERROR_INPUT, "damaged");
    std::vector<std::byte> longer = good;
    longer.push_back(std::byte{0});
    refused(longer, HAPTIC_ERROR_INPUT, "followed by other bytes");
    for (const std::size_t size :
         {std::size_t{1}, std::size_t{8}, std::size_t{100}, good.size() / 2, good.size() - 1})
      refused({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}, HAPTIC_ERROR_INPUT,
              size < 144 ? "within its header" : "cut off");
    const CompiledHandle stiffer = block_scene_of(400, 0);
    const CoreBench of_other(bytes_of(stiffer));
    CHECK(load(of_other.core(), good, text) == HAPTIC_ERROR_SCENE);
    // Any bit of it.
    std::mt19937_64 random(47);
    for (int k = 0; k < 300; ++k) {
      const std::size_t at = random() % good.size();
      REQUIRE(load(other.core(), changed(at, 1u << (random() % 8)), text) != HAPTIC_OK);
      REQUIRE(text.size() > 20);
    }
    CHECK(saved(other.core()) == before);
    char small[8];
    CHECK(haptic_core_load(other.core(), good.data(), 3, small, 0) == HAPTIC_ERROR_SIZE);
    CHECK(haptic_core_load(other.core(), nullptr, 3, small, 8) == HAPTIC_ERROR_NULL);
    CHECK(haptic_core_load(nullptr, good.data(), 3, nullptr, 0) == HAPTIC_ERROR_NULL);
    CHECK(load(other.core(), good, text) == HAPTIC_OK);
  }

  TEST_CASE("replay: without times it goes on from the last tick's") {
    const CoreBench one, other;
    std::vector<double> poses, in_one(6 * 400), in_two(6 * 400);
    for (int k = 0; k < 400; ++k) {
      const haptic_step_input input = pressed(k);
      poses.insert(poses.end(), input.pose, input.pose + 7);
    }
    const auto replay = [&](haptic_core* core, std::size_t begin, std::size_t count, double* to) {
      haptic_replay call = HAPTIC_REPLAY_INIT;
      call.poses = poses.data() + 7 * begin;
      call.wrenches = to + 6 * begin;
      call.count = count;
      REQUIRE(haptic_core_replay(core, &call) == HAPTIC_OK);
      CHECK(call.done == count);
    };
    replay(one.core(), 0, 400, in_one.data());
    replay(other.core(), 0, 150, in_two.data());
    replay(other.core(), 150, 250, in_two.data());
    CHECK(in_one == in_two);
  }
}
