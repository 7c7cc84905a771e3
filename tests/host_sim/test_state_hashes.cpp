// SPDX-License-Identifier: Apache-2.0
// The project's own scenes, from the mesh to the last tick, give the bits of
// tests/golden/state_hashes.json with every compiler and build type. See tests/golden/README.md.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "host_sim/session/other_motion.hpp"
#include "host_sim/session/replay.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kGoldenFile = HAPTIC_TEST_DIR "/golden/state_hashes.json";
constexpr const char* kScalar = sizeof(Real) == sizeof(float) ? "float" : "double";
constexpr std::size_t kBlockTicks = 500;

/// FNV-1a over bytes and little-endian words.
class Fnv {
 public:
  void add(std::span<const std::byte> bytes) {
    for (const std::byte b : bytes)
      hash_ = (hash_ ^ std::to_integer<std::uint64_t>(b)) * 0x100000001b3ull;
  }
  void add(std::uint64_t word) {
    for (int shift = 0; shift < 64; shift += 8)
      hash_ = (hash_ ^ ((word >> shift) & 0xffu)) * 0x100000001b3ull;
  }
  [[nodiscard]] std::string text() const {
    constexpr char kHex[] = "0123456789abcdef";
    std::string text;
    for (int shift = 60; shift >= 0; shift -= 4) text += kHex[(hash_ >> shift) & 15u];
    return text;
  }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

/// What the golden file keeps of one scene with one scalar. Each hash of `run` covers all ticks so
/// far, so that a difference that heals again stays visible.
struct RunHashes {
  std::size_t scene_bytes = 0, ticks = 0;
  std::string scene, motion;
  std::vector<std::string> run;  ///< after every kBlockTicks ticks, and after the last
};

RunHashes hashes_of(const tools::CompiledScene& scene, const std::vector<MotionSample>& motion,
                    const std::vector<TickRecord>& ticks) {
  RunHashes h;
  Fnv bytes, samples, run;
  bytes.add(scene.bytes);
  static_assert(sizeof(MotionSample) == 8 * sizeof(double), "no padding among the hashed bytes");
  samples.add(std::as_bytes(std::span(motion)));
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    run.add(ticks[i].state_hash);
    if ((i + 1) % kBlockTicks == 0 || i + 1 == ticks.size()) h.run.push_back(run.text());
  }
  h.scene_bytes = scene.bytes.size();
  h.ticks = ticks.size();
  h.scene = bytes.text();
  h.motion = samples.text();
  return h;
}

Json to_json(const RunHashes& h) {
  return {{"scene_bytes", h.scene_bytes},
          {"scene", h.scene},
          {"motion", h.motion},
          {"ticks", h.ticks},
          {"run", h.run}};
}

RunHashes from_json(const Json& json) {
  RunHashes h;
  h.scene_bytes = json.at("scene_bytes").get<std::size_t>();
  h.ticks = json.at("ticks").get<std::size_t>();
  h.scene = json.at("scene").get<std::string>();
  h.motion = json.at("motion").get<std::string>();
  h.run = json.at("run").get<std::vector<std::string>>();
  return h;
}

/// The first difference in the order of the chain (scene, motion, ticks), since what follows it
/// differs as a matter of course; empty when there is none.
std::string difference(const std::string& scene, const RunHashes& golden, const RunHashes& got) {
  const std::string head = scene + " (" + kScalar + "): ";
  const auto changed = [&](const char* what, const std::string& from, const std::string& to) {
    return head + what + ": expected " + from + ", got " + to;
  };
  if (golden.scene_bytes != got.scene_bytes) {
    return changed("bytes of the compiled scene", std::to_string(golden.scene_bytes),
                   std::to_string(got.scene_bytes));
  }
  if (golden.scene != got.scene) return changed("compiled scene", golden.scene, got.scene);
  if (golden.motion != got.motion) return changed("motion", golden.motion, got.motion);
  if (golden.ticks != got.ticks) {
    return changed("ticks", std::to_string(golden.ticks), std::to_string(got.ticks));
  }
  if (golden.run.size() != got.run.size()) {
    return changed("blocks of ticks", std::to_string(golden.run.size()),
                   std::to_string(got.run.size()));
  }
  for (std::size_t k = 0; k < got.run.size(); ++k) {
    if (golden.run[k] == got.run[k]) continue;
    const std::size_t last = std::min((k + 1) * kBlockTicks, got.ticks) - 1;
    return changed(("state, first in one of the ticks " + std::to_string(k * kBlockTicks) + " to " +
                    std::to_string(last))
                       .c_str(),
                   golden.run[k], got.run[k]);
  }
  return {};
}

std::vector<std::string> own_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(HAPTIC_SCENES_DIR)) {
    if (entry.is_directory()) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

tools::CompiledScene compiled(const std::filesystem::path& folder) {
  return tools::compile_scene(tools::read_scene_file(folder / "scene.toml"), {});
}

/// The motions of a scene's driven parts: each in the file that has the part's name.
std::vector<std::string> drives_of(const CoreSession& session,
                                   const std::filesystem::path& folder) {
  std::vector<std::string> drives;
  if (session.parts() == nullptr) return drives;
  for (const DrivenRecord& driven : session.parts()->driven()) {
    const std::string part(session.parts()->name(driven.part));
    drives.push_back(part + "=" + (folder / (part + ".toml")).string());
  }
  return drives;
}

/// The motion of a second hand, in the file that has its part's name; else empty.
std::vector<MotionSample> second_motion(const CoreSession& session,
                                        const std::filesystem::path& folder) {
  if (session.parts() == nullptr || session.parts()->hands() == 1) return {};
  const std::string part(session.parts()->name(1));
  return make_motion(read_motion_script((folder / (part + ".toml")).string()));
}

/// One tick of all hands. @return of the first, with the hash of both.
StepResult step_hands(CoreSession& session, const MotionSample& sample, const MotionSample* second,
                      std::uint64_t tick) {
  const StepInput input = input_of(sample, tick);
  if (second == nullptr) return session.step(input);
  const StepInput other = input_of(*second, tick);
  const Hands::Each<StepResult> results = session.step_both({&input, &other});
  StepResult both = results[0];
  both.state_hash ^= results[1].state_hash << 1;
  return both;
}

/// With holds, driven parts and a second hand, where the scene has them.
std::vector<TickRecord> run_ticks(CoreSession& session, const MotionScript& script,
                                  const std::vector<MotionSample>& motion,
                                  const std::vector<MotionSample>& second,
                                  const std::vector<std::string>& drives) {
  OtherMotion others(session, script.holds, drives);
  std::vector<TickRecord> ticks;
  for (const MotionSample& sample : motion) {
    others.before_tick(sample.t_s);
    const MotionSample* const other =
        second.empty() ? nullptr : &second[std::min(ticks.size(), second.size() - 1)];
    const StepResult result = step_hands(session, sample, other, ticks.size());
    ticks.push_back(tools::record_of(ticks.size(), sample.t_s, result,
                                     session.view().parameters().law, session.hand()->grip_a()));
    others.after_tick(ticks.back());
  }
  CHECK(others.failures() == "");
  return ticks;
}

RunHashes run_scene(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / name;
  const tools::CompiledScene scene = compiled(folder);
  const MotionScript script = read_motion_script((folder / "motion.toml").string());
  const std::vector<MotionSample> motion = make_motion(script);
  CoreSession session(scene.bytes, name);
  const std::vector<std::string> drives = drives_of(session, folder);
  const std::vector<MotionSample> second = second_motion(session, folder);
  const bool is_plain = script.holds.empty() && drives.empty() && second.empty();
  const std::vector<TickRecord> ticks = is_plain
                                            ? replay(session, motion, {}).ticks
                                            : run_ticks(session, script, motion, second, drives);
  const auto touching = std::count_if(ticks.begin(), ticks.end(), [](const TickRecord& t) {
    return t.d_near_m <= 0 ||  // a surface has no depth
           t.situation != ContactSituation::kNone;
  });
  CHECK(touching > 1000);  // the hashes are of contact, not of free flight
  return hashes_of(scene, motion, ticks);
}

Json read_golden() {
  std::ifstream stream(kGoldenFile);
  return stream ? Json::parse(stream) : Json::object();
}

}  // namespace

TEST_SUITE("host_sim.state_hashes") {
  TEST_CASE("own scenes: compiled bytes, motion and every tick have the golden bits") {
    const Json golden = read_golden();
    const std::vector<std::string> names = own_scenes();
    REQUIRE(golden.contains("scenes"));
    CHECK(golden["scenes"].size() == names.size());
    for (const std::string& name : names) {
      CAPTURE(name);
      REQUIRE(golden["scenes"].contains(name));
      REQUIRE(golden["scenes"][name].contains(kScalar));
      const RunHashes got = run_scene(name);
      MESSAGE(name, " ", std::string(kScalar), ": scene ", got.scene, ", motion ", got.motion, ", ",
              got.ticks, " ticks ", got.run.back());
      const std::string found = difference(name, from_json(golden["scenes"][name][kScalar]), got);
      CHECK_MESSAGE(found.empty(), found);
    }
  }

  TEST_CASE("a difference is named with its scene, its kind and the ticks it began in") {
    tools::CompiledScene scene;
    scene.bytes.resize(64);
    std::vector<MotionSample> motion(1234);
    std::vector<TickRecord> ticks(1234);
    for (std::size_t i = 0; i < ticks.size(); ++i) ticks[i].state_hash = i * i;
    const RunHashes golden = hashes_of(scene, motion, ticks);
    CHECK(golden.run.size() == 3);
    CHECK(difference("peg", golden, from_json(to_json(golden))).empty());

    const auto found = [&] { return difference("peg", golden, hashes_of(scene, motion, ticks)); };
    ticks[499].state_hash ^= 1;
    CHECK(found().find("state, first in one of the ticks 0 to 499") != std::string::npos);
    ticks[499].state_hash ^= 1;
    ticks[500].state_hash ^= 1ull << 63;
    CHECK(found().find("ticks 500 to 999") != std::string::npos);
    ticks[500].state_hash ^= 1ull << 63;
    ticks.back().state_hash ^= 1;
    CHECK(found().find("ticks 1000 to 1233") != std::string::npos);
    motion[7].p[2] = -0.0;  // one bit
    CHECK(found().find("motion: expected") != std::string::npos);
    scene.bytes[63] = std::byte{1};
    CHECK(found().find("peg (") == 0);
    CHECK(found().find("compiled scene: expected") != std::string::npos);
    scene.bytes.pop_back();
    CHECK(found().find("bytes of the compiled scene: expected 64, got 63") != std::string::npos);
  }

  TEST_CASE("the compiled bytes do not depend on the folder that the scene lies in") {
    const std::string name = own_scenes().front();
    const auto copy =
        std::filesystem::temp_directory_path() / ("haptic_elsewhere_" + std::to_string(::getpid()));
    std::filesystem::copy(std::filesystem::path(HAPTIC_SCENES_DIR) / name, copy,
                          std::filesystem::copy_options::recursive);
    const bool same =
        compiled(copy).bytes == compiled(std::filesystem::path(HAPTIC_SCENES_DIR) / name).bytes;
    std::filesystem::remove_all(copy);
    CHECK(same);
  }

  // Not a test: run by hand, see tests/golden/README.md. The other scalar's values stay.
  TEST_CASE("rewrite the golden file" * doctest::skip()) {
    const Json before = read_golden();
    Json after;
    after["note"] = "FNV-1a hashes; see README.md";
    after["block_ticks"] = kBlockTicks;
    after["scenes"] = Json::object();
    for (const std::string& name : own_scenes()) {
      Json& entry = after["scenes"][name] = Json::object();
      const Json::json_pointer place("/scenes/" + name);
      for (const char* scalar : {"double", "float"}) {
        if (std::strcmp(scalar, kScalar) == 0) {
          entry[scalar] = to_json(run_scene(name));
        } else if (before.contains(place) && before[place].contains(scalar)) {
          entry[scalar] = before[place][scalar];
        }
      }
    }
    std::ofstream(kGoldenFile) << after.dump(1) << '\n';
    MESSAGE("wrote ", std::string(kGoldenFile));
  }
}
