// SPDX-License-Identifier: Apache-2.0
// host_sim soak [--scene S.rtscene] [--minutes 10] [--every 5] [--virtual] [--out DIR]
// [--fault leak-memory|leak-descriptor|ignore-fault]
#include <unistd.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/realtime/soak_run.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "host_sim/timing/heap_interposer.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/simplified_bodies.hpp"

namespace haptic::sim {
namespace {

constexpr double kMega = 1024.0 * 1024;

struct SoakArguments {
  std::string scene, out;
  SoakSettings soak;
};

/// One line per fault; on a terminal always the same one.
void print_progress(const SoakArguments& o, const SoakAccount& a) {
  const SoakCell& cell = a.cells.back();
  const SoakSample& now = a.samples.back();
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  std::fprintf(stderr,
               "%s%6.1f of %.1f min  fault %zu  %.1f MiB  heap %.2f MiB  %u descriptors  "
               "%s, %s: %s%s",
               terminal ? "\r\033[K" : "", now.t_s / 60, o.soak.minutes, a.cells.size(),
               static_cast<double>(now.process.resident_bytes) / kMega,
               static_cast<double>(now.process.heap_bytes) / kMega, now.process.descriptors,
               cell.cell.fault->name, to_text(cell.cell.state),
               cell.failures.empty() ? "as stated" : "FAILS", terminal ? "" : "\n");
}

void print_level(const char* name, const SoakLevel& level, double unit, const char* unit_name) {
  std::printf("  %-16s %.2f%s after the warm-up, then %.2f to %.2f\n", name, level.reference / unit,
              unit_name, level.least / unit, level.largest / unit);
}

void print_summary(const SoakArguments& o, const SoakAccount& a) {
  std::size_t stated = 0;
  for (const SoakCell& cell : a.cells) stated += cell.failures.empty() ? 1u : 0u;
  std::printf("soak of %g min in %s time, %.1f s\n", o.soak.minutes,
              o.soak.virtual_time ? "virtual" : "real", a.wall_s);
  std::printf(
      "  faults           %zu of %zu answered as stated; %llu runs spoiled by the machine "
      "and repeated\n",
      stated, a.cells.size(), static_cast<unsigned long long>(a.repeated));
  print_level("resident", a.resident, kMega, " MiB");
  print_level("heap in use", a.heap, kMega, " MiB");
  print_level("descriptors", a.descriptors, 1, "");
  print_level("threads", a.threads, 1, "");
  if (!o.soak.virtual_time) {
    std::printf("  heap calls       servo thread %llu, USB thread apart from libusb %lld%s\n",
                static_cast<unsigned long long>(a.servo_heap_calls),
                static_cast<long long>(a.usb_heap_calls),
                o.soak.heap_calls == nullptr ? " (not counted in this build)" : "");
    std::printf(
        "  machine          latest thread %.2f ms; latched by that between faults %llu "
        "times; SCHED_FIFO %s\n",
        1e-6 * static_cast<double>(a.largest_late_ns),
        static_cast<unsigned long long>(a.machine_faults), a.grants.fifo() ? "granted" : "refused");
  }
  for (const std::string& failure : a.failures) std::printf("  FAILS: %s\n", failure.c_str());
  std::printf("  result           %s\n", a.failures.empty() ? "passed" : "FAILED");
}

int do_soak(SoakArguments o) {
  tools::claim_folder(o.out, "--out", {"soak.csv", "soak_faults.csv", "soak.json", "soak.svg"});
  if (heap_calls_are_counted()) o.soak.heap_calls = heap_calls_of_this_thread;
  std::vector<std::byte> scene = fault_scene();
  FaultPlace place = fault_place();
  if (!o.scene.empty()) {
    const tools::SceneBytes file = tools::read_scene_bytes(o.scene);
    scene.assign(file.span().begin(), file.span().end());
    CoreSession session(scene, o.scene);
    require_one_moving_part(session, o.scene, "soak",
                            "run it with 'host_sim run', or give a scene of one moving part");
    tools::tell_simplification("host_sim", o.scene, session.view());
    place = fault_place(session);
  }
  const SoakAccount account =
      run_soak(scene, place, o.soak, [&o](const SoakAccount& a) { print_progress(o, a); });
  if (::isatty(STDERR_FILENO) == 1) std::fprintf(stderr, "\n");
  print_summary(o, account);
  if (!o.out.empty()) {
    const std::string name = o.scene.empty() ? "cube on a wall" : o.scene;
    for (const OutputText& file : soak_files(name, o.soak, account))
      write_whole_file(o.out + "/" + file.name, file.content);
  }
  return account.failures.empty() ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_soak_command(CLI::App& program) {
  const auto o = std::make_shared<SoakArguments>();
  CLI::App* app = program.add_subcommand("soak",
                                         "Runs the stack for a long time with a fault every few "
                                         "seconds, and watches memory and descriptors.");
  app->add_option("scene,--scene", o->scene,
                  "compiled scene (.rtscene); default: the cube on a wall of the fault matrix");
  app->add_option("--minutes", o->soak.minutes, "of the device's time; default 10")
      ->check(tools::number_within(0.1, 100000.0));
  app->add_option("--every", o->soak.every_s, "seconds from fault to fault; default 5")
      ->check(tools::number_within(3.0, 3600.0));
  app->add_flag("--virtual", o->soak.virtual_time,
                "in one thread and the device's own time: the same bits each time");
  app->add_option("-o,--out", o->out,
                  "folder for soak.csv, soak_faults.csv, soak.json and soak.svg");
  tools::add_choice<SoakProbe>(*app, "--fault", o->soak.probe,
                               {{"leak-memory", SoakProbe::kLeakMemory},
                                {"leak-descriptor", SoakProbe::kLeakDescriptor},
                                {"ignore-fault", SoakProbe::kIgnoreFault}},
                               "something wrong with the soak itself: must exit 1");
  return {app, [o] { return do_soak(*o); }, "host_sim soak --virtual --minutes 5 --out soak"};
}

}  // namespace haptic::sim
