// SPDX-License-Identifier: Apache-2.0
// host_sim play FILE --scene S.rtscene [--device FILE] [--delay N] [--html FILE] [--json]
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/usb/bus_record.hpp"
#include "host_sim/commands/commands.hpp"
#include "host_sim/device/bus_player.hpp"
#include "host_sim/device/loop_run.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/view/core_tape.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::sim {
namespace {

struct PlayArguments {
  std::string file, scene, html, device;
  std::optional<unsigned> delay;
  bool json = false;
};

/// A scene that names no device was recorded with gains that the run's device holds: the same are
/// found from the same device. A scene that was recorded as it is stays so.
void fit_as_recorded(const PlayArguments& o, CoreSession& session,
                     std::span<const std::uint8_t> file) {
  hal::BusSession recorded;
  std::size_t first = 0;
  if (!hal::read_header(file, recorded, first).text.empty()) return;  // play_session says so
  if (recorded.scene_hash == session.view().header().content_hash || recorded.period_ns <= 0)
    return;
  const double rate_hz = 1e9 / static_cast<double>(recorded.period_ns);
  DeviceModel device = o.device.empty() ? device_of(session.view().parameters(), rate_hz)
                                        : read_device_file(o.device, rate_hz);
  if (o.delay) device.delay_samples = *o.delay;
  (void)fit_to_device(session, device, rate_hz, recorded.report_clocked ? 0 : 1 / rate_hz);
}

/// True if driven parts moved, or the hand took one part after another.
bool gives_parts(std::span<const std::uint8_t> file) {
  hal::BusSession recorded;
  std::size_t first = 0;
  if (!hal::read_header(file, recorded, first).text.empty()) return false;
  hal::BusRecordReader reader(file, first);
  hal::BusRecord record;
  while (reader.next(record)) {
    if (record.is_given()) return true;
  }
  return false;
}

/// The session that was played, and that it was another one.
std::string verdict_text(const PlayResult& played, const tools::SessionVerdict& verdict) {
  return std::string(
      tools::verdict_line(verdict, played.diverged ? "other bits than recorded" : "").view());
}

nlohmann::ordered_json account(const PlayArguments& o, const PlayResult& played,
                               const tools::SessionVerdict& verdict) {
  nlohmann::ordered_json json;
  json["recording"] = o.file;
  json["scene"] = o.scene;
  json["duration_s"] = played.duration_s;
  json["ticks"] = played.ticks;
  json["reports"] = played.reports;
  json["sends"] = played.sends;
  json["connects"] = played.connects;
  json["ticks_beyond"] = played.ticks_beyond;
  json["complete"] = played.complete;
  json["equal"] = !played.diverged;
  if (played.diverged)
    json["divergence"] = {{"tick", played.tick},
                          {"record", played.record},
                          {"offset", played.offset},
                          {"text", played.text}};
  json["verdict"] = tools::verdict_json(verdict, verdict_text(played, verdict));
  return json;
}

void print(const PlayArguments& o, const PlayResult& played) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%s: %.3f s, %llu ticks, %llu reports, %llu sends, %llu connections\n",
              o.file.c_str(), played.duration_s, number(played.ticks), number(played.reports),
              number(played.sends), number(played.connects));
  if (played.ticks_beyond > 0)
    std::printf("  not compared: %llu ticks after the end of the link\n",
                number(played.ticks_beyond));
  if (!played.diverged) {
    std::printf("  every tick and every send equal\n");
    return;
  }
  std::printf("  DIVERGED at tick %llu, record %llu at byte %llu%s\n", number(played.tick),
              number(played.record), number(played.offset), played.text.c_str());
}

int do_play(const PlayArguments& o) {
  const std::string page = o.html.empty() ? std::string() : tools::read_page();
  CoreSession session(o.scene);
  const std::vector<std::uint8_t> file = read_recording(o.file);
  if (!o.html.empty() && gives_parts(file))
    throw tools::UsageError(
        "--html: a page computes no ticks again in which driven parts move or the hand takes "
        "another part, and " +
        o.file + " has such; leave it out, or give the motions to 'run --html' without --carrier");
  tools::claim_output(o.html, "--html", {tools::FileFormat::kHtml, {}});
  fit_as_recorded(o, session, file);
  std::optional<CoreTape> tape;
  tools::SessionJudge judge(session.view());
  const PlayWatch watch = [&](const ServoParameters& parameters, const ServoInput& input,
                              const ServoResult& result) {
    if (result.rendered_new) judge.take(result.rendered);
    if (o.html.empty()) return;
    if (!tape) tape.emplace(session.view(), parameters);
    (void)tape->take(input, result);
  };
  const PlayResult played = play_session(session, file, o.file, watch);
  if (tape) write_whole_file(o.html, tools::filled_page(page, session.view(), tape->ticks()));
  if (o.json) {
    std::printf("%s\n", account(o, played, judge.verdict()).dump(2).c_str());
  } else {
    print(o, played);
    std::printf("%s\n", verdict_text(played, judge.verdict()).c_str());
  }
  if (played.diverged || (played.complete && judge.verdict().failed()))
    return tools::kExitCheckFailed;
  if (played.complete) return tools::kExitDone;
  std::fprintf(stderr, "host_sim: %s; equal as far as it goes\n", played.cut.c_str());
  return tools::kExitBadInput;
}

}  // namespace

Command add_play_command(CLI::App& program) {
  const auto o = std::make_shared<PlayArguments>();
  CLI::App* app = program.add_subcommand(
      "play", "Plays a recorded session through link, guard, servo tick and core: same bits?");
  app->add_option("file", o->file, "recording (.hrec) of run --record or a device program")
      ->required();
  app->add_option("--scene", o->scene, "compiled scene (.rtscene) that it was recorded with")
      ->required();
  app->add_option("--device", o->device, "as of the run, where that had one: its device model");
  app->add_option("--delay", o->delay, "as of the run, where that had one")
      ->check(CLI::Range(0u, kMaxDelaySamples));
  app->add_option("--html", o->html,
                  "page to write: the ticks of its core to see, computed again in the browser");
  app->add_flag("--json", o->json, "account as JSON on stdout");
  return {app, [o] { return do_play(*o); }, "host_sim play session.hrec --scene peg.rtscene"};
}

}  // namespace haptic::sim
