// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/two_hand_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/replay_plot.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "host_sim/view/mcap_file.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/live/live_session.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {
namespace {

void check(const RunArguments& o) {
  const auto refuse = [](bool given, const char* option, const char* why) {
    if (given) throw tools::UsageError(std::string(option) + ": " + why);
  };
  if (o.carrier != "none") {
    const char* const alone = "of two hands only without --carrier; leave one of the two out";
    refuse(!o.html.empty(), "--html", alone);
    refuse(o.serve, "--serve", alone);
    refuse(!o.mcap.empty(), "--mcap", alone);
  }
  refuse(!o.record.empty(), "--record",
         "a recording is of one device, and this scene has two; leave it out");
  refuse(!o.faults.empty(), "--faults",
         "a fault script is of one device, and this scene has two; 'host_sim faults --hands 2' has "
         "every fault at each");
  refuse(o.report_clocked, "--report-clocked", "two devices are not; leave it out");
}

/// At rest where its part starts, for as long as the other hand moves.
std::vector<MotionSample> still(const CoreSession& session, std::uint32_t hand,
                                const std::vector<MotionSample>& other) {
  const PartPlace start = session.parts()->start_of(hand);
  std::vector<MotionSample> motion = other;
  for (MotionSample& sample : motion) {
    std::copy_n(start.p_wa_m, 3, sample.p);
    for (std::size_t k = 0; k < 4; ++k) sample.q_wxyz[k] = start.q_wa_xyzw[(k + 3) % 4];
  }
  return motion;
}

/// The motions of both, of one length: the shorter one rests at its end.
Hands::Each<std::vector<MotionSample>> motions_of(const RunArguments& o, CoreSession& session,
                                                  double rate_hz) {
  const auto way = [&](const std::string& script) {
    HandWay read = hand_way(o, script, session, rate_hz);
    if (!read.holds.empty())
      throw tools::InputError(script +
                              ": holds and lets go, and in a scene with role \"hand2\" both hands "
                              "hold their parts all the time; leave the holds out");
    return std::move(read.motion);
  };
  Hands::Each<std::vector<MotionSample>> motions;
  motions[0] = way(o.script);
  motions[1] = o.script2.empty() ? still(session, 1, motions[0]) : way(o.script2);
  const std::size_t ticks = std::max(motions[0].size(), motions[1].size());
  for (std::vector<MotionSample>& motion : motions) {
    while (motion.size() < ticks) {
      motion.push_back(motion.back());
      motion.back().t_s += 1 / rate_hz;
    }
  }
  return motions;
}

/// A hand is judged by its own scene. `rendered`: ticks that its core has made; empty: all.
HandAccount judged(const RunArguments& o, CoreSession& session, const RunSubject& subject,
                   std::uint32_t hand, const std::vector<LoopRecord>& records,
                   const std::vector<double>& given_j, const std::vector<bool>& rendered = {}) {
  HandAccount account;
  account.loop = total(records);
  const SceneView& scene = session.view_of(hand);
  account.rest = rest_oscillation(records, rest_allowance(scene.parameters(), subject.device));
  tools::SessionJudge judge(scene);
  if (hand == 0 && o.is_made_to_press()) judge.expect_contact();
  for (std::size_t k = 0; k < records.size(); ++k) {
    if (rendered.empty() || rendered[k]) judge.take(judged_tick(records[k].tick));
    judge.note_work(records[k].delivered_j - given_j[k]);
  }
  account.end.verdict = judge.verdict();
  add_loop_failures(account.end, account.loop, account.rest,
                    within_bounds(session.hands()->hand(hand).core().peaks(), session.bounds()));
  return account;
}

/// Energy of each hand's spring from other parts, up to each tick [J].
class GivenTape {
 public:
  explicit GivenTape(CoreSession& session) : session_(session) {}
  void take() {
    for (std::uint32_t k = 0; k < kMostHands; ++k)
      of[k].push_back(session_.hands()->hand(k).given_j());
  }
  Hands::Each<std::vector<double>> of;

 private:
  CoreSession& session_;
};

std::string title_of(const RunArguments& o, const CoreSession& session, std::uint32_t hand) {
  return scene_title(session.view_of(hand)) + (hand == 0 ? ", first " : ", second ") + o.hand +
         " hand" + (o.carrier == "none" ? "" : ", carrier " + o.carrier);
}

/// Failures beside the hands are told with the first.
bool tell(const RunArguments& o, const RunSubject& subject, Hands::Each<HandAccount> accounts,
          const OtherMotion& others, const std::vector<OutputText>& files) {
  const std::string failures = others.failures();
  accounts[0].end.add_failure(!failures.empty(), failures);
  const OtherEvents told = told_by(others);
  o.keep(files, hands_account(subject, o.carrier, accounts, told));
  o.keep_drives(others.drives());
  if (!o.json) print_hands(subject, o.carrier, accounts, told);
  return end_of(accounts).passed();
}

/// The newest tick to those who watch, in real time. Stopped, it goes on as fast as it can.
void show(tools::LiveSession& live, const LoopRecord& first, const OtherMotion& others,
          double rate_hz, std::int64_t begin_ns) {
  tools::RecordedTick tick = recorded_tick(first, rate_hz);
  others.kept().mark(tick, first.tick.tick);
  live.publish(tick, others.shown(first.tick), others.kept().newest());
  const double due_s = static_cast<double>(first.tick.tick + 1) / rate_hz;
  if (!live.is_stopped()) (void)hal::sleep_until(begin_ns + std::llround(1e9 * due_s));
}

void write_pictures(const RunArguments& o, const std::string& page, const CoreSession& session,
                    const RunSubject& subject, const std::vector<LoopRecord>& first,
                    const OtherMotion& others) {
  if (!o.mcap.empty()) write_whole_file(o.mcap, mcap_of(session.view(), first, others.driven()));
  if (o.html.empty()) return;
  std::vector<tools::RecordedTick> recorded;
  for (const LoopRecord& record : first) {
    recorded.push_back(recorded_tick(record, subject.rate_hz));
    others.kept().mark(recorded.back(), record.tick.tick);
  }
  write_whole_file(o.html,
                   tools::filled_page(page, session.view(), recorded, {}, others.kept().given()));
}

bool run_bare(const RunArguments& o, CoreSession& session, const RunSubject& subject,
              const HandModel& hand) {
  const std::string page = o.html.empty() ? std::string() : tools::read_page();
  std::optional<tools::LiveSession> live;
  if (o.serve) live.emplace(o.live, session.view(), false);
  ClosedLoop first(session, subject.device, hand, subject.rate_hz, 0);
  ClosedLoop second(session, subject.device, hand, subject.rate_hz, 1);
  const Hands::Each<std::vector<MotionSample>> motions = motions_of(o, session, subject.rate_hz);
  OtherMotion others(session, {}, o.drives);
  if (!o.html.empty() || !o.mcap.empty() || o.serve) others.tape(!o.mcap.empty());
  GivenTape given(session);
  if (live) live->begin();
  const std::int64_t begin_ns = hal::monotonic_ns();
  const auto after = [&](const Hands::Each<LoopRecord>& tick,
                         const Hands::Each<StepResult>& results) {
    others.after_tick(tick[0].tick, &results[1]);
    given.take();
    if (live) show(*live, tick[0], others, subject.rate_hz, begin_ns);
  };
  const auto before = [&](double t_s) {
    const Pose other_wa = second.sample().pose_wa;
    others.before_tick(t_s, &other_wa);
  };
  const Hands::Each<std::vector<LoopRecord>> records =
      run_loops(session, {&first, &second}, {motions[0], motions[1]}, after, before);
  if (live) live->finish();
  write_pictures(o, page, session, subject, records[0], others);
  Hands::Each<HandAccount> accounts;
  std::vector<OutputText> files;
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    accounts[k] = judged(o, session, subject, k, records[k], given.of[k]);
    const std::string name = k == 0 ? "run" : "run2";
    std::vector<TickRecord> ticks;
    for (const LoopRecord& record : records[k]) ticks.push_back(record.tick);
    const SceneView& scene = session.view_of(k);
    files.push_back({name + ".csv", loop_csv(records[k], GuideLegs(scene))});
    files.push_back({name + ".svg",
                     replay_plot(ticks, title_of(o, session, k), scene.parameters().exact_band_m)});
  }
  const bool passed = tell(o, subject, accounts, others, files);
  if (live) stay(*live);
  return passed;
}

/// Adds the words of a device that has no place in a run without faults.
void add_device_failures(const StackTotals& totals, RunEnd& end) {
  end.add_failure(totals.faults != 0,
                  tools::formatted("a fault at %.4f s: ", totals.first_fault_at_s) +
                      fault_words(totals.faults));
  end.add_failure(!totals.ended_ready, "the link is not ready at the end");
  end.add_failure(!totals.ended_at_zero, "the last wrench handed over is not zero");
}

bool run_devices(const RunArguments& o, CoreSession& session, const RunSubject& subject,
                 const HandModel& hand) {
  const SceneParameters& parameters = session.view().parameters();
  const Hands::Each<std::vector<MotionSample>> motions = motions_of(o, session, subject.rate_hz);
  std::vector<StackDevice> devices;
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    const StackCarrier carrier = o.carrier == "usb" ? StackCarrier::kUsb : StackCarrier::kDirect;
    devices.push_back({stack_over(carrier, subject.device,
                                  o.device.empty() ? parameters.device : DeviceParameters{}, hand,
                                  subject.rate_hz),
                       scripted_hand(session, motions[k], subject.rate_hz, k)});
  }
  DeviceStack stack(session, std::move(devices));
  OtherMotion others(session, {}, o.drives);
  GivenTape given(session);
  const auto after = [&](const Hands::Each<StackRecord>& newest) {
    others.after_tick(newest[0].loop.tick);
    given.take();
  };
  const Hands::Each<std::vector<StackRecord>> records = run_stacks(
      stack, {motions[0], motions[1]}, after, [&](double t_s) { others.give(stack, t_s); });
  Hands::Each<HandAccount> accounts;
  std::vector<OutputText> files;
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    std::vector<LoopRecord> felt;
    std::vector<bool> rendered;
    for (const StackRecord& record : records[k]) {
      felt.push_back(record.loop);
      rendered.push_back(record.rendered_new);
    }
    accounts[k] = judged(o, session, subject, k, felt, given.of[k], rendered);
    add_device_failures(total(records[k]), accounts[k].end);
    const std::string name = k == 0 ? "run" : "run2";
    const SceneView& scene = session.view_of(k);
    files.push_back({name + ".csv", stack_csv(records[k], GuideLegs(scene))});
    files.push_back({name + ".svg", stack_plot(records[k], title_of(o, session, k),
                                               scene.parameters().exact_band_m)});
  }
  return tell(o, subject, accounts, others, files);
}

}  // namespace

bool run_two_hands(const RunArguments& o, CoreSession& session, const RunSubject& subject,
                   const HandModel& hand) {
  check(o);
  return o.carrier == "none" ? run_bare(o, session, subject, hand)
                             : run_devices(o, session, subject, hand);
}

}  // namespace haptic::sim
