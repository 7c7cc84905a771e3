// SPDX-License-Identifier: Apache-2.0
// host_sim replay --scene S.rtscene --motion M.csv [--out O.csv] [--plot O.svg] [--contacts C.csv]
// [--html O.html] [--json] [--check] [--literal]
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "host_sim/commands/commands.hpp"
#include "host_sim/motion_log/log_judgement.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/contact_log.hpp"
#include "host_sim/session/contact_reference.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/drive_tape.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "host_sim/session/replay.hpp"
#include "host_sim/session/replay_plot.hpp"
#include "host_sim/session/replay_summary.hpp"
#include "host_sim/view/recorded_ticks.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {
namespace {

struct ReplayArguments {
  std::string scene, motion, out, plot, html, contacts, reference;
  std::vector<std::string> drives;
  bool json = false, check = false, literal = false;
  DeltaReading delta = DeltaReading::kTranslationAndRotation;
};

/// Half of the smallest distance in time of two ticks: a reference sample belongs to at most one.
double half_period_s(const std::vector<MotionSample>& motion) {
  double period = 1.0;
  for (std::size_t i = 1; i < motion.size(); ++i)
    period = std::min(period, motion[i].t_s - motion[i - 1].t_s);
  return 0.5 * period;
}

void write_page(const std::string& path, const std::string& page, const SceneView& scene,
                std::span<const MotionSample> motion, std::span<const TickRecord> ticks,
                const DriveTape& tape) {
  std::vector<tools::RecordedTick> recorded;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    recorded.push_back(recorded_tick(motion[k], ticks[k].tick, ticks[k].state_hash));
    tape.mark(recorded.back(), k);
  }
  write_whole_file(path, tools::filled_page(page, scene, recorded, {}, tape.given()));
}

/// @throws tools::InputError when `option` needs the contact at the device's pose, which the scene
/// has no room for.
void require_goal_contact(const CoreSession& session, const std::string& scene,
                          const std::string& option) {
  if (has_goal_contact(session.view().parameters())) return;
  std::string fix =
      "leave it out; the felt part of a surface is checked, triangle by triangle, by "
      "host_lab surface-fuzz SCENE.toml --strict";
  if (!session.view().has_facets()) {
    fix = "compile the scene with goal_contact = true in its table [rendering]";
  }
  throw tools::InputError(scene + ": " + option +
                          " needs the contact at the device's pose, which this scene does not "
                          "search; " +
                          fix);
}

int do_replay(const ReplayArguments& o) {
  tools::require_svg_name(o.plot, "--plot");
  CoreSession session(o.scene);
  const auto require_one = [&](bool asked, const char* option, const std::string& fix) {
    if (asked) require_one_moving_part(session, o.scene, std::string("replay ") + option, fix);
  };
  require_one(o.check, "--check", kJudgeBodies);
  require_one(o.literal, "--literal", "leave it out");
  require_one(!o.contacts.empty(), "--contacts", "leave it out");
  require_one(!o.reference.empty(), "--reference", "leave it out");
  if (o.check) require_goal_contact(session, o.scene, "--check");
  if (!o.reference.empty()) require_goal_contact(session, o.scene, "--reference");
  const std::vector<MotionSample> motion = read_played_motion(o.motion);
  DriveRun drives(session, read_drives(o.drives));
  MotionLog as_read;
  as_read.samples = motion;
  as_read.columns.order = QuaternionOrder::kWxyz;
  if (const auto odd = order_warning(as_read, scene_start(session.view()))) {
    std::fprintf(stderr, "host_sim: %s: %s to 'host_sim motion --from'\n", o.motion.c_str(),
                 odd->c_str());
  }
  std::vector<ReferenceSample> reference;
  if (!o.reference.empty()) reference = read_contact_reference(o.reference);
  tools::claim_output(o.out, "--out", tools::csv_kind(tick_columns(TickTable::kCsv)));
  tools::claim_output(o.plot, "--plot", {tools::FileFormat::kSvg, {}});
  tools::claim_output(o.html, "--html", {tools::FileFormat::kHtml, {}});
  tools::claim_output(o.contacts, "--contacts", tools::csv_kind(kContactCsvHeader));

  const std::string page = o.html.empty() ? std::string() : tools::read_page();

  ReplayOptions options;
  options.check = o.check;
  options.contacts = !o.contacts.empty();
  options.drives = &drives;
  DriveTape tape(false);
  if (!o.html.empty()) options.tape = &tape;
  options.progress = o.check && isatty(STDERR_FILENO) == 1;
  if (o.literal) options.literal = o.delta;
  const ReplayResult result = replay(session, motion, options);

  ReplayReport report;
  report.scene = o.scene;
  report.motion = o.motion;
  report.mode = "core";
  if (o.literal) {
    report.mode = o.delta == DeltaReading::kTranslation ? "literal steps, delta = dx"
                                                        : "literal steps, delta = dx-rotation";
  }
  report.totals = total(result.ticks, session.bounds());
  if (o.literal) {  // its own bound: every node once
    std::uint64_t nodes = 0;
    for (const PairRecord& pair : session.view().listed_pairs()) nodes += pair.node_count;
    report.totals.nodes_bound =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(nodes, UINT32_MAX));
  }
  report.check = result.check;
  report.verdict = result.verdict;
  if (!o.reference.empty()) {
    report.reference = compare_with_reference(reference, result.ticks, half_period_s(motion));
  }
  if (!o.out.empty()) write_whole_file(o.out, tick_csv(result.ticks, GuideLegs(session.view())));
  if (!o.contacts.empty()) write_whole_file(o.contacts, result.contact_csv);
  if (!o.plot.empty())
    write_whole_file(o.plot, replay_plot(result.ticks, scene_title(session.view()),
                                         session.view().parameters().exact_band_m));
  if (!o.html.empty()) write_page(o.html, page, session.view(), motion, result.ticks, tape);
  report.bounded = within_bounds(session.core().peaks(), session.bounds());
  report.driven = drives.accounts();
  report.lost = drives.failures();
  const std::string summary = o.json ? json_summary(report) : text_summary(report);
  std::fwrite(summary.data(), 1, summary.size(), stdout);
  return report.passed() ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_replay_command(CLI::App& program) {
  const auto o = std::make_shared<ReplayArguments>();
  CLI::App* app = program.add_subcommand(
      "replay", "Runs a motion through the core: force, torque, contact situation.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("motion,--motion", o->motion,
                  "motion: t,x,y,z,qw,qx,qy,qz of A's mesh frame in W")
      ->required();
  app->add_option("-o,--out", o->out, "CSV to write, one line per tick");
  app->add_option("--plot", o->plot, "SVG to write");
  CLI::Option* html = app->add_option(
      "--html", o->html, "page to write: the session to see and to move in, checked tick by tick");
  CLI::Option* contacts = app->add_option(
      "--contacts", o->contacts,
      "CSV to write: plane, polygon and basic contacts of every touching pair and tick");
  app->add_option("--drive", o->drives, kDriveHelp);
  app->add_flag("--json", o->json, "summary as JSON on stdout");
  app->add_flag("--check", o->check,
                "compare every pair of every tick with an exhaustive long double search");
  app->add_option("--reference", o->reference,
                  "contact flags to compare with: t,contact (1, 0, u)");
  CLI::Option* literal =
      app->add_flag("--literal", o->literal, "the paper's literal steps instead of the core")
          ->excludes(contacts)
          ->excludes(html);
  tools::add_choice<DeltaReading>(
      *app, "--delta", o->delta,
      {{"dx", DeltaReading::kTranslation}, {"dx-rotation", DeltaReading::kTranslationAndRotation}},
      "reading of delta in step 2; default dx-rotation")
      ->needs(literal);
  return {app,
          [o] { return do_replay(*o); },
          "host_sim replay --scene peg.rtscene --motion motion.csv --plot forces.svg --check",
          {{"--script",
            "replay plays a motion: make it with 'host_sim motion SCRIPT.toml -o motion.csv' and "
            "give --motion motion.csv"}}};
}

}  // namespace haptic::sim
