// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/haply/haply_device.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <utility>

#include "hal/clock/servo_clock.hpp"
#include "tools/bridges/haply/haply_session.hpp"
#include "tools/bridges/haply/service_socket.hpp"

namespace haptic::tools {
namespace {

constexpr std::int64_t kHttp_ns = 500'000'000, kConnect_ns = 1'000'000'000;
constexpr std::uint64_t kMostEventReads = 4;

// Haply's tutorials (docs.haply.co, basic-force-feedback) set 300 N/m and 1 N s/m; the slider there
// ends at 800 N/m and 3 N s/m, which was not tried on a device here.
constexpr Real kStiffness_n_per_m = 300, kDamping_ns_per_m = 1;
// The sphere that tutorial 06 keeps the cursor in.
constexpr Real kReach_m = 0.10_r, kMinverseReach_m = 0.04_r;

constexpr std::array kCutTexts = {"",
                                  "the service did not answer for ten periods",
                                  "no new force came for ten periods",
                                  "the service exerts a force that another program has set",
                                  "the device says that its power supply is off",
                                  "a force that is not finite was handed over",
                                  "the service exerts nothing of the force that it is sent: its "
                                  "messages are not those of its version; start it again"};
constexpr std::array kEndTexts = {"",
                                  "the service closed the connection",
                                  "the service sent more than 64 kB at once",
                                  "ten messages in a row were wrong",
                                  "the device is no longer listed: unplugged, or switched off",
                                  "the service did not answer for 2 s",
                                  "the system did not take a message to the service"};

static_assert(kCutTexts.size() == static_cast<std::size_t>(HaplyCut::kCount) &&
              kEndTexts.size() == static_cast<std::size_t>(HaplyEnd::kCount));

template <std::size_t n>
std::string text_at(const std::array<const char*, n>& texts, std::uint64_t at) {
  return at < n ? texts[at] : "unknown";
}

std::string names_of(const std::vector<HaplyListed>& listed) {
  std::string names;
  for (const HaplyListed& one : listed) names += (names.empty() ? "" : ", ") + one.id;
  return names;
}

const char* product_of(const std::string& kind) {
  if (kind == "minverse") return "Minverse";
  return kind == "inverse3x" ? "Inverse3x" : "Inverse3";
}

std::string place_of(const std::string& host, std::uint16_t port) {
  return host + ":" + std::to_string(port);
}

constexpr const char* kSessionsTarget = "/sessions";

}  // namespace

HaplyDevice::HaplyDevice(HaplySettings settings) : settings_(std::move(settings)) {}

HaplyDevice::~HaplyDevice() { close(); }

bool HaplyDevice::ask(std::uint16_t port, const char* target, HttpAnswer& answer,
                      std::string& why) const {
  const bool is_answered = http_get(settings_.service, port, target, kMostHaplyText_bytes,
                                    hal::monotonic_ns() + kHttp_ns, answer, why);
  // The list of sessions names other programs of the machine: its status alone is kept.
  const bool is_private = std::string_view(target) == kSessionsTarget;
  if (tap() != nullptr)
    tap()->note(hal::TapKind::kAsked, is_answered ? std::int64_t{answer.status} : -1,
                std::as_bytes(std::span(std::string_view(target))),
                std::as_bytes(std::span<const char>(is_private ? std::string() : answer.body)));
  return is_answered;
}

bool HaplyDevice::find_version(HaplyVersion& version, std::uint16_t& http_port,
                               std::string& why) const {
  // 3.0 and 3.1 answer HTTP at 10000, 3.5 at 10001 beside the WebSocket; 3.0 has a prefix.
  const std::uint16_t ports[] = {settings_.http_port, settings_.websocket_port};
  std::string first_why;
  bool answers = false;
  for (const std::uint16_t port : ports) {
    for (const char* const target : {"/version", "/3.0/version"}) {
      HttpAnswer answer;
      std::string refusal;
      if (!ask(port, target, answer, refusal)) {
        if (first_why.empty()) first_why = refusal;
        break;  // the other target would not be answered either
      }
      answers = true;
      const auto read = answer.status == 200 ? read_haply_version(answer.body) : std::nullopt;
      if (!read) continue;
      version = *read;
      http_port = port;
      return true;
    }
  }
  why = answers
            ? "something answers HTTP at " + place_of(settings_.service, ports[0]) + " or " +
                  std::to_string(ports[1]) +
                  ", and it is not Haply's Inverse service: GET /version names no version; check "
                  "http_port and websocket_port"
            : "Haply's Inverse service does not answer at " +
                  place_of(settings_.service, ports[0]) + " or " + std::to_string(ports[1]) + " (" +
                  first_why +
                  "); start it (systemctl start haply-inverse-service, or Haply Hub), or set "
                  "service, http_port and websocket_port";
  return false;
}

bool HaplyDevice::choose(const HaplyInventory& inventory, HaplyListed& device, HaplyListed& grip,
                         std::string& why) const {
  const auto named = [](const std::vector<HaplyListed>& listed, const std::string& id) {
    return std::find_if(listed.begin(), listed.end(),
                        [&](const HaplyListed& one) { return one.id == id; });
  };
  if (inventory.devices.empty()) {
    why = "Haply's Inverse service runs and lists no device; plug the Inverse3 in, power and USB";
    return false;
  }
  if (settings_.device.empty() && inventory.devices.size() > 1) {
    why = "there are several devices: " + names_of(inventory.devices) +
          "; choose one with device = \"...\"";
    return false;
  }
  const auto found = settings_.device.empty() ? inventory.devices.begin()
                                              : named(inventory.devices, settings_.device);
  if (found == inventory.devices.end()) {
    why = "device \"" + settings_.device + "\" is not there; the service lists " +
          names_of(inventory.devices);
    return false;
  }
  device = *found;
  if (settings_.grip == "none") return true;
  if (settings_.grip.empty() && inventory.grips.size() > 1) {
    why = "there are several grips: " + names_of(inventory.grips) +
          "; choose one with grip = \"...\", or \"none\"";
    return false;
  }
  if (settings_.grip.empty() && inventory.grips.empty()) return true;
  const auto held =
      settings_.grip.empty() ? inventory.grips.begin() : named(inventory.grips, settings_.grip);
  if (held == inventory.grips.end()) {
    why = "grip \"" + settings_.grip + "\" is not there; " +
          (inventory.grips.empty() ? "the service lists none"
                                   : "the service lists " + names_of(inventory.grips));
    return false;
  }
  grip = *held;
  return true;
}

bool HaplyDevice::open(std::string& why) {
  close();
  const auto fail = [&](const std::string& text) {
    why = text + (last_end_.empty() ? "" : "; before: " + last_end_);
    return false;
  };
  HaplyVersion version;
  std::uint16_t http_port = 0;
  std::string text;
  if (!find_version(version, http_port, text)) return fail(text);
  if (version.format == HaplyFormat::k30)
    return fail("Inverse service " + version.text +
                " speaks the format 3.0, whose force message is not published where this bridge "
                "could be written from; install 3.1 or 3.5");
  if (version.format == HaplyFormat::kOther)
    return fail("Inverse service " + version.text +
                " is none of 3.1 and 3.5, which this bridge knows: in a format that it does not "
                "know a force is dropped without a word; install 3.5");

  auto socket = std::make_unique<ServiceSocket>(kMostHaplyText_bytes, tap());
  std::int64_t until_ns = hal::monotonic_ns() + kConnect_ns;
  const std::string place = place_of(settings_.service, settings_.websocket_port);
  if (!socket->connect(settings_.service, settings_.websocket_port, until_ns, text))
    return fail("Inverse service " + version.text + " answers by HTTP, but not at " + place + ": " +
                text + "; check websocket_port");
  HaplyInventory inventory;
  std::string message;
  if (socket->receive(message, until_ns) != ServiceSocket::Got::kText)
    return fail("Inverse service " + version.text + " at " + place +
                " does not send its inventory; start it again");
  const HaplyVerdict verdict = read_haply_inventory(message, inventory);
  if (verdict != HaplyVerdict::kOk)
    return fail("the inventory of Inverse service " + version.text + " " + to_text(verdict) +
                "; start it again");
  HaplyListed device, grip;
  if (!choose(inventory, device, grip, text)) return fail(text);

  state_facts(version, device, grip, http_port);
  has_grip_ = !grip.id.empty();
  was_on_ = false;
  releases_ = 0;
  last_end_.clear();
  last_cut_.clear();
  const HaplyChoice choice{device.id, grip.id, grip.group};
  if (tap() != nullptr) {
    const std::string names = choice.device + '\n' + choice.grip + '\n' + choice.grip_group;
    tap()->note(hal::TapKind::kChosen, 0, {}, std::as_bytes(std::span<const char>(names)));
  }
  session_ = std::make_unique<HaplySession>(std::move(socket), version.format, choice,
                                            settings_.times, settings_.accepts_other_forces, tap());
  if (session_->wake() < 0) {
    close();
    return fail("no more file descriptors; raise ulimit -n");
  }
  return true;
}

void HaplyDevice::state_facts(const HaplyVersion& version, const HaplyListed& device,
                              const HaplyListed& grip, std::uint16_t http_port) {
  hal::DeviceCapabilities c;
  c.sensed_dof = hal::kDofAll;
  c.driven_dof = hal::kDofTranslation;
  c.max_force_n = settings_.max_force_n;
  c.max_stiffness_n_per_m = kStiffness_n_per_m;
  c.max_damping_ns_per_m = kDamping_ns_per_m;
  c.workspace_radius_m = device.kind == "minverse" ? kMinverseReach_m : kReach_m;
  c.report_period_ns = settings_.times.period_ns;
  c.name = hal::device_text(product_of(device.kind));
  c.serial = hal::device_text(device.id);
  facts_.capabilities = c;
  facts_.name = std::string(product_of(device.kind)) + ", serial " + device.id + ", service " +
                version.text + (grip.id.empty() ? "" : ", grip " + grip.id);

  std::string words;
  const auto say = [&words](const std::string& text) {
    words += (words.empty() ? "" : "; ") + text;
  };
  facts_.needs.clear();
  const auto ask_for = [&](const std::string& text) {
    say(text);
    facts_.needs += (facts_.needs.empty() ? "" : "; ") + text;
  };
  if (!device.calibrated) ask_for("not calibrated yet: put the handle to the calibration point");
  if (!device.powered) ask_for("the power supply is off: plug it in and switch it on");
  if (grip.id.empty())
    say("no VerseGrip: orientation is held, and there are no buttons");
  else if (!grip.awake)
    ask_for("the grip sleeps: press its button");
  say("torque is not felt");
  if (!device.tells_force) {
    say("this service does not tell which force it exerts: forces of other programs go unseen");
  } else if (settings_.accepts_other_forces) {
    say("forces of other programs are accepted");
  }
  if (device.in_use) ask_for("another program commands this device now: end it");
  HttpAnswer answer;
  std::string ignored;
  if (version.format == HaplyFormat::k35 && ask(http_port, kSessionsTarget, answer, ignored) &&
      answer.status == 200) {
    const auto sessions = read_haply_sessions(answer.body);
    if (sessions && *sessions > 1)
      say(std::to_string(*sessions - 1) + " other session" + (*sessions > 2 ? "s" : "") +
          " connected to the service");
  }
  if (!last_end_.empty()) say("the connection before ended: " + last_end_);
  if (!last_cut_.empty()) say("the force before was taken away: " + last_cut_);
  facts_.words = words;
}

hal::BridgeRead HaplyDevice::read(std::int64_t now_ns, hal::BridgeSample& sample) {
  if (session_ == nullptr) return hal::BridgeRead::kLost;
  std::uint64_t count = 0;
  for (std::uint64_t k = 0; k < kMostEventReads; ++k)
    if (::read(session_->wake(), &count, sizeof count) <= 0) break;
  bool is_new = false;
  const HaplyReport& report = session_->report(is_new);
  if (report.cut != HaplyCut::kNone)
    last_cut_ = text_at(kCutTexts, static_cast<std::uint64_t>(report.cut));
  if (report.end != HaplyEnd::kNone) return hal::BridgeRead::kLost;
  if (report.answered_ns == 0 || now_ns - report.answered_ns > settings_.times.silent_ns())
    return hal::BridgeRead::kSilent;
  if (!is_new) return hal::BridgeRead::kSame;

  sample = {};
  sample.sampled_ns = report.answered_ns;
  for (int k = 0; k < 3; ++k) {
    sample.pose_dh.p_m[k] = static_cast<Real>(report.position_m[k]);
    sample.twist_d.linear_m_per_s[k] = static_cast<Real>(report.velocity_m_per_s[k]);
  }
  for (int k = 0; k < 4; ++k) sample.pose_dh.q_xyzw[k] = static_cast<Real>(report.q_xyzw[k]);
  // A grip does not say how fast it turns; without one nothing turns.
  sample.twist_valid = report.has_velocity != 0 && !has_grip_;
  const bool grip_is_true =
      !has_grip_ || (report.grip_awake != 0 && report.grip_ns != 0 &&
                     report.answered_ns - report.grip_ns <= kHaplyGripGone_ns);
  sample.calibrated = report.calibrated != 0 && report.moved == 0 && grip_is_true;
  sample.switches = static_cast<std::uint32_t>(report.buttons);
  if (report.cut != HaplyCut::kNone) sample.faults |= kDeviceDriveFault;
  return hal::BridgeRead::kNew;
}

bool HaplyDevice::write(std::int64_t now_ns, const Wrench& wrench_d) {
  // A service that stalls has not taken the force before.
  if (session_ == nullptr || session_->is_stalled(now_ns)) return false;
  HaplyForce force;
  force.handed_ns = now_ns;
  for (int k = 0; k < 3; ++k) force.force_n[k] = static_cast<double>(wrench_d.force_w[k]);
  force.is_on = 1;
  force.release = releases_;
  session_->hand_over(force);
  was_on_ = true;
  return true;
}

bool HaplyDevice::release(std::int64_t now_ns) {
  if (session_ == nullptr) return true;
  if (was_on_) ++releases_;
  was_on_ = false;
  HaplyForce none;
  none.handed_ns = now_ns;
  none.release = releases_;
  session_->hand_over(none);
  return session_->released() >= releases_;
}

void HaplyDevice::remember_end() {
  bool is_new = false;
  const HaplyReport& report = session_->report(is_new);
  if (report.end == HaplyEnd::kNone) return;
  last_end_ = text_at(kEndTexts, static_cast<std::uint64_t>(report.end));
  if (report.end == HaplyEnd::kErrors)
    last_end_ += ", " + std::to_string(report.wrong) + " in all; the last one " +
                 to_text(static_cast<HaplyVerdict>(report.verdict));
}

void HaplyDevice::close() noexcept {
  if (session_ == nullptr) return;
  remember_end();
  session_.reset();
}

pollfd HaplyDevice::watched() const noexcept {
  return {session_ != nullptr ? session_->wake() : -1, POLLIN, 0};
}

std::unique_ptr<hal::BridgedDevice> make_haply(const hal::DriverOptions& options,
                                               hal::DriverDefect& defect) {
  HaplySettings settings;
  const auto is_plain = [](const std::string& text, const char* also) {
    return !text.empty() && text.size() <= kMostHaplyName_bytes &&
           std::all_of(text.begin(), text.end(), [also](char c) {
             return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                    std::string_view(also).find(c) != std::string_view::npos;
           });
  };
  if (const auto* const service = options.value<std::string>("service")) {
    if (!is_plain(*service, ".-:")) {
      defect = {"service", "'" + *service +
                               "' is no name or address of a host; without scheme, port and path, "
                               "as \"127.0.0.1\""};
      return nullptr;
    }
    settings.service = *service;
  }
  for (const auto& [key, into] :
       {std::pair{"device", &settings.device}, std::pair{"grip", &settings.grip}}) {
    const auto* const name = options.value<std::string>(key);
    if (name == nullptr) continue;
    if (!is_plain(*name, ".-_")) {
      defect = {
          key,
          "'" + *name +
              "' is no name of a device; device_bridge haply --probe tells those that are there"};
      return nullptr;
    }
    *into = *name;
  }
  for (const auto& [key, into] : {std::pair{"http_port", &settings.http_port},
                                  std::pair{"websocket_port", &settings.websocket_port}}) {
    const double* const port = options.value<double>(key);
    if (port == nullptr) continue;
    if (!(*port >= 1 && *port <= 65535) || *port != static_cast<int>(*port)) {
      defect = {key, "is no port: a whole number from 1 to 65535"};
      return nullptr;
    }
    *into = static_cast<std::uint16_t>(*port);
  }
  if (const double* const force = options.value<double>("max_force")) {
    if (!(*force >= 0.1 && *force <= 10)) {
      defect = {"max_force", "is not within 0.1 and 10 N"};
      return nullptr;
    }
    settings.max_force_n = static_cast<Real>(*force);
  }
  if (const bool* const accepts = options.value<bool>("accept_other_forces"))
    settings.accepts_other_forces = *accepts;
  return std::make_unique<HaplyDevice>(std::move(settings));
}

}  // namespace haptic::tools
