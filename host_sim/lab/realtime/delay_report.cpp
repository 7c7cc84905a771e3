// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/delay_report.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "host_sim/lab/realtime/pressed_scene.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/report/quantile.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

// Long enough to arm, press and rest; then a step that any contact answers, and time to see it act.
constexpr double kVirtualSeconds = 2.0, kStep_m = 2.0e-3;
constexpr std::size_t kMostAnswer = 40;  ///< periods
constexpr std::size_t kRoomPerReport = 4;

std::uint64_t number_of(double periods) {
  return static_cast<std::uint64_t>(std::llround(periods));
}

bool differs(const Load& a, const Load& b) {
  return a.force_w != b.force_w || a.torque_w != b.torque_w;
}

struct AnsweringTick {
  StackTick tick;
  std::vector<std::uint8_t> report;
};

/// The stack up to the step of the hand, and what followed.
std::vector<AnsweringTick> ticks_about_step(const std::string& scene, const DelayQuestion& question,
                                            bool report_clocked, double phase, bool with_step) {
  CoreSession session(scene);
  PressedScene pressed = pressed_scene(session, question.rate_hz, kVirtualSeconds);
  pressed.stack.report_clocked = report_clocked;
  pressed.stack.servo_phase = phase;
  Vector step_d = Vector::Zero();
  DeviceStack stack(session, pressed.stack, [&pressed, &step_d](double t_s) {
    HandAction action = pressed.hand(t_s);
    action.target.x0_w += step_d;
    return action;
  });
  const std::uint64_t before = number_of(pressed.rest_s * question.rate_hz);
  StackTick last;
  for (std::uint64_t k = 0; k < before; ++k) last = stack.step();
  if (!(last.acting.force_w.norm() > 0))
    throw tools::InputError(scene + ": the hand that presses feels no force; another start pose");
  if (with_step) step_d = -kStep_m * last.acting.force_w.normalized();  // against it, so deeper
  std::vector<AnsweringTick> after;
  for (std::size_t k = 0; k < kMostAnswer; ++k) {
    AnsweringTick& tick = after.emplace_back();
    tick.tick = stack.step();
    tick.report =
        stack.bus().with_model([](const ReferenceModel& model) { return model.report(); });
  }
  stack.unplug();
  static_cast<void>(stack.step());
  return after;
}

bool sent_differs(const StackTick& a, const StackTick& b) {
  if (a.sent.size() != b.sent.size()) return true;
  for (std::size_t k = 0; k < a.sent.size(); ++k) {
    if (differs(a.sent[k].wrench, b.sent[k].wrench)) return true;
  }
  return false;
}

VirtualDelay delay_at_phase(const std::string& scene, const DelayQuestion& question,
                            bool report_clocked, double phase) {
  const auto moved = ticks_about_step(scene, question, report_clocked, phase, true);
  const auto still = ticks_about_step(scene, question, report_clocked, phase, false);
  const double period_ns = 1e9 / question.rate_hz;
  double sampled = -1, tick = -1, handed = -1, acts = -1;  ///< in periods
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const double at = static_cast<double>(k);
    const StackTick &a = moved[k].tick, &b = still[k].tick;
    if (sampled < 0 && moved[k].report != still[k].report) sampled = at;
    if (tick < 0 && a.servo.rendered.goal_pose_wa.p_wa != b.servo.rendered.goal_pose_wa.p_wa)
      tick = at + (report_clocked ? 0 : phase);
    if (handed < 0 && sent_differs(a, b)) handed = at;
    // What acts in a period does so from its begin on, which is one period before its sample.
    if (acts < 0 && differs(a.acting, b.acting)) acts = at - 1;
  }
  if (sampled < 0 || tick < 0 || handed < 0 || acts < 0)
    throw tools::InputError(scene + ": a step of the hand in contact changes no force");
  VirtualDelay delay;
  delay.phase = phase;
  const auto ns = [period_ns](double periods) { return std::llround(periods * period_ns); };
  delay.at_ns = {0, ns(tick - sampled), ns(tick - sampled), ns(handed - sampled),
                 ns(acts - sampled)};
  return delay;
}

/// Stamps of all threads, each written by one and read when all have ended.
class DelayWatch final : public hal::LinkObserver {
 public:
  explicit DelayWatch(std::size_t reports)
      : sampled_(reports),
        reports_(reports),
        ticks_(kRoomPerReport * reports),
        sends_(kRoomPerReport * reports) {}

  /// On the device's thread, when the period's sample is taken.
  void sampled(std::uint64_t period) noexcept {
    if (period < sampled_.size()) sampled_[period] = hal::monotonic_ns();
  }
  void on_report(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                 hal::ReportVerdict verdict, std::uint64_t sequence) noexcept override {
    hal::ReferenceReport decoded;
    if (verdict != hal::ReportVerdict::kState || sequence >= reports_.size()) return;
    if (hal::decode(report, decoded) != hal::CodecVerdict::kOk) return;
    reports_[sequence] = {decoded.sequence, stamp_ns};
    newest_ = sequence;
  }
  void on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> /*report*/,
               const hal::GuardedOutput& output) noexcept override {
    if (send_count_ < sends_.size())
      sends_[send_count_++] = {output.tick, stamp_ns, hal::monotonic_ns()};
  }
  void on_link(std::int64_t, LinkState, hal::HalStatus) noexcept override {}
  static void saw(void* self, const ServoInput& input, const ServoResult& result) {
    static_cast<DelayWatch*>(self)->note(input, result);
  }
  [[nodiscard]] MeasuredDelays delays() const;

 private:
  struct Report {
    std::uint64_t period = 0;
    std::int64_t stamp_ns = 0;
  };
  struct Tick {
    std::uint64_t number = 0, sequence = 0;
    std::int64_t begin_ns = 0, end_ns = 0;
  };
  struct Send {
    std::uint64_t tick = 0;
    std::int64_t handed_ns = 0, acts_ns = 0;
  };
  void note(const ServoInput& input, const ServoResult& result) noexcept {
    contact_ += result.rendered.situation != ContactSituation::kNone ? 1u : 0u;
    if (tick_count_ < ticks_.size())
      ticks_[tick_count_++] = {result.command.tick, input.state.sequence, input.now_ns,
                               hal::monotonic_ns()};
  }

  std::vector<std::int64_t> sampled_;
  std::vector<Report> reports_;
  std::vector<Tick> ticks_;
  std::vector<Send> sends_;
  std::size_t tick_count_ = 0, send_count_ = 0;
  std::uint64_t newest_ = 0, contact_ = 0;
};

MeasuredDelays DelayWatch::delays() const {
  MeasuredDelays result;
  result.contact_ticks = contact_;
  std::size_t tick = 0, send = 0;
  for (std::uint64_t s = 1; s <= newest_; ++s) {
    const Report& report = reports_[s];
    if (report.stamp_ns == 0 || report.period >= sampled_.size()) continue;
    result.reports += 1;
    while (tick < tick_count_ && ticks_[tick].sequence < s) ++tick;
    if (tick == tick_count_) break;
    while (send < send_count_ && (sends_[send].tick < ticks_[tick].number ||
                                  sends_[send].acts_ns < ticks_[tick].begin_ns))
      ++send;
    if (send == send_count_) break;
    const std::int64_t from_ns = sampled_[report.period];
    if (from_ns == 0) continue;
    result.at_ns.push_back({report.stamp_ns - from_ns, ticks_[tick].begin_ns - from_ns,
                            ticks_[tick].end_ns - from_ns, sends_[send].handed_ns - from_ns,
                            sends_[send].acts_ns - from_ns});
  }
  return result;
}

using Json = nlohmann::ordered_json;

constexpr std::size_t kBins = 60;
constexpr double kShownPeriods = 3;  ///< later ones are in the last bin
constexpr double kWidth = 1200, kLeft = 90, kPanelWidth = 500, kGap = 90, kPanelHeight = 230;
constexpr std::array<const char*, 2> kColours = {"#0072b2", "#d55e00"};
constexpr std::array<const char*, kDelayStages> kStageColours = {"#56b4e9", "#e69f00", "#009e73",
                                                                 "#cc79a7", "#0072b2"};

std::vector<std::int64_t> column(const std::vector<DelayTimes>& times, DelayStage stage) {
  std::vector<std::int64_t> out;
  for (const DelayTimes& t : times) out.push_back(t[static_cast<std::size_t>(stage)]);
  return out;
}

std::vector<DelayTimes> exact_times(const DelayOfMode& mode) {
  std::vector<DelayTimes> out;
  for (const VirtualDelay& d : mode.exact) out.push_back(d.at_ns);
  return out;
}

DelayFigures figures_of(std::vector<std::int64_t> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  return {values.front(), quantile(values, 0.5), quantile(values, 0.99), values.back()};
}

/// Share of all per bin of kShownPeriods.
std::array<double, kBins> histogram(const std::vector<std::int64_t>& values, double period_ns) {
  std::array<double, kBins> bins{};
  for (const std::int64_t value : values) {
    const double at = static_cast<double>(value) / (kShownPeriods * period_ns) * kBins;
    bins[static_cast<std::size_t>(std::clamp(at, 0.0, kBins - 1.0))] +=
        1.0 / static_cast<double>(values.size());
  }
  return bins;
}

std::string csv_of(const std::vector<DelayOfMode>& modes) {
  ReportTable table("time,mode,phase,report_us,tick_us,command_us,handed_us,acts_us");
  const auto add = [&table](const char* time, const DelayOfMode& mode, const std::string& phase,
                            const DelayTimes& at_ns) {
    std::vector<Cell> row{time, name_of(mode), phase};
    for (const std::int64_t ns : at_ns) row.emplace_back(fixed(1e-3 * static_cast<double>(ns), 3));
    table.add(std::move(row));
  };
  for (const DelayOfMode& mode : modes) {
    for (const VirtualDelay& d : mode.exact) add("virtual", mode, fixed(d.phase, 4), d.at_ns);
    for (const DelayTimes& t : mode.measured.at_ns) add("real", mode, "", t);
  }
  return table.csv();
}

Json json_of(const DelayFigures& f) {
  const auto us = [](std::int64_t ns) { return 1e-3 * static_cast<double>(ns); };
  return {{"min_us", us(f.least_ns)},
          {"median_us", us(f.median_ns)},
          {"p99_us", us(f.p99_ns)},
          {"max_us", us(f.largest_ns)}};
}

std::string account(const std::string& scene, const DelayQuestion& question,
                    const std::vector<DelayOfMode>& modes) {
  Json json;
  json["scene"] = scene;
  json["rate_hz"] = question.rate_hz;
  const double period_ns = 1e9 / question.rate_hz;
  for (const DelayOfMode& mode : modes) {
    Json entry;
    entry["mode"] = name_of(mode);
    entry["reports"] = mode.measured.reports;
    entry["answered"] = mode.measured.at_ns.size();
    entry["contact_ticks"] = mode.measured.contact_ticks;
    entry["fifo"] = mode.measured.grants.fifo();
    for (std::size_t k = 0; k < kDelayStages; ++k) {
      const auto stage = static_cast<DelayStage>(k);
      entry["virtual"][to_text(stage)] = json_of(exact_figures(mode, stage));
      entry["real"][to_text(stage)] = json_of(measured_figures(mode, stage));
    }
    entry["histogram"] = {
        {"bin_us", 1e-3 * kShownPeriods * period_ns / kBins},
        {"virtual", histogram(column(exact_times(mode), DelayStage::kActs), period_ns)},
        {"real", histogram(column(mode.measured.at_ns, DelayStage::kActs), period_ns)}};
    json["modes"].push_back(entry);
  }
  return json.dump(2) + "\n";
}

std::string shaded(double x, double y, double width, double height, const char* colour) {
  return rectangle_at({x, y}, width, height, colour, "fill-opacity=\"0.6\"");
}

std::string histogram_panel(double left, const std::vector<DelayOfMode>& modes, double period_ns,
                            bool exact) {
  const double shown_ms = 1e-6 * kShownPeriods * period_ns;
  const Panel panel{left, 90, kPanelWidth, kPanelHeight, 0, shown_ms, 0, 100};
  std::string svg = panel_frame(panel, "% of the reports", true);
  svg +=
      text_at(left + kPanelWidth, 90 + kPanelHeight + 32, "time after the sample (ms)", "end", 12);
  svg += text_at(
      left, 80,
      exact ? "virtual time: exact, over all phases of the timer" : "real time: this machine",
      "start", 14, "font-weight=\"bold\"");
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const auto bins = histogram(exact ? column(exact_times(modes[m]), DelayStage::kActs)
                                      : column(modes[m].measured.at_ns, DelayStage::kActs),
                                period_ns);
    const double width = kPanelWidth / static_cast<double>(kBins);
    for (std::size_t k = 0; k < kBins; ++k) {
      const double top = panel.y_of(100 * bins[k]);
      if (bins[k] > 0)
        svg += shaded(left + width * static_cast<double>(k), top, width,
                      panel.top + panel.height - top, kColours[m]);
    }
    svg += shaded(left + 330, 104 + 22 * static_cast<double>(m), 14, 12, kColours[m]);
    svg += text_at(left + 350, 114 + 22 * static_cast<double>(m), name_of(modes[m]), "start", 13);
  }
  return svg;
}

/// The medians of the stages, one after the other.
std::string stage_bars(double top, const std::vector<DelayOfMode>& modes, double period_ns) {
  const Panel panel{kLeft + 110, top, 2 * kPanelWidth + kGap - 110, 150, 0, 1e-6 * 1.5 * period_ns,
                    0,           1};
  std::string svg = text_at(kLeft, top - 12, "medians of the stages (ms after the sample)", "start",
                            14, "font-weight=\"bold\"");
  double y = top + 10;
  for (const DelayOfMode& mode : modes) {
    for (const bool exact : {true, false}) {
      double from = 0;
      for (std::size_t k = 0; k < kDelayStages; ++k) {
        const auto stage = static_cast<DelayStage>(k);
        const DelayFigures f = exact ? exact_figures(mode, stage) : measured_figures(mode, stage);
        const double to = 1e-6 * static_cast<double>(f.median_ns);
        if (to > from)
          svg +=
              shaded(panel.x_of(from), y, panel.x_of(to) - panel.x_of(from), 22, kStageColours[k]);
        from = std::max(from, to);
      }
      svg += text_at(
          panel.left - 8, y + 16,
          std::string(mode.report_clocked ? "report" : "timer") + (exact ? ", exact" : ", real"),
          "end", 13);
      svg += text_at(panel.x_of(from) + 6, y + 16, fixed(from, 3), "start", 12);
      y += 34;
    }
  }
  for (const double mark : nice_marks(panel.t_low, panel.t_high, 8)) {
    svg += text_at(panel.x_of(mark), top + 160, mark_label(mark, 0.1), "middle", 12);
    svg += shaded(panel.x_of(mark), top, 0.6, 146, "#808080");
  }
  double x = panel.left;
  for (std::size_t k = 0; k < kDelayStages; ++k) {
    svg += shaded(x, top + 176, 14, 12, kStageColours[k]);
    svg += text_at(x + 20, top + 187, to_text(static_cast<DelayStage>(k)), "start", 13);
    x += 190;
  }
  return svg;
}

std::string picture(const DelayQuestion& question, const std::vector<DelayOfMode>& modes) {
  const double period_ns = 1e9 / question.rate_hz, height = 600;
  std::string svg =
      heading_at(kLeft, 32, "From the sample of a motion to the force that answers it (ms)");
  svg += text_at(kLeft, 54, "reports and servo loop at " + fixed(question.rate_hz, 0) + " Hz",
                 "start", 13);
  svg += histogram_panel(kLeft, modes, period_ns, true);
  svg += histogram_panel(kLeft + kPanelWidth + kGap, modes, period_ns, false);
  return svg_document(kWidth, height, svg + stage_bars(400, modes, period_ns));
}

}  // namespace

const char* to_text(DelayStage stage) {
  static constexpr std::array<const char*, kDelayStages> kTexts = {
      "report complete", "tick begins", "command published", "handed to the bus", "acts"};
  return kTexts[static_cast<std::size_t>(stage)];
}

std::vector<VirtualDelay> virtual_delays(const std::string& scene, const DelayQuestion& question,
                                         bool report_clocked) {
  std::vector<VirtualDelay> delays;
  const unsigned phases = report_clocked ? 1 : question.phases;
  for (unsigned k = 0; k < phases; ++k)
    delays.push_back(delay_at_phase(scene, question, report_clocked, (k + 0.5) / phases));
  return delays;
}

MeasuredDelays measured_delays(const std::string& scene, const DelayQuestion& question,
                               bool report_clocked) {
  CoreSession session(scene);
  const PressedScene pressed = pressed_scene(session, question.rate_hz, question.seconds);
  ThreadedLoopSettings settings;
  settings.stack = pressed.stack;
  settings.stack.report_clocked = report_clocked;
  DelayWatch watch(number_of((question.seconds + 1) * question.rate_hz));
  const double rate_hz = question.rate_hz;
  ThreadedLoop loop(session, settings, [&watch, &pressed, rate_hz](double t_s) {
    watch.sampled(number_of(t_s * rate_hz));
    return pressed.hand(t_s);
  });
  loop.watch(&DelayWatch::saw, &watch);
  loop.observe(&watch);
  loop.start(hal::monotonic_ns(), true);
  std::this_thread::sleep_for(std::chrono::duration<double>(question.seconds));
  loop.stop();
  MeasuredDelays delays = watch.delays();
  delays.grants = loop.grants();
  return delays;
}

const char* name_of(const DelayOfMode& mode) {
  return mode.report_clocked ? "report-clocked" : "timer-clocked";
}

DelayFigures exact_figures(const DelayOfMode& mode, DelayStage stage) {
  return figures_of(column(exact_times(mode), stage));
}

DelayFigures measured_figures(const DelayOfMode& mode, DelayStage stage) {
  return figures_of(column(mode.measured.at_ns, stage));
}

std::vector<OutputText> delay_files(const std::string& scene, const DelayQuestion& question,
                                    const std::vector<DelayOfMode>& modes) {
  return {{"delay.csv", csv_of(modes)},
          {"delay.json", account(scene, question, modes)},
          {"delay.svg", picture(question, modes)}};
}

}  // namespace haptic::sim
