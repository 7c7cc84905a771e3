// SPDX-License-Identifier: Apache-2.0
// host_sim serve SCENE|NUMBER [--port N] [--bind ADDRESS] [--allow-origin ORIGIN] [--hand H]
// [--device FILE] [--seconds N]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/commands/commands.hpp"
#include "host_sim/device/loop_run.hpp"
#include "host_sim/session/tick_csv.hpp"
#include "host_sim/view/gallery.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/live/live_session.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::sim {
namespace {

/// Time in which the hand follows a page's, whose moves come with its pictures [s].
constexpr double kHandLag_s = 0.02;
/// Ticks that are made up for at once; beyond them the session loses time.
constexpr std::int64_t kMostLate = 60;

struct ServeArguments {
  std::string scene, hand = "light", device;
  double seconds = 0;
  tools::ServeOptions serve;
};

/// A simulated device in real time, whose hand is that of a page.
class ServedLoop {
 public:
  ServedLoop(const ServeArguments& o, CoreSession& session, const DeviceModel& device,
             const HandModel& hand, double rate_hz)
      : rate_hz_(rate_hz),
        share_(1 - std::exp(-1 / (rate_hz * kHandLag_s))),
        live_(o.serve, session.view(), true),
        loop_(session, device, hand, rate_hz),
        judge_(session.view()) {
    const SceneParameters& p = session.view().parameters();
    const double* q = p.start_q_wa_xyzw;
    start_ = loop_.grip_of(Eigen::Map<const Vector>(p.start_p_wa_m),
                           Rotation(q[3], q[0], q[1], q[2]).normalized());
    restart();
  }

  void run(double seconds) {
    live_.begin();
    const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / rate_hz_));
    const std::int64_t begin_ns = hal::monotonic_ns();
    hal::DeadlineSchedule schedule(begin_ns, period_ns);
    while (!live_.is_stopped()) {
      (void)hal::sleep_until(schedule.next_deadline_ns());
      const std::int64_t now_ns = hal::monotonic_ns();
      const std::int64_t due = 1 + std::min(schedule.advance(now_ns), kMostLate - 1);
      for (std::int64_t k = 0; k < due; ++k) step();
      if (seconds > 0 && static_cast<double>(now_ns - begin_ns) > 1e9 * seconds) break;
    }
    live_.finish();
  }
  [[nodiscard]] tools::SessionVerdict verdict() const { return judge_.verdict(); }

 private:
  void restart() {
    target_ = wanted_ = start_;
    loop_.place({start_.x0_w, start_.q_wa, Vector::Zero(), Vector::Zero()});
  }

  void step() {
    const tools::PageHand order = live_.order();
    if (order.restarts != order_.restarts) restart();
    if (order.wanted != order_.wanted) {
      const double* q = order.q_wa_xyzw;
      wanted_ = loop_.grip_of(Eigen::Map<const Vector>(order.p_wa_m),
                              Rotation(q[3], q[0], q[1], q[2]).normalized());
    }
    order_ = order;
    HandStroke stroke{target_, target_};
    stroke.to.x0_w += share_ * (wanted_.x0_w - target_.x0_w);
    stroke.to.q_wa = target_.q_wa.slerp(share_, wanted_.q_wa);
    const LoopRecord record = loop_record(loop_, loop_.step(stroke));
    judge_.take(judged_tick(record.tick));
    judge_.note_work(record.delivered_j);
    live_.publish(recorded_tick(record, rate_hz_), {record.tick, order.stamp});
    target_ = stroke.to;
  }

  double rate_hz_, share_;
  tools::LiveSession live_;
  ClosedLoop loop_;
  tools::SessionJudge judge_;
  HandTarget start_, wanted_, target_;
  tools::PageHand order_;
};

int do_serve(const ServeArguments& o) {
  const std::optional<HandModel> hand = hand_named(o.hand);
  if (!hand) throw tools::InputError("no hand is called '" + o.hand + "'");
  std::optional<CoreSession> session;
  if (const std::optional<unsigned> number = gallery_number(o.scene)) {
    const GalleryScene& scene = gallery_scene(*number);
    session.emplace(compile_gallery_scene(scene).bytes.span(), std::string(scene.name));
  } else {
    session.emplace(o.scene);
  }
  const SceneParameters& parameters = session->view().parameters();
  const double rate_hz = parameters.rate_hz;
  const DeviceModel device =
      o.device.empty() ? device_of(parameters, rate_hz) : read_device_file(o.device, rate_hz);
  const std::string lowered = fit_to_device(*session, device, rate_hz);
  if (!lowered.empty()) std::fprintf(stderr, "host_sim: %s\n", lowered.c_str());
  ServedLoop loop(o, *session, device, *hand, rate_hz);
  loop.run(o.seconds);
  const tools::SessionVerdict verdict = loop.verdict();
  std::printf("served %llu ticks\n%s\n", static_cast<unsigned long long>(verdict.ticks),
              tools::verdict_line(verdict, "").view().data());
  return verdict.failed() ? tools::kExitCheckFailed : tools::kExitDone;
}

}  // namespace

Command add_serve_command(CLI::App& program) {
  const auto o = std::make_shared<ServeArguments>();
  CLI::App* app = program.add_subcommand(
      "serve",
      "Runs a simulated device in real time, to be seen and moved in a browser, until it is "
      "stopped (^C).");
  app->add_option("scene,--scene", o->scene,
                  "compiled scene (.rtscene), or the number of a scene of the gallery, 1 to 8")
      ->required();
  tools::add_serve_options(*app, o->serve);
  app->add_option("--seconds", o->seconds, "then end; default: when this is stopped")
      ->check(tools::number_within(0.01, 1.0e9));
  app->add_option("--hand", o->hand, "loose, light (default) or firm")
      ->check(CLI::IsMember({"loose", "light", "firm"}));
  app->add_option("--device", o->device, "device model (TOML); default: the scene's [device]");
  return {app, [o] { return do_serve(*o); }, "host_sim serve peg.rtscene"};
}

}  // namespace haptic::sim
