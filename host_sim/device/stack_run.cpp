// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/stack_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/replay_plot.hpp"

namespace haptic::sim {

namespace {

constexpr double kStackWidth = 1200, kStackLeft = 90, kStackRight = 200;
constexpr double kStackPlotWidth = kStackWidth - kStackLeft - kStackRight;

/// The stages of a wrench; where they agree the finer curves lie within the wider ones.
struct Stage {
  const char* name;
  const char* colour;
  double width;
};
constexpr std::array<Stage, 3> kStages = {Stage{"rendered by the core", "#c0c0c0", 8.0},
                                          Stage{"handed over to the bus", "#56b4e9", 4.2},
                                          Stage{"acting on the handle", "#d55e00", 1.2}};

// Rare values stand last: the last one shows where several fall into one pixel column.
constexpr std::array<BandValue, 5> kArmings = {
    BandValue{"armed", "#009e73"}, BandValue{"disarmed", "#ffffff"}, BandValue{"arming", "#f0e442"},
    BandValue{"disarming", "#56b4e9"}, BandValue{"faulted", "#d55e00"}};
constexpr std::array<ArmingState, 5> kArmingOrder = {ArmingState::kArmed, ArmingState::kDisarmed,
                                                     ArmingState::kArming, ArmingState::kDisarming,
                                                     ArmingState::kFaulted};
constexpr std::array<BandValue, 3> kLinks = {BandValue{"ready", "#009e73"},
                                             BandValue{"starting", "#f0e442"},
                                             BandValue{"absent", "#d55e00"}};
constexpr std::array<LinkState, 3> kLinkOrder = {LinkState::kReady, LinkState::kStarting,
                                                 LinkState::kAbsent};

template <typename Order, typename State>
std::size_t place_in(const Order& order, State state) {
  const auto found = std::find(order.begin(), order.end(), state);
  return found == order.end() ? 0 : static_cast<std::size_t>(found - order.begin());
}

using StageValues = std::array<std::vector<double>, kStages.size()>;

/// `floor`: what stays below it is rounding noise.
std::string stage_panel(Panel panel, std::span<const double> times, const char* label,
                        const StageValues& stages, double floor) {
  std::vector<NamedCurve> curves;
  for (std::size_t k = 0; k < kStages.size(); ++k)
    curves.push_back({kStages[k].name, kStages[k].colour, stages[k], kStages[k].width});
  fit_range(panel, curves, floor);
  return curve_panel(panel, label, times, curves, false);
}

// The watchdog of a slow device must span several of its periods.
constexpr double kWatchdogPeriods = 10;

const char* text_of(ArmingState state) {
  switch (state) {
    case ArmingState::kDisarmed:
      return "disarmed";
    case ArmingState::kArming:
      return "arming";
    case ArmingState::kArmed:
      return "armed";
    case ArmingState::kDisarming:
      return "disarming";
    case ArmingState::kFaulted:
      return "faulted";
  }
  return "unknown";
}

const char* text_of(LinkState state) {
  return state == LinkState::kReady      ? "ready"
         : state == LinkState::kStarting ? "starting"
                                         : "absent";
}

Vector in_double(const Vec3& v) { return v.cast<double>(); }

/// `given` where the device says it, else what is there.
void take(double given, Real& value) {
  if (given > 0) value = static_cast<Real>(given);
}

StackRecord record_of(const StackTick& tick, LawId law, bool was_rendered, double delivered_j,
                      const MotionSample& wanted) {
  StackRecord out;
  LoopRecord& loop = out.loop;
  const StepResult& rendered = tick.servo.rendered;
  loop.tick = sim::record_of(tick.period, tick.t_s, rendered, law);
  // Before the first report nothing touches.
  if (!was_rendered) loop.tick.d_near_m = std::numeric_limits<double>::infinity();
  std::copy(wanted.p, wanted.p + 3, loop.target_m.begin());
  std::copy(wanted.q_wxyz, wanted.q_wxyz + 4, loop.target_wxyz.begin());
  loop.speed_m_per_s = tick.device.velocity_w.norm();
  loop.turn_rad_per_s = tick.device.angular_velocity_w.norm();
  loop.delivered_j = delivered_j;
  out.rendered_new = tick.servo.rendered_new;
  out.arming = tick.servo.arming;
  out.faults = tick.servo.faults;
  out.device_faults = tick.state.faults;
  out.link = tick.link;
  out.drives_on = tick.drives_on;
  out.handed_d = tick.handed_d;
  out.acting_w = tick.acting;
  out.sends = tick.sends;
  out.armings = tick.servo.command.arming;
  out.cuts = tick.cuts;
  return out;
}

/// The last period of a hand's device. `was_rendered`: ever; kept.
StackRecord newest_record(DeviceStack& stack, std::size_t hand, bool& was_rendered,
                          const MotionSample& wanted) {
  const StackTick& tick = stack.tick(hand);
  const double delivered_j =
      stack.bus(hand).with_model([](const ReferenceModel& model) { return model.delivered_j(); });
  was_rendered = was_rendered || tick.servo.rendered_new;
  return record_of(tick, stack.law(), was_rendered, delivered_j, wanted);
}

void append_vector(std::string& csv, const Vector& v) {
  for (int k = 0; k < 3; ++k) append_number(csv += ',', v[k]);
}

}  // namespace

std::string stack_plot(std::span<const StackRecord> records, const std::string& title,
                       double exact_band_m) {
  std::vector<double> times;
  StageValues force, torque;
  for (const StackRecord& r : records) {
    times.push_back(r.loop.tick.t_s);
    force[0].push_back(length_of(r.loop.tick.force_n));
    // Without a device nothing is handed over, with any last command.
    const Wrench handed_d = r.link == LinkState::kAbsent ? Wrench{} : r.handed_d;
    force[1].push_back(static_cast<double>(handed_d.force_w.norm()));
    force[2].push_back(r.acting_w.force_w.norm());
    torque[0].push_back(length_of(r.loop.tick.torque_nm));
    torque[1].push_back(static_cast<double>(handed_d.torque_w.norm()));
    torque[2].push_back(r.acting_w.torque_w.norm());
  }
  std::vector<std::size_t> armings, links;
  std::vector<ContactSituation> situations;
  std::vector<std::uint32_t> flags;
  std::vector<double> apart_m, d_near_m;
  std::vector<TickGuide> guides;
  std::size_t contact = 0;
  for (const StackRecord& r : records) {
    armings.push_back(place_in(kArmingOrder, r.arming));
    links.push_back(place_in(kLinkOrder, r.link));
    situations.push_back(r.loop.tick.situation);
    flags.push_back(r.loop.tick.flags);
    apart_m.push_back(r.loop.tick.apart_m);
    d_near_m.push_back(searched_depth_m(r.loop.tick, exact_band_m));
    contact += r.loop.tick.in_contact ? 1u : 0u;
    guides.push_back(r.loop.tick.guide);
  }
  std::string svg = heading_at(kStackLeft, 28, title);
  svg += text_at(kStackLeft, 48,
                 std::to_string(records.size()) + " periods, " + std::to_string(contact) +
                     " in contact; from the core to the handle",
                 "start", 13, "fill=\"#505050\"");
  double top = 62;
  const auto panel = [&](double height, double gap = 18) {
    const Panel made = time_panel(times, kStackLeft, top, kStackPlotWidth, height);
    top += height + gap;
    return made;
  };
  svg += stage_panel(panel(210), times, "|force| (N)", force, 1.0e-3);
  svg += stage_panel(panel(190), times, "|torque| (N m)", torque, 1.0e-4);
  if (shows_guide(guides)) {
    const Panel pull = panel(110);
    svg += guide_panels(pull, panel(70), times, guides);
  }
  if (shows_apart(apart_m)) svg += apart_panel(panel(110), times, apart_m);
  if (shows_depth(d_near_m)) svg += depth_panel(panel(130), times, d_near_m);
  const bool marks = shows_marks(flags);
  const double marks_top = top;
  if (marks) top += 24;
  const Panel arming = panel(24, 10), link = panel(24, 10), situation = panel(24, 0);
  svg += band(arming, "arming", false, times, armings, kArmings, BandColumn::kLastOfTable);
  svg += band(link, "link", false, times, links, kLinks, BandColumn::kLastOfTable);
  svg += situation_band(situation, times, situations, top + 98);
  if (marks) {
    svg += mark_band(time_panel(times, kStackLeft, marks_top, kStackPlotWidth, 14), times, flags,
                     top + 122);
  }
  svg += text_at(kStackLeft + kStackPlotWidth / 2, top + 36, "time (s)", "middle", 13);
  svg += band_key(kStackLeft, top + 50, armings, kArmings);
  svg += band_key(kStackLeft, top + 74, links, kLinks);
  const char* const names[] = {"arming", "link", "situation"};
  for (std::size_t k = 0; k < 3; ++k)
    svg += text_at(kStackLeft - 8, top + 61 + 24 * static_cast<double>(k), names[k], "end", 13);
  return svg_document(kStackWidth, top + (marks ? 150 : 126), svg);
}

StackSettings stack_over(StackCarrier carrier, const DeviceModel& device,
                         const DeviceParameters& given, const HandModel& hand, double rate_hz) {
  StackSettings settings = reference_stack(carrier);
  ReferenceModelSettings& model = settings.model;
  model.device = device;
  model.hand = hand;
  model.report_rate_hz = rate_hz;
  model.watchdog_ns =
      std::max<std::int64_t>(model.watchdog_ns, std::llround(kWatchdogPeriods * 1e9 / rate_hz));
  if (device.max_force_n > 0) model.max_force_n = device.max_force_n;
  if (device.max_torque_nm > 0) model.max_torque_nm = device.max_torque_nm;

  hal::DeviceCapabilities c = hal::reference_capabilities();
  c.watchdog_ns = model.watchdog_ns;
  c.report_period_ns = std::llround(1e9 / rate_hz);
  take(model.max_force_n, c.max_force_n);
  take(model.max_torque_nm, c.max_torque_nm);
  take(given.max_force_rate_n_per_s, c.max_force_rate_n_per_s);
  take(given.max_torque_rate_nm_per_s, c.max_torque_rate_nm_per_s);
  model.max_force_rate_n_per_s = static_cast<double>(c.max_force_rate_n_per_s);
  model.max_torque_rate_nm_per_s = static_cast<double>(c.max_torque_rate_nm_per_s);
  settings.limits = hal::limits_of(c, c.report_period_ns);
  return settings;
}

std::function<HandAction(double)> scripted_hand(const CoreSession& session,
                                                std::vector<MotionSample> motion, double rate_hz,
                                                std::uint32_t number) {
  const Vector grip_a = Eigen::Map<const Vector>(session.view_of(number).bodies()[0].reference_m);
  const double end_s = static_cast<double>(motion.size() - 1) / rate_hz;
  return [grip_a, end_s, rate_hz, path = std::move(motion)](double t_s) {
    const auto k = static_cast<std::size_t>(std::llround(t_s * rate_hz));
    const MotionSample& sample = path[std::min(k, path.size() - 1)];
    const double* q = sample.q_wxyz;
    HandAction action;
    action.target.q_wa = Rotation(q[0], q[1], q[2], q[3]);
    action.target.x0_w = Eigen::Map<const Vector>(sample.p) + action.target.q_wa * grip_a;
    const bool held = t_s >= kDeadmanAfter_s && t_s < end_s - kDeadmanBefore_s;
    action.switches = held ? SwitchMap{}.deadman : 0;
    return action;
  };
}

std::vector<StackRecord> run_stack(DeviceStack& stack, std::span<const MotionSample> motion,
                                   const std::function<void(const StackRecord&)>& after_step,
                                   const std::function<void(double)>& before_step) {
  std::vector<StackRecord> records;
  records.reserve(motion.size());
  bool was_rendered = false;
  for (std::size_t k = 1; k < motion.size(); ++k) {
    if (before_step) before_step(motion[k].t_s);
    static_cast<void>(stack.step());
    records.push_back(newest_record(stack, 0, was_rendered, motion[k]));
    if (after_step) after_step(records.back());
  }
  return records;
}

Hands::Each<std::vector<StackRecord>> run_stacks(
    DeviceStack& stack, const Hands::Each<std::span<const MotionSample>>& motions,
    const std::function<void(const Hands::Each<StackRecord>&)>& after_step,
    const std::function<void(double)>& before_step) {
  Hands::Each<std::vector<StackRecord>> records;
  Hands::Each<bool> was_rendered{};
  for (std::size_t k = 1; k < std::min(motions[0].size(), motions[1].size()); ++k) {
    if (before_step) before_step(motions[0][k].t_s);
    static_cast<void>(stack.step());
    Hands::Each<StackRecord> newest;
    for (std::size_t hand = 0; hand < kMostHands; ++hand) {
      newest[hand] = newest_record(stack, hand, was_rendered[hand], motions[hand][k]);
      records[hand].push_back(newest[hand]);
    }
    if (after_step) after_step(newest);
  }
  return records;
}

std::string stack_csv(std::span<const StackRecord> records, const GuideLegs& legs) {
  std::string csv = loop_csv_header();
  csv +=
      ",arming,faults,device_faults,link,drives_on,handed_fx_n,handed_fy_n,handed_fz_n,"
      "handed_tx_nm,handed_ty_nm,handed_tz_nm,acting_fx_n,acting_fy_n,acting_fz_n,acting_tx_nm,"
      "acting_ty_nm,acting_tz_nm" +
      last_columns(legs) + '\n';
  csv.reserve(850 * (records.size() + 1));
  for (const StackRecord& r : records) {
    append_loop_row(csv, r.loop);
    csv += ',';
    csv += text_of(r.arming);
    csv += ',' + std::to_string(r.faults) + ',' + std::to_string(r.device_faults) + ',';
    csv += text_of(r.link);
    csv += r.drives_on ? ",1" : ",0";
    append_vector(csv, in_double(r.handed_d.force_w));
    append_vector(csv, in_double(r.handed_d.torque_w));
    append_vector(csv, r.acting_w.force_w);
    append_vector(csv, r.acting_w.torque_w);
    append_last_cells(csv, r.loop.tick, legs);
    csv += '\n';
  }
  return csv;
}

StackTotals total(std::span<const StackRecord> records) {
  StackTotals t;
  if (records.empty()) return t;
  std::vector<LoopRecord> loops;
  loops.reserve(records.size());
  for (const StackRecord& r : records) loops.push_back(r.loop);
  t.loop = total(std::span<const LoopRecord>(loops));
  bool was_ready = false;
  Vector last_n = Vector::Zero(), last_nm = Vector::Zero();
  for (const StackRecord& r : records) {
    const Vector force = in_double(r.handed_d.force_w), torque = in_double(r.handed_d.torque_w);
    const bool ready = r.link == LinkState::kReady;
    t.largest_handed_n = std::max(t.largest_handed_n, force.norm());
    t.largest_handed_nm = std::max(t.largest_handed_nm, torque.norm());
    if (ready && was_ready) {
      const double step_n = (force - last_n).norm();
      if (step_n > t.largest_handed_step_n) t.handed_step_at_s = r.loop.tick.t_s;
      t.largest_handed_step_n = std::max(t.largest_handed_step_n, step_n);
      t.largest_handed_step_nm = std::max(t.largest_handed_step_nm, (torque - last_nm).norm());
    }
    last_n = force;
    last_nm = torque;
    was_ready = ready;
    if (t.faults == 0 && r.faults != 0) t.first_fault_at_s = r.loop.tick.t_s;
    t.faults |= r.faults;
    t.device_faults |= r.device_faults;
  }
  const StackRecord& end = records.back();
  t.sends = end.sends;
  t.armings = end.armings;
  t.cuts = end.cuts;
  t.ended_ready = end.link == LinkState::kReady;
  t.ended_at_zero = last_n.isZero(0) && last_nm.isZero(0);
  return t;
}

}  // namespace haptic::sim
