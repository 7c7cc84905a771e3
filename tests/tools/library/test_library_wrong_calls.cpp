// SPDX-License-Identifier: Apache-2.0
// Calls that no program should make: each is answered with an error number, and nothing crashes.
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/library/block_on_plate.hpp"
#include "tools/common/split_mix.hpp"

using namespace haptic::test;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kBadNumbers[] = {kNan, kInf, -kInf, -1.0, 1e300};

/// How many wrong calls were answered with what was expected.
struct Answers {
  int calls = 0;

  void take(int error, int expected) {
    calls += 1;
    CHECK_MESSAGE(error == expected, std::string(haptic_error_name(error)), " instead of ",
                  std::string(haptic_error_name(expected)));
  }
};

template <class T>
std::vector<T> of_unknown_sizes(const T& structure) {
  std::vector<T> all;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{4}, sizeof(T) - 1,
                                 sizeof(T) + 1, sizeof(T) + 8, std::size_t{0xffffffff}}) {
    all.push_back(structure);
    all.back().struct_size = static_cast<std::uint32_t>(size);
  }
  return all;
}

void plan_wrong(Answers& answers) {
  const std::span<const std::byte> scene = block_scene();
  haptic_planned* planned = nullptr;
  haptic_plan_input good = HAPTIC_PLAN_INPUT_INIT;
  good.goal_pose[2] = 0.1;
  const auto answer = [&](const haptic_plan_input& input, int expected) {
    answers.take(haptic_plan(scene.data(), scene.size(), &input, &planned), expected);
    CHECK(planned == nullptr);
  };
  answers.take(haptic_plan(nullptr, 0, &good, &planned), HAPTIC_ERROR_NULL);
  answers.take(haptic_plan(scene.data(), scene.size(), nullptr, &planned), HAPTIC_ERROR_NULL);
  answers.take(haptic_plan(scene.data(), scene.size(), &good, nullptr), HAPTIC_ERROR_NULL);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, scene.size() - 1})
    answers.take(haptic_plan(scene.data(), size, &good, &planned), HAPTIC_ERROR_SCENE);
  for (const haptic_plan_input& input : of_unknown_sizes(good)) answer(input, HAPTIC_ERROR_VERSION);
  for (const double bad : kBadNumbers) {
    haptic_plan_input input = good;
    input.seconds = bad;
    answer(input, HAPTIC_ERROR_NUMBER);
    if (bad == -1.0) continue;  // a place
    input = good;
    input.goal_pose[0] = bad;
    answer(input, HAPTIC_ERROR_POSE);
    input = good;
    input.start_pose[0] = bad;
    input.has_start = 1;
    answer(input, HAPTIC_ERROR_POSE);
  }
  good.goal_pose[6] = 0.5;
  answer(good, HAPTIC_ERROR_POSE);

  // A goal that is not free: facts and their text, no bytes.
  good.goal_pose[6] = 1;
  good.goal_pose[2] = 0;
  answers.take(haptic_plan(scene.data(), scene.size(), &good, &planned), HAPTIC_ERROR_INPUT);
  const void* bytes = nullptr;
  const double* poses = nullptr;
  std::size_t count = 0;
  haptic_plan_facts facts = HAPTIC_PLAN_FACTS_INIT;
  answers.take(haptic_planned_bytes(planned, &bytes, &count), HAPTIC_ERROR_SIZE);
  answers.take(haptic_planned_poses(planned, &poses, &count), HAPTIC_ERROR_SIZE);
  answers.take(haptic_planned_bytes(planned, nullptr, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_planned_poses(planned, &poses, nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_planned_facts(planned, nullptr), HAPTIC_ERROR_NULL);
  for (haptic_plan_facts& unknown : of_unknown_sizes(facts))
    answers.take(haptic_planned_facts(planned, &unknown), HAPTIC_ERROR_VERSION);
  CHECK(haptic_planned_facts(planned, &facts) == HAPTIC_OK);
  CHECK(std::string(facts.text).starts_with("goal: the part is not free there: pieces "));
  CHECK(haptic_planned_free(&planned) == HAPTIC_OK);
  CHECK(haptic_planned_free(&planned) == HAPTIC_OK);
  answers.take(haptic_planned_free(nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_planned_bytes(nullptr, &bytes, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_planned_facts(nullptr, &facts), HAPTIC_ERROR_NULL);
  std::vector<std::uint64_t> no_handle(64);
  auto* const wrong = reinterpret_cast<haptic_planned*>(no_handle.data());
  answers.take(haptic_planned_bytes(wrong, &bytes, &count), HAPTIC_ERROR_HANDLE);
  answers.take(haptic_planned_poses(wrong, &poses, &count), HAPTIC_ERROR_HANDLE);
  answers.take(haptic_planned_facts(wrong, &facts), HAPTIC_ERROR_HANDLE);
  haptic_planned* handle = wrong;
  answers.take(haptic_planned_free(&handle), HAPTIC_ERROR_HANDLE);
}

void compile_wrong(Answers& answers) {
  const auto answer = [&](const std::function<void(BlockOnPlate&)>& spoil, int expected) {
    BlockOnPlate scene;
    spoil(scene);
    haptic_compiled* compiled = nullptr;
    answers.take(haptic_compile(&scene.input, &compiled), expected);
    const bool has_messages = expected == HAPTIC_ERROR_INPUT || expected == HAPTIC_ERROR_LIMIT;
    CHECK((compiled != nullptr) == has_messages);
    (void)haptic_compiled_free(&compiled);
  };
  haptic_compiled* compiled = nullptr;
  const BlockOnPlate good;
  answers.take(haptic_compile(nullptr, &compiled), HAPTIC_ERROR_NULL);
  answers.take(haptic_compile(&good.input, nullptr), HAPTIC_ERROR_NULL);
  for (const haptic_compile_input& input : of_unknown_sizes(good.input))
    answers.take(haptic_compile(&input, &compiled), HAPTIC_ERROR_VERSION);
  for (const haptic_part& part : of_unknown_sizes(good.moving)) {
    answer([&](BlockOnPlate& s) { s.moving = part; }, HAPTIC_ERROR_VERSION);
    answer([&](BlockOnPlate& s) { s.fixed = part; }, HAPTIC_ERROR_VERSION);
  }
  answer([](BlockOnPlate& s) { s.input.moving = nullptr; }, HAPTIC_ERROR_NULL);
  answer([](BlockOnPlate& s) { s.input.fixed = nullptr; }, HAPTIC_ERROR_NULL);
  answer([](BlockOnPlate& s) { s.input.fixed_count = 0; }, HAPTIC_ERROR_SIZE);
  answer([](BlockOnPlate& s) { s.moving.vertices = nullptr; }, HAPTIC_ERROR_NULL);
  answer([](BlockOnPlate& s) { s.fixed.triangles = nullptr; }, HAPTIC_ERROR_NULL);
  answer([](BlockOnPlate& s) { s.moving.vertex_count = 0; }, HAPTIC_ERROR_SIZE);
  answer([](BlockOnPlate& s) { s.moving.triangle_count = 0; }, HAPTIC_ERROR_SIZE);
  answer([](BlockOnPlate& s) { s.moving.triangle_count = ~std::size_t{0}; }, HAPTIC_ERROR_SIZE);
  for (const double bad : kBadNumbers) {
    answer([&](BlockOnPlate& s) { s.input.stiffness_n_per_m = bad; }, HAPTIC_ERROR_NUMBER);
    answer([&](BlockOnPlate& s) { s.input.friction = bad; }, HAPTIC_ERROR_NUMBER);
    answer([&](BlockOnPlate& s) { s.input.rate_hz = bad; }, HAPTIC_ERROR_NUMBER);
    answer([&](BlockOnPlate& s) { s.moving.scale_to_m = bad; }, HAPTIC_ERROR_NUMBER);
    answer([&](BlockOnPlate& s) { s.fixed.simplify_m = bad; }, HAPTIC_ERROR_NUMBER);
    answer([&](BlockOnPlate& s) { s.moving.pose[6] = bad == -1.0 ? 0.5 : bad; }, HAPTIC_ERROR_POSE);
    answer([&](BlockOnPlate& s) { s.fixed.pose[0] = bad == -1.0 ? 1e9 : bad; }, HAPTIC_ERROR_POSE);
  }
  answer([](BlockOnPlate& s) { s.moving.file = "/nowhere/peg.stl"; }, HAPTIC_ERROR_INPUT);
  answer([](BlockOnPlate& s) { s.moving.file = ""; }, HAPTIC_ERROR_INPUT);
  answer([](BlockOnPlate& s) { s.input.scene_file = ""; }, HAPTIC_ERROR_INPUT);
  answer([](BlockOnPlate& s) { s.input.scene_file = "/"; }, HAPTIC_ERROR_INPUT);
  answer([](BlockOnPlate& s) { s.block.vertices[5] = kNan; }, HAPTIC_ERROR_INPUT);
  for (std::size_t k = 0; k < 36; ++k)
    answer([&](BlockOnPlate& s) { s.block.triangles[k] = 8; }, HAPTIC_ERROR_INPUT);
}

void messages_wrong(Answers& answers) {
  const BlockOnPlate good;
  haptic_compiled* compiled = nullptr;
  REQUIRE(haptic_compile(&good.input, &compiled) == HAPTIC_OK);
  const void* bytes = nullptr;
  std::size_t count = 0;
  haptic_message message = HAPTIC_MESSAGE_INIT;
  answers.take(haptic_compiled_bytes(nullptr, &bytes, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_compiled_bytes(compiled, nullptr, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_compiled_bytes(compiled, &bytes, nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_compiled_message_count(nullptr, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_compiled_message_count(compiled, nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_compiled_message(nullptr, 0, &message), HAPTIC_ERROR_NULL);
  answers.take(haptic_compiled_message(compiled, 0, nullptr), HAPTIC_ERROR_NULL);
  for (const std::size_t index : {std::size_t{1000}, ~std::size_t{0}})
    answers.take(haptic_compiled_message(compiled, index, &message), HAPTIC_ERROR_NUMBER);
  for (haptic_message& wrong : of_unknown_sizes(message))
    answers.take(haptic_compiled_message(compiled, 0, &wrong), HAPTIC_ERROR_VERSION);
  answers.take(haptic_compiled_free(nullptr), HAPTIC_ERROR_NULL);
  REQUIRE(haptic_compiled_free(&compiled) == HAPTIC_OK);
  answers.take(haptic_compiled_bytes(compiled, &bytes, &count), HAPTIC_ERROR_NULL);  // freed: null
}

/// Aligned bytes with room for one more.
struct Blob {
  explicit Blob(std::span<const std::byte> source)
      : memory(source.size() + 65), size(source.size()) {
    const std::size_t over = reinterpret_cast<std::uintptr_t>(memory.data()) % 64;
    at = memory.data() + (64 - over) % 64;
    std::copy(source.begin(), source.end(), at);
  }
  std::vector<std::byte> memory;
  std::byte* at;
  std::size_t size;
};

void scenes_wrong(Answers& answers) {
  const std::span<const std::byte> scene = block_scene();
  haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
  answers.take(haptic_scene_read(nullptr, scene.size(), &info), HAPTIC_ERROR_NULL);
  answers.take(haptic_scene_read(scene.data(), 0, &info), HAPTIC_ERROR_SIZE);
  answers.take(haptic_scene_read(scene.data(), scene.size(), nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_scene_read(scene.data() + 1, scene.size() - 1, &info), HAPTIC_ERROR_MEMORY);
  for (haptic_scene_info& wrong : of_unknown_sizes(info))
    answers.take(haptic_scene_read(scene.data(), scene.size(), &wrong), HAPTIC_ERROR_VERSION);
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_session* session = nullptr;
  haptic_core* core = nullptr;
  haptic::tools::SplitMix64 random(1);
  Blob damaged(scene);
  for (int k = 0; k < 200; ++k) {
    const std::size_t cut = 1 + random.next() % (scene.size() - 1);
    answers.take(haptic_scene_read(scene.data(), cut, &info), HAPTIC_ERROR_SCENE);
    CHECK(std::string(info.trouble) != "");
    const std::size_t place = random.next() % scene.size();
    const auto flip = static_cast<std::byte>(1u << (random.next() % 8));
    damaged.at[place] ^= flip;
    answers.take(haptic_core_create(damaged.at, damaged.size, damaged.at, 1 << 20, &core),
                 HAPTIC_ERROR_SCENE);
    answers.take(haptic_session_open(damaged.at, damaged.size, &options, &session),
                 HAPTIC_ERROR_SCENE);
    damaged.at[place] ^= flip;
  }
  CHECK(core == nullptr);
  CHECK(session == nullptr);
}

void cores_wrong(Answers& answers) {
  const std::span<const std::byte> scene = block_scene();
  haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
  REQUIRE(haptic_scene_read(scene.data(), scene.size(), &info) == HAPTIC_OK);
  Blob memory(std::vector<std::byte>(info.memory_bytes));
  haptic_core* core = nullptr;
  answers.take(haptic_core_create(scene.data(), scene.size(), nullptr, info.memory_bytes, &core),
               HAPTIC_ERROR_NULL);
  answers.take(
      haptic_core_create(scene.data(), scene.size(), memory.at, info.memory_bytes, nullptr),
      HAPTIC_ERROR_NULL);
  answers.take(
      haptic_core_create(scene.data(), scene.size(), memory.at + 8, info.memory_bytes, &core),
      HAPTIC_ERROR_MEMORY);
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{64}, info.memory_bytes - 1})
    answers.take(haptic_core_create(scene.data(), scene.size(), memory.at, bytes, &core),
                 HAPTIC_ERROR_MEMORY);
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
  haptic_replay replay = HAPTIC_REPLAY_INIT;
  replay.poses = input.pose;
  replay.count = 1;
  // Memory that never was a core.
  auto* const none = reinterpret_cast<haptic_core*>(memory.at);
  haptic_verdict verdict = HAPTIC_VERDICT_INIT;
  answers.take(haptic_core_step(none, &input, &output), HAPTIC_ERROR_HANDLE);
  answers.take(haptic_core_reset(none), HAPTIC_ERROR_HANDLE);
  const CoreBench bench;
  for (haptic_core* bad : {static_cast<haptic_core*>(nullptr), none}) {
    const int expected = bad == nullptr ? HAPTIC_ERROR_NULL : HAPTIC_ERROR_HANDLE;
    answers.take(haptic_core_step(bad, &input, &output), expected);
    answers.take(haptic_core_replay(bad, &replay), expected);
    answers.take(haptic_core_reset(bad), expected);
    answers.take(haptic_core_verdict(bad, &verdict), expected);
    answers.take(haptic_core_close(bad), expected);
  }
  answers.take(haptic_core_step(bench.core(), nullptr, &output), HAPTIC_ERROR_NULL);
  answers.take(haptic_core_step(bench.core(), &input, nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_core_replay(bench.core(), nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_core_verdict(bench.core(), nullptr), HAPTIC_ERROR_NULL);
  for (haptic_verdict& wrong : of_unknown_sizes(verdict))
    answers.take(haptic_core_verdict(bench.core(), &wrong), HAPTIC_ERROR_VERSION);
  for (const haptic_step_input& wrong : of_unknown_sizes(input))
    answers.take(haptic_core_step(bench.core(), &wrong, &output), HAPTIC_ERROR_VERSION);
  for (haptic_step_output& wrong : of_unknown_sizes(output))
    answers.take(haptic_core_step(bench.core(), &input, &wrong), HAPTIC_ERROR_VERSION);
  for (haptic_replay& wrong : of_unknown_sizes(replay))
    answers.take(haptic_core_replay(bench.core(), &wrong), HAPTIC_ERROR_VERSION);
  for (const double bad : kBadNumbers) {
    haptic_step_input wrong = input;
    wrong.time_s = bad;
    answers.take(haptic_core_step(bench.core(), &wrong, &output), HAPTIC_ERROR_NUMBER);
    for (int k = 0; k < 7; ++k) {
      if (bad == -1.0) continue;  // a position, or one half of a turn
      wrong = input;
      wrong.pose[k] = bad;
      answers.take(haptic_core_step(bench.core(), &wrong, &output), HAPTIC_ERROR_POSE);
      CHECK(output.wrench[0] == 0);
      replay.poses = wrong.pose;
      answers.take(haptic_core_replay(bench.core(), &replay), HAPTIC_ERROR_POSE);
    }
  }
  replay.count = 0;
  answers.take(haptic_core_replay(bench.core(), &replay), HAPTIC_ERROR_SIZE);
  replay.poses = nullptr;
  answers.take(haptic_core_replay(bench.core(), &replay), HAPTIC_ERROR_NULL);
  REQUIRE(haptic_core_close(bench.core()) == HAPTIC_OK);
  replay.poses = input.pose;
  replay.count = 1;
  for (int k = 0; k < 10; ++k) {
    answers.take(haptic_core_step(bench.core(), &input, &output), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_core_replay(bench.core(), &replay), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_core_reset(bench.core()), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_core_close(bench.core()), HAPTIC_ERROR_CLOSED);
  }
}

void sessions_wrong(Answers& answers) {
  const std::span<const std::byte> scene = block_scene();
  const haptic_session_options good = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_session* session = nullptr;
  const auto open_with = [&](const std::function<void(haptic_session_options&)>& spoil,
                             int expected) {
    haptic_session_options options = good;
    spoil(options);
    answers.take(haptic_session_open(scene.data(), scene.size(), &options, &session), expected);
    CHECK(session == nullptr);
  };
  answers.take(haptic_session_open(nullptr, scene.size(), &good, &session), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_open(scene.data(), 0, &good, &session), HAPTIC_ERROR_SIZE);
  answers.take(haptic_session_open(scene.data(), scene.size(), nullptr, &session),
               HAPTIC_ERROR_NULL);
  answers.take(haptic_session_open(scene.data(), scene.size(), &good, nullptr), HAPTIC_ERROR_NULL);
  for (const haptic_session_options& wrong : of_unknown_sizes(good))
    answers.take(haptic_session_open(scene.data(), scene.size(), &wrong, &session),
                 HAPTIC_ERROR_VERSION);
  open_with([](auto& o) { o.device = nullptr; }, HAPTIC_ERROR_NULL);
  open_with([](auto& o) { o.device = ""; }, HAPTIC_ERROR_DEVICE);
  open_with([](auto& o) { o.device = "falcon 9"; }, HAPTIC_ERROR_DEVICE);
  open_with([](auto& o) { o.priority = -1; }, HAPTIC_ERROR_NUMBER);
  open_with([](auto& o) { o.priority = 100; }, HAPTIC_ERROR_NUMBER);
  open_with([](auto& o) { o.hold = 3; }, HAPTIC_ERROR_NUMBER);
  for (const double bad : kBadNumbers) {
    open_with([&](auto& o) { o.rate_hz = bad; }, HAPTIC_ERROR_NUMBER);
    open_with([&](auto& o) { o.history_s = bad; }, HAPTIC_ERROR_NUMBER);
  }
  // More than a gigabyte of ticks.
  open_with([](auto& o) { o.history_s = 3600, o.rate_hz = 10'000; }, HAPTIC_ERROR_NUMBER);
  REQUIRE(haptic_session_open(scene.data(), scene.size(), &good, &session) == HAPTIC_OK);
  haptic_state state = HAPTIC_STATE_INIT;
  haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
  haptic_tick tick{};
  std::size_t count = 0;
  answers.take(haptic_session_state(nullptr, &state), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_state(session, nullptr), HAPTIC_ERROR_NULL);
  haptic_gains gains = HAPTIC_GAINS_INIT;
  answers.take(haptic_session_gains(nullptr, &gains), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_gains(session, nullptr), HAPTIC_ERROR_NULL);
  for (haptic_gains& wrong : of_unknown_sizes(gains))
    answers.take(haptic_session_gains(session, &wrong), HAPTIC_ERROR_VERSION);
  answers.take(haptic_session_history(nullptr, &tick, 1, sizeof tick, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_history(session, nullptr, 1, sizeof tick, &count), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_history(session, &tick, 1, sizeof tick, nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_history(session, &tick, 0, sizeof tick, &count), HAPTIC_ERROR_SIZE);
  answers.take(haptic_session_history(session, &tick, 1, 8, &count), HAPTIC_ERROR_VERSION);
  answers.take(haptic_session_move_hand(nullptr, &goal, nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_move_hand(session, nullptr, nullptr), HAPTIC_ERROR_NULL);
  for (haptic_state& wrong : of_unknown_sizes(state))
    answers.take(haptic_session_state(session, &wrong), HAPTIC_ERROR_VERSION);
  for (const haptic_hand_goal& wrong : of_unknown_sizes(goal))
    answers.take(haptic_session_move_hand(session, &wrong, nullptr), HAPTIC_ERROR_VERSION);
  for (const double bad : kBadNumbers) {
    haptic_hand_goal wrong = goal;
    wrong.seconds = bad;
    answers.take(haptic_session_move_hand(session, &wrong, nullptr), HAPTIC_ERROR_NUMBER);
    if (bad == -1.0) continue;
    for (int k = 0; k < 7; ++k) {
      wrong = goal;
      wrong.pose[k] = bad;
      answers.take(haptic_session_move_hand(session, &wrong, nullptr), HAPTIC_ERROR_POSE);
    }
  }
  haptic_frame frame = HAPTIC_FRAME_INIT;
  answers.take(haptic_session_frame(nullptr, &frame), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_frame(session, nullptr), HAPTIC_ERROR_NULL);
  for (const haptic_frame& wrong : of_unknown_sizes(frame))
    answers.take(haptic_session_frame(session, &wrong), HAPTIC_ERROR_VERSION);
  for (const double bad : kBadNumbers) {
    for (double haptic_frame::*member : {&haptic_frame::fastest_m_per_s,
                                         &haptic_frame::fastest_rad_per_s, &haptic_frame::late_s}) {
      haptic_frame wrong = frame;
      wrong.*member = bad;
      answers.take(haptic_session_frame(session, &wrong), HAPTIC_ERROR_NUMBER);
    }
    if (bad == -1.0) continue;
    for (int k = 0; k < 7; ++k) {
      haptic_frame wrong = frame;
      wrong.pose[k] = bad;
      answers.take(haptic_session_frame(session, &wrong), HAPTIC_ERROR_POSE);
    }
  }
  answers.take(haptic_session_hold(nullptr, 1), HAPTIC_ERROR_NULL);
  for (const int none : {-1, 3, 1 << 20})
    answers.take(haptic_session_hold(session, none), HAPTIC_ERROR_NUMBER);
  answers.take(haptic_session_stop(nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_close(nullptr), HAPTIC_ERROR_NULL);
  answers.take(haptic_session_free(nullptr), HAPTIC_ERROR_NULL);
  REQUIRE(haptic_session_close(session) == HAPTIC_OK);
  for (int k = 0; k < 10; ++k) {
    answers.take(haptic_session_move_hand(session, &goal, nullptr), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_session_hold(session, 1), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_session_frame(session, &frame), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_session_stop(session), HAPTIC_ERROR_CLOSED);
    answers.take(haptic_session_close(session), HAPTIC_ERROR_CLOSED);
  }
  REQUIRE(haptic_session_free(&session) == HAPTIC_OK);
  answers.take(haptic_session_state(session, &state), HAPTIC_ERROR_NULL);  // freed: null
  CHECK(haptic_session_free(&session) == HAPTIC_OK);
}

}  // namespace

TEST_SUITE("tools.library_wrong_calls") {
  TEST_CASE("a thousand wrong calls are answered with an error number") {
    Answers answers;
    compile_wrong(answers);
    plan_wrong(answers);
    messages_wrong(answers);
    scenes_wrong(answers);
    cores_wrong(answers);
    sessions_wrong(answers);
    CHECK(answers.calls >= 1000);
  }

  TEST_CASE("two threads on one core: each call is done or busy, and none is lost") {
    const CoreBench bench;
    std::atomic<int> done{0}, busy{0}, other{0};
    const auto work = [&] {
      haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
      haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
      for (int k = 0; k < 3000; ++k) {
        input.pose[2] = 0.02 - 1e-6 * k;
        const int error = haptic_core_step(bench.core(), &input, &output);
        (error == HAPTIC_OK ? done : error == HAPTIC_ERROR_BUSY ? busy : other) += 1;
      }
    };
    std::thread first(work), second(work);
    first.join();
    second.join();
    CHECK(other == 0);
    CHECK(done + busy == 6000);
    CHECK(done >
          0);  // how many is the scheduler's affair: one that stops inside makes the other busy
  }

  TEST_CASE("two threads on one session while it is closed: done or closed") {
    const haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    haptic_session* session = nullptr;
    REQUIRE(haptic_session_open(block_scene().data(), block_scene().size(), &options, &session) ==
            HAPTIC_OK);
    std::atomic<int> wrong{0}, refused{0};
    const auto note = [&](int error) {
      if (error == HAPTIC_ERROR_CLOSED) refused += 1;
      if (error != HAPTIC_OK && error != HAPTIC_ERROR_CLOSED) wrong += 1;
    };
    const auto work = [&] {
      haptic_state state = HAPTIC_STATE_INIT;
      haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
      const haptic_frame frame = HAPTIC_FRAME_INIT;
      std::vector<haptic_tick> ticks(50);
      std::size_t count = 0;
      for (int k = 0; refused == 0 || k < 200; ++k) {
        goal.pose[2] = 0.01 + 1e-5 * (k % 100);
        note(haptic_session_move_hand(session, &goal, nullptr));
        note(haptic_session_hold(session, k % 2));
        note(haptic_session_frame(session, &frame));
        note(haptic_session_history(session, ticks.data(), 50, sizeof ticks[0], &count));
        note(haptic_session_state(session, &state));
        note(haptic_session_stop(session));
      }
    };
    std::thread first(work), second(work);
    haptic_state state = HAPTIC_STATE_INIT;
    while (state.tick < 50) note(haptic_session_state(session, &state));
    note(haptic_session_close(session));
    first.join();
    second.join();
    CHECK(wrong == 0);
    CHECK(refused > 0);
    CHECK(haptic_session_free(&session) == HAPTIC_OK);
  }
}
