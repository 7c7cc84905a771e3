// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/page_file.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kLargestPage_bytes = std::size_t{64} << 20;
constexpr char kRecordingMagic[8] = {'R', 'T', 'V', 'I', 'E', 'W', '1', '\0'};

/// Head of the recording in the page; the ticks follow.
struct RecordingHead {
  char magic[8] = {};
  std::uint32_t ticks = 0;
  std::uint32_t accepted = 0;  ///< 1: each tick has the accepted wrench
};
static_assert(sizeof(RecordingHead) == 16);

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

/// Puts `text` in the place of `mark`, which stands in the page once.
void fill(std::string& page, const std::string& mark, const std::string& text) {
  const std::size_t at = page.find(mark);
  if (at == std::string::npos)
    throw tools::InputError("the page has no place for " + mark + "; build it again: tools/view");
  page.replace(at, mark.size(), text);
}

template <typename Plain>
void append(std::vector<std::byte>& bytes, const Plain& value) {
  const auto part = std::as_bytes(std::span(&value, 1));
  bytes.insert(bytes.end(), part.begin(), part.end());
}

constexpr const char* kConnect = "@CONNECT@";

std::string page_with_scene(const std::string& page, const SceneView& scene,
                            std::string_view about) {
  std::string filled = page;
  const SceneParameters& p = scene.parameters();
  fill(filled, "@TITLE@", escaped(scene.text(p.name_offset, p.name_bytes)));
  fill(filled, "@ABOUT@", escaped(about));
  fill(filled, "@SCENE@", base64(scene.blob()));
  return filled;
}

}  // namespace

RecordedTick recorded_tick(const MotionSample& sample, std::uint64_t tick,
                           std::uint64_t state_hash) {
  const StepInput input = input_of(sample, tick);
  RecordedTick recorded;
  recorded.stamp_ns = input.stamp_ns;
  for (int axis = 0; axis < 3; ++axis)
    recorded.p_wa_m[axis] = static_cast<double>(input.pose_wa.p_wa[axis]);
  for (int k = 0; k < 4; ++k)
    recorded.q_wa_xyzw[k] = static_cast<double>(input.pose_wa.q_wa.coeffs()[k]);
  recorded.state_hash = state_hash;
  return recorded;
}

RecordedTick recorded_tick(const LoopRecord& record, double rate_hz) {
  RecordedTick recorded;
  recorded.stamp_ns = loop_stamp_ns(record.tick.tick, rate_hz);
  for (int axis = 0; axis < 3; ++axis) {
    recorded.p_wa_m[axis] = static_cast<double>(record.device_wa.p_wa[axis]);
    recorded.accepted_w[axis] = static_cast<double>(record.accepted_w.force_w[axis]);
    recorded.accepted_w[3 + axis] = static_cast<double>(record.accepted_w.torque_w[axis]);
  }
  for (int k = 0; k < 4; ++k)
    recorded.q_wa_xyzw[k] = static_cast<double>(record.device_wa.q_wa.coeffs()[k]);
  recorded.state_hash = record.tick.state_hash;
  recorded.accepted_valid = true;
  return recorded;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t there = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i)
      group = group << 8 | (i < there ? std::to_integer<std::uint32_t>(bytes[k + i]) : 0u);
    for (std::size_t i = 0; i < 4; ++i)
      text += i <= there ? kDigits[group >> (18 - 6 * i) & 63u] : '=';
  }
  return text;
}

std::string read_page() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) throw tools::OsError("/proc/self/exe: " + error.message());
  const std::filesystem::path page =
      self.parent_path().parent_path() / "share" / "haptic_view" / "page.html";
  if (!std::filesystem::exists(page)) {
    throw tools::OsError(page.string() +
                         ": the page has not been built; run tools/view, which installs what it "
                         "needs: nodejs npm clang-16 llvm-16 lld-16 wasi-libc "
                         "libc++-16-dev-wasm32 libc++abi-16-dev-wasm32 libclang-rt-16-dev-wasm32");
  }
  return tools::read_text_file(page, kLargestPage_bytes, "the page");
}

std::string filled_page(const std::string& page, const SceneView& scene,
                        std::span<const RecordedTick> ticks, std::string_view about) {
  std::string filled = page_with_scene(page, scene, about);
  fill(filled, kConnect, "'none'");
  fill(filled, "@LIVE@", "");
  std::string recording;
  if (!ticks.empty()) {
    RecordingHead head;
    std::memcpy(head.magic, kRecordingMagic, sizeof kRecordingMagic);
    head.ticks = static_cast<std::uint32_t>(ticks.size());
    head.accepted = ticks.front().accepted_valid ? 1 : 0;
    std::vector<std::byte> bytes;
    append(bytes, head);
    for (const RecordedTick& tick : ticks) {
      append(bytes, tick.stamp_ns);
      append(bytes, tick.p_wa_m);
      append(bytes, tick.q_wa_xyzw);
      append(bytes, tick.state_hash);
      if (head.accepted != 0) append(bytes, tick.accepted_w);
    }
    recording = base64(bytes);
  }
  fill(filled, "@RECORDING@", recording);
  return filled;
}

std::string live_page(const std::string& page, const SceneView& scene, const LivePage& live) {
  std::string filled = page_with_scene(page, scene, {});
  const nlohmann::json facts = {{"takesHand", live.takes_hand},
                                {"whyNotCompared", live.why_not_compared}};
  fill(filled, "@LIVE@", facts.dump());
  fill(filled, "@RECORDING@", "");
  return filled;
}

std::string connected_page(const std::string& live_page, const std::string& host) {
  std::string page = live_page;
  fill(page, kConnect, "'self' ws://" + host);
  return page;
}

std::vector<RecordedTick> record_motion(CoreSession& session,
                                        std::span<const MotionSample> motion) {
  std::vector<RecordedTick> ticks;
  ticks.reserve(motion.size());
  session.core().reset();
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const StepResult result = session.core().step(input_of(motion[k], k));
    ticks.push_back(recorded_tick(motion[k], k, result.state_hash));
  }
  return ticks;
}

}  // namespace haptic::sim
