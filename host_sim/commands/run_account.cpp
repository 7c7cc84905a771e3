// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/run_account.hpp"

#include <cstdio>
#include <utility>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "rt_core/safety/arming.hpp"
#include "tools/common/formatted.hpp"
#include "tools/verdict/verdict_json.hpp"

namespace haptic::sim {
namespace {

/// Names of the bits of `faults`, lowest first.
std::vector<std::string> names_of(std::uint32_t faults) {
  std::vector<std::string> names;
  for (unsigned bit = 0; bit < 32; ++bit) {
    if ((faults >> bit & 1u) != 0) names.emplace_back(fault_text(1u << bit));
  }
  return names;
}

/// The lines that both forms have.
void print_motion(const LoopTotals& t) {
  std::printf("  ticks            %llu (%.3f s), in contact %llu\n",
              static_cast<unsigned long long>(t.ticks), t.duration_s,
              static_cast<unsigned long long>(t.contact_ticks));
  std::printf("  largest wrench   %.4g N, %.4g N m\n", t.largest_force_n, t.largest_torque_nm);
  std::printf("  largest step     %.4g N at %.4f s, %.4g N m at %.4f s\n", t.largest_force_step_n,
              t.force_step_at_s, t.largest_torque_step_nm, t.torque_step_at_s);
  std::printf(
      "  energy           given out %.4g J at most, %.4g J at the end; observer's least "
      "%.4g J\n",
      t.largest_delivered_j, t.delivered_j, t.least_energy_j);
  std::printf("  in the last tenth %.4g m/s, %.4g rad/s at most\n", t.rest_speed_m_per_s,
              t.rest_turn_rad_per_s);
  if (t.runs_away()) {
    std::printf("  RUNS AWAY        %.4g m/s, %.4g rad/s: this hand cannot hold the loop stable\n",
                t.largest_speed_m_per_s, t.largest_turn_rad_per_s);
  }
}

/// Says whether the loop comes to rest where the hand does.
void print_rest(const RestOscillation& rest) {
  if (rest.windows == 0) {
    std::printf("  at rest          never: the hand moves all the time\n");
    return;
  }
  std::printf("  at rest          %.4g N, %.4g N m peak to peak, %s", rest.force_pp_n,
              rest.torque_pp_nm, rest.oscillates() ? "OSCILLATES" : "no oscillation");
  if (rest.oscillates()) std::printf(" at %.4g Hz by %.4f s", rest.frequency_hz, rest.at_s);
  std::printf("\n");
}

nlohmann::ordered_json rest_account(const RestOscillation& rest) {
  return {{"windows", rest.windows},
          {"force_peak_to_peak_n", rest.force_pp_n},
          {"torque_peak_to_peak_nm", rest.torque_pp_nm},
          {"share_of_allowed", rest.ratio},
          {"frequency_hz", rest.frequency_hz},
          {"at_s", rest.at_s},
          {"oscillates", rest.oscillates()}};
}

void print_end(const RunEnd& end) {
  std::printf("  result           %s\n", end.passed() ? "passed" : "FAILED");
  std::printf("%s\n", end.line().c_str());
}

nlohmann::ordered_json holds_json(const std::vector<HoldEvent>& holds) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const HoldEvent& event : holds) {
    list.push_back({{"what", event.taken ? "taken" : "let go"},
                    {"part", event.part},
                    {"asked_s", event.asked_s},
                    {"t_s", event.t_s},
                    {"force_n", event.force_n},
                    {"force_step_n", event.force_step_n},
                    {"torque_step_nm", event.torque_step_nm},
                    {"moved_m", event.moved_m}});
  }
  return list;
}

void print_holds(const std::vector<HoldEvent>& holds) {
  for (const HoldEvent& event : holds) {
    std::printf("%8.3f s  %s %s", event.t_s, event.part.c_str(), event.taken ? "taken" : "let go");
    if (!event.taken) std::printf(" from %.3g N", event.force_n);
    std::printf(": steps of force at most %.3g N, of torque %.3g N m, moved %.2g um\n",
                event.force_step_n, event.torque_step_nm, 1e6 * event.moved_m);
  }
}

}  // namespace

OtherEvents told_by(const OtherMotion& others) {
  return {others.holds().events(), others.drives().accounts()};
}

RunEnd end_of(const Hands::Each<HandAccount>& hands) {
  RunEnd end = hands[0].end;
  const RunEnd& second = hands[1].end;
  end.add_failure(!second.passed(), "second hand: " + second.line());
  return end;
}

nlohmann::ordered_json hands_account(const RunSubject& subject, const std::string& carrier,
                                     const Hands::Each<HandAccount>& hands,
                                     const OtherEvents& others) {
  const RunEnd end = end_of(hands);
  nlohmann::ordered_json json = loop_account(subject, hands[0].loop, hands[0].rest, others, end);
  nlohmann::ordered_json second =
      loop_account(subject, hands[1].loop, hands[1].rest, {}, hands[1].end);
  for (const char* key : {"scene", "law", "hand", "rate_hz", "device", "rendered"})
    second.erase(key);
  json["carrier"] = carrier;
  json["hand2"] = std::move(second);
  return json;
}

void print_hands(const RunSubject& subject, const std::string& carrier,
                 const Hands::Each<HandAccount>& hands, const OtherEvents& others) {
  std::printf("two hands on %s: carrier %s, law %s, %s hands, %g Hz, delay %u\n",
              subject.scene.c_str(), carrier.c_str(), law_name(subject.law), subject.hand.c_str(),
              subject.rate_hz, subject.device.delay_samples);
  for (std::size_t k = 0; k < hands.size(); ++k) {
    std::printf("%s hand\n", k == 0 ? "first" : "second");
    print_motion(hands[k].loop);
    print_rest(hands[k].rest);
  }
  std::printf("%s", driven_text(others.driven).c_str());
  print_end(end_of(hands));
}

std::string RunEnd::line() const { return std::string(tools::verdict_line(verdict, other).view()); }

std::string fault_words(std::uint32_t faults) {
  std::string words;
  for (const std::string& name : names_of(faults)) words += (words.empty() ? "" : "; ") + name;
  return words;
}

void add_loop_failures(RunEnd& end, const LoopTotals& t, const RestOscillation& rest,
                       bool bounded) {
  end.add_failure(!t.finite, "a number is not finite");
  end.add_failure(t.runs_away(),
                  tools::formatted("the loop runs away, %.4g m/s and %.4g rad/s: this hand cannot "
                                   "hold it stable",
                                   t.largest_speed_m_per_s, t.largest_turn_rad_per_s));
  end.add_failure(t.refused_poses > 0, std::to_string(t.refused_poses) + " poses were refused");
  end.add_failure(rest.oscillates(),
                  tools::formatted("the loop does not come to rest, %.4g N to and fro at %.4g Hz",
                                   rest.force_pp_n, rest.frequency_hz));
  end.add_failure(!bounded, "a count of work is over its bound");
}

nlohmann::ordered_json loop_account(const RunSubject& subject, const LoopTotals& t,
                                    const RestOscillation& rest, const OtherEvents& others,
                                    const RunEnd& end) {
  const DeviceModel& device = subject.device;
  nlohmann::ordered_json json;
  json["scene"] = subject.scene;
  json["law"] = law_name(subject.law);
  json["hand"] = subject.hand;
  json["rate_hz"] = subject.rate_hz;
  json["device"] = {{"mass_kg", device.mass_kg},
                    {"damping_ns_per_m", device.damping_ns_per_m},
                    {"rotor_kg_m2", device.rotor_kg_m2},
                    {"rotor_damping_nms_per_rad", device.rotor_damping_nms_per_rad},
                    {"coulomb_friction_n", device.coulomb_force_n},
                    {"coulomb_torque_nm", device.coulomb_torque_nm},
                    {"encoder_step_m", device.encoder_step_m},
                    {"encoder_step_rad", device.encoder_step_rad},
                    {"max_force_n", device.max_force_n},
                    {"max_torque_nm", device.max_torque_nm},
                    {"delay_samples", device.delay_samples}};
  json["rendered"] = {{"k_t_n_per_m", subject.rendered.k_t_n_per_m},
                      {"k_r_nm_per_rad", subject.rendered.k_r_nm_per_rad},
                      {"damping_ns_per_m", subject.rendered.damping_ns_per_m},
                      {"lowered", subject.lowered}};
  json["ticks"] = t.ticks;
  json["duration_s"] = t.duration_s;
  json["contact_ticks"] = t.contact_ticks;
  json["refused_poses"] = t.refused_poses;
  json["largest_force_n"] = t.largest_force_n;
  json["largest_torque_nm"] = t.largest_torque_nm;
  json["largest_force_step_n"] = t.largest_force_step_n;
  json["largest_force_step_at_s"] = t.force_step_at_s;
  json["largest_torque_step_nm"] = t.largest_torque_step_nm;
  json["largest_torque_step_at_s"] = t.torque_step_at_s;
  json["largest_delivered_j"] = t.largest_delivered_j;
  json["delivered_j"] = t.delivered_j;
  json["least_observed_energy_j"] = t.least_energy_j;
  json["rest_speed_m_per_s"] = t.rest_speed_m_per_s;
  json["rest_turn_rad_per_s"] = t.rest_turn_rad_per_s;
  json["smallest_proxy_gap_m"] = t.smallest_gap_m;
  json["largest_speed_m_per_s"] = t.largest_speed_m_per_s;
  json["largest_turn_rad_per_s"] = t.largest_turn_rad_per_s;
  if (!others.holds.empty()) json["holds"] = holds_json(others.holds);
  if (!others.driven.empty()) json["driven"] = driven_json(others.driven);
  json["runs_away"] = t.runs_away();
  json["rest"] = rest_account(rest);
  json["passed"] = end.passed();
  json["verdict"] = tools::verdict_json(end.verdict, end.line());
  return json;
}

void print_loop(const RunSubject& subject, const LoopTotals& t, const RestOscillation& rest,
                const OtherEvents& others, const RunEnd& end) {
  std::printf("closed loop on %s: law %s, %s hand, %g Hz, delay %u\n", subject.scene.c_str(),
              law_name(subject.law), subject.hand.c_str(), subject.rate_hz,
              subject.device.delay_samples);
  print_motion(t);
  print_holds(others.holds);
  std::printf("%s", driven_text(others.driven).c_str());
  print_rest(rest);
  print_end(end);
}

nlohmann::ordered_json stack_account(const StackSubject& subject, const StackTotals& t,
                                     const RestOscillation& rest, const OtherEvents& others,
                                     const hal::LinkCounters& link, const RunEnd& end) {
  nlohmann::ordered_json json = loop_account(subject.run, t.loop, rest, others, end);
  const nlohmann::ordered_json verdict = json["verdict"];
  json.erase("passed");
  json.erase("verdict");
  json["carrier"] = subject.carrier;
  json["report_clocked"] = subject.report_clocked;
  json["fault_script"] = subject.faults_file;
  json["limits"] = {{"max_force_n", subject.limits.max_force_n},
                    {"max_torque_nm", subject.limits.max_torque_nm},
                    {"slew_n_per_s", subject.limits.slew_n_per_s},
                    {"slew_nm_per_s", subject.limits.slew_nm_per_s}};
  json["armings"] = t.armings;
  json["faults"] = names_of(t.faults);
  json["fault_bits"] = t.faults;
  json["device_fault_bits"] = t.device_faults;
  json["first_fault_at_s"] = t.first_fault_at_s;
  json["watchdog_cuts"] = t.cuts;
  json["sends"] = t.sends;
  json["largest_handed_force_n"] = t.largest_handed_n;
  json["largest_handed_torque_nm"] = t.largest_handed_nm;
  json["largest_handed_force_step_n"] = t.largest_handed_step_n;
  json["largest_handed_force_step_at_s"] = t.handed_step_at_s;
  json["largest_handed_torque_step_nm"] = t.largest_handed_step_nm;
  json["ended_ready"] = t.ended_ready;
  json["ended_at_zero"] = t.ended_at_zero;
  json["link"] = {{"reports", link.reports},
                  {"states", link.states},
                  {"bad_length", link.bad_length},
                  {"bad_check", link.bad_check},
                  {"bad_number", link.bad_number},
                  {"not_advancing", link.not_advancing},
                  {"sent", link.sent},
                  {"send_busy", link.send_busy},
                  {"send_failed", link.send_failed},
                  {"in_failed", link.in_failed},
                  {"answers_late", link.answers_late},
                  {"connects", link.connects},
                  {"disconnects", link.disconnects},
                  {"guard_held", link.guard_held}};
  json["passed"] = end.passed();
  json["verdict"] = verdict;
  return json;
}

void print_stack(const StackSubject& subject, const StackTotals& t, const RestOscillation& rest,
                 const OtherEvents& others, const hal::LinkCounters& link, const RunEnd& end) {
  const RunSubject& run = subject.run;
  std::printf("device stack on %s: carrier %s, %s-clocked, law %s, %s hand, %g Hz, delay %u\n",
              run.scene.c_str(), subject.carrier.c_str(),
              subject.report_clocked ? "report" : "timer", law_name(run.law), run.hand.c_str(),
              run.rate_hz, run.device.delay_samples);
  print_motion(t.loop);
  print_holds(others.holds);
  std::printf("%s", driven_text(others.driven).c_str());
  print_rest(rest);
  std::printf("  handed over      %llu commands, %.4g N, %.4g N m at most\n",
              static_cast<unsigned long long>(t.sends), t.largest_handed_n, t.largest_handed_nm);
  std::printf("  largest step     %.4g N at %.4f s, %.4g N m, of what was handed over\n",
              t.largest_handed_step_n, t.handed_step_at_s, t.largest_handed_step_nm);
  std::printf("  armed            %u times; the device's watchdog cut %u times\n", t.armings,
              t.cuts);
  if (subject.carrier == "usb") {
    const auto wrong = link.bad_length + link.bad_check + link.bad_number + link.not_advancing;
    std::printf(
        "  link             %llu reports, %llu wrong; %llu sent, %llu failed; lost %llu "
        "times\n",
        static_cast<unsigned long long>(link.reports), static_cast<unsigned long long>(wrong),
        static_cast<unsigned long long>(link.sent),
        static_cast<unsigned long long>(link.send_failed + link.in_failed),
        static_cast<unsigned long long>(link.disconnects));
  }
  const std::string faults = fault_words(t.faults);
  if (faults.empty()) {
    std::printf("  faults           none\n");
  } else {
    std::printf("  faults           first at %.4f s: %s\n", t.first_fault_at_s, faults.c_str());
  }
  print_end(end);
}

}  // namespace haptic::sim
