// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/bus_player.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include "hal/device_mailbox.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/usb/usb_link.hpp"
#include "host_sim/device/played_servo.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

using hal::LinkEvent;
using hal::LinkEventKind;
using hal::RecordedTick;

bool is_same(const LinkEvent& a, const LinkEvent& b) {
  // Why a device was lost is the bus's affair; here it is always unplugged.
  const bool same_why = a.kind == LinkEventKind::kLink || a.why == b.why;
  return a.kind == b.kind && a.code == b.code && same_why && a.stamp_ns == b.stamp_ns &&
         a.number == b.number && std::ranges::equal(a.bytes, b.bytes);
}

/// The link over a bus that does what the tape says.
class BusPlayer final : private hal::LinkTape, private UsbFunction, private hal::SwitchSource {
 public:
  BusPlayer(CoreSession& session, const hal::BusSession& header, std::span<const std::uint8_t> file,
            std::size_t first, PlayWatch watch)
      : file_(file),
        first_(first),
        servo_(session, header, file, first, std::move(watch)),
        track_(file, first) {
    hal::LinkSettings settings = header.link;
    settings.address = {};
    settings.clock = &BusPlayer::clock;
    settings.clock_context = this;
    settings.slept = &BusPlayer::slept;
    settings.switches = this;
    link_ = std::make_unique<hal::UsbLink>(driver_, mailbox_, settings);
    link_->set_wrapped_fd(-1);  // nothing is searched for
    link_->tape(this);
  }
  ~BusPlayer() override {
    stopped_ = true;
    if (carrier_) carrier_->unplug();
    static_cast<void>(link_->poll(0));
    link_.reset();
  }
  BusPlayer(const BusPlayer&) = delete;
  BusPlayer& operator=(const BusPlayer&) = delete;

  /// `cut`: where the file ends, unless it is `complete`.
  PlayResult play(bool complete, const std::string& cut);

 private:
  static std::int64_t clock(void* self);
  static std::int64_t slept(void* self);
  [[nodiscard]] std::uint32_t pressed() noexcept override;
  void on_event(const LinkEvent& event) noexcept override;
  void on_state(const haptic::DeviceState& state) noexcept override;
  void prepare();
  void feed();
  void plug();
  void give_command();
  void diverge_at_tick();
  void diverge(const std::string& what, std::uint64_t sequence, std::uint64_t tick);
  void finish_ticks();
  [[nodiscard]] std::uint64_t tick_that_saw(std::uint64_t sequence) const;

  [[nodiscard]] std::vector<std::uint8_t> descriptors() const override {
    return reference_descriptors();
  }
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
              std::uint16_t index, std::span<std::uint8_t> bytes) override;
  int out(std::uint8_t /*endpoint*/, std::span<const std::uint8_t> bytes) override {
    return static_cast<int>(bytes.size());
  }

  std::span<const std::uint8_t> file_;
  std::size_t first_;
  PlayedServo servo_;
  EventTrack track_;
  hal::ReferenceDriver driver_;
  hal::MailboxMemory mailbox_;
  hal::ServoSide servo_end_{mailbox_};
  std::unique_ptr<UsbfsCarrier> carrier_, before_;  ///< libusb may still have the last one open
  std::unique_ptr<hal::UsbLink> link_;
  PlayResult result_;
  std::int64_t first_ns_ = 0, last_ns_ = 0, slept_ns_ = 0;
  std::uint32_t pressed_ = 0;   ///< beside the device
  std::uint64_t sequence_ = 0;  ///< of the last report
  bool fed_ = false;            ///< what ends next on the bus is on its way
  bool stopped_ = false;
};

// Looks that are not on the tape are given the next that is, so that a wait which ran out does.
std::int64_t BusPlayer::clock(void* self) {
  const auto& player = *static_cast<BusPlayer*>(self);
  const bool known = !player.stopped_ && player.track_.next_is(LinkEventKind::kClock);
  return known ? player.track_.next().stamp_ns : player.last_ns_;
}

std::int64_t BusPlayer::slept(void* self) {
  auto& player = *static_cast<BusPlayer*>(self);
  if (!player.stopped_ && player.track_.next_is(LinkEventKind::kSuspended))
    player.slept_ns_ = static_cast<std::int64_t>(player.track_.next().number);
  return player.slept_ns_;
}

std::uint32_t BusPlayer::pressed() noexcept {
  if (!stopped_ && track_.next_is(LinkEventKind::kSwitches))
    pressed_ = static_cast<std::uint32_t>(track_.next().number);
  return pressed_;
}

void BusPlayer::on_event(const LinkEvent& event) noexcept {
  if (stopped_) return;
  if (!track_.has_next()) {  // the recording ends in the middle of a turn
    stopped_ = true;
    return;
  }
  const LinkEvent& expected = track_.next();
  if (!is_same(expected, event)) {
    const std::uint64_t sequence =
        expected.kind == LinkEventKind::kReport ? expected.number : sequence_;
    diverge(difference(expected, event), sequence, tick_that_saw(sequence));
    return;
  }
  switch (event.kind) {
    case LinkEventKind::kClock:
      last_ns_ = event.stamp_ns;
      if (first_ns_ == 0) first_ns_ = last_ns_;
      break;
    case LinkEventKind::kReport:
      ++result_.reports;
      sequence_ = event.number;
      fed_ = false;
      break;
    case LinkEventKind::kOutEnd:
    case LinkEventKind::kOutCleared:
      fed_ = false;
      break;
    case LinkEventKind::kSend:
      ++result_.sends;
      break;
    default:
      break;
  }
  track_.advance();
  if (event.kind == LinkEventKind::kTurn) {
    fed_ = false;
    plug();
  }
  prepare();
}

void BusPlayer::on_state(const haptic::DeviceState& state) noexcept {
  if (stopped_) return;
  servo_.publish(state);
  servo_.run();
}

// Prepares what the next event needs before it comes.
void BusPlayer::prepare() {
  if (!track_.has_next()) return;
  switch (track_.next().kind) {
    case LinkEventKind::kCommand:
      give_command();
      break;
    case LinkEventKind::kServoLost:
      link_->servo_lost();
      break;
    case LinkEventKind::kStopCalled:
      link_->emergency_stop();
      break;
    case LinkEventKind::kLost:
      if (carrier_) carrier_->unplug();
      break;
    case LinkEventKind::kSendRefused:
      if (carrier_) carrier_->refuse_submit(ReferenceUsb::kOutEndpoint, -ENOMEM);
      break;
    default:
      break;
  }
  if (!fed_ && carrier_ && !stopped_) feed();
}

// Ends the transfers that end next on the bus within this turn, one at a time: the order is the
// recorded one.
void BusPlayer::feed() {
  const auto ends = [](const LinkEvent& e) {
    return e.kind == LinkEventKind::kReport || e.kind == LinkEventKind::kOutEnd ||
           e.kind == LinkEventKind::kOutCleared || e.kind == LinkEventKind::kLost;
  };
  const std::optional<LinkEvent> end = track_.in_this_turn(ends);
  if (!end || end->kind == LinkEventKind::kLost) return;
  if (end->kind == LinkEventKind::kReport) {
    fed_ = true;
    carrier_->push(ReferenceUsb::kInEndpoint, end->bytes);
    return;
  }
  if (end->kind == LinkEventKind::kOutCleared) {
    if (carrier_->waiting(0) == 0) return;  // not asked for yet
    fed_ = true;
    carrier_->hold_control(false);
    return;
  }
  if (carrier_->waiting(ReferenceUsb::kOutEndpoint) == 0) return;  // not yet, or taken back
  fed_ = true;
  const auto how = static_cast<hal::OutEnd>(end->code);
  if (how == hal::OutEnd::kStalled) carrier_->hold_control(true);  // until it is cleared
  if (how != hal::OutEnd::kDelivered)
    carrier_->fail_next(ReferenceUsb::kOutEndpoint,
                        how == hal::OutEnd::kStalled ? -EPIPE : -EPROTO);
  carrier_->hold_out(false);
  carrier_->hold_out(true);
}

// A turn in which the link began to start a device had one to open; in any other it has none.
void BusPlayer::plug() {
  if (link_->state() != LinkState::kAbsent) return;
  const bool starts = track_
                          .in_this_turn([](const LinkEvent& e) {
                            return e.kind == LinkEventKind::kLink &&
                                   e.code == static_cast<std::uint8_t>(LinkState::kStarting);
                          })
                          .has_value();
  if (!starts) return link_->set_wrapped_fd(-1);
  ++result_.connects;
  before_ = std::move(carrier_);
  UsbFunction& device = *this;
  carrier_ = std::make_unique<UsbfsCarrier>(device);
  carrier_->hold_out(true);
  link_->set_wrapped_fd(carrier_->descriptor());
}

int BusPlayer::control(std::uint8_t request_type, std::uint8_t /*request*/, std::uint16_t /*value*/,
                       std::uint16_t /*index*/, std::span<std::uint8_t> bytes) {
  if ((request_type & 0x60u) == 0) return 0;  // standard: nobody else's affair
  const std::optional<LinkEvent> answer =
      track_.in_this_turn([](const LinkEvent& e) { return e.kind == LinkEventKind::kControl; });
  if (!answer || answer->code != static_cast<std::uint8_t>(hal::HalStatus::kOk)) return -EPIPE;
  const std::size_t moved = std::min(bytes.size(), answer->bytes.size());
  std::copy_n(answer->bytes.begin(), moved, bytes.begin());
  return static_cast<int>(moved);
}

void BusPlayer::give_command() {
  const LinkEvent& taken = track_.next();
  const DeviceCommand* command = servo_.command(taken.number, taken.stamp_ns);
  if (command != nullptr) {
    servo_end_.publish(*command);
  } else if (servo_.track().has_next()) {
    diverge_at_tick();
  } else if (result_.complete) {
    diverge("\n  expected " + text_of(taken) + ", which no recorded tick has made", sequence_, 0);
  } else {
    stopped_ = true;  // the file ends before that tick
  }
}

void BusPlayer::diverge_at_tick() {
  if (result_.diverged) return;
  const RecordedTick& tick = servo_.track().next();
  std::string what = servo_.difference_found();
  if (what.empty()) {
    const haptic::DeviceState& newest = servo_.newest_state();
    what = "\n  expected a state of sequence " + std::to_string(tick.sequence) + ", link " +
           std::to_string(tick.link) + ", faults " + std::to_string(tick.device_faults) +
           ", answer to tick " + std::to_string(tick.accepted_tick) +
           "\n  found    the link's newest: " + std::to_string(newest.sequence) + ", " +
           std::to_string(static_cast<unsigned>(newest.link)) + ", " +
           std::to_string(newest.faults) + ", " + std::to_string(newest.accepted_tick);
  }
  diverge(what, tick.sequence, tick.tick);
  result_.record = servo_.track().place().record;
  result_.offset = servo_.track().place().offset;
}

void BusPlayer::diverge(const std::string& what, std::uint64_t sequence, std::uint64_t tick) {
  stopped_ = true;
  result_.diverged = true;
  result_.tick = tick;
  result_.record = track_.place().record;
  result_.offset = track_.place().offset;
  result_.text = what + "\n  reports around it:" + reports_around(file_, first_, sequence);
}

std::uint64_t BusPlayer::tick_that_saw(std::uint64_t sequence) const {
  for (TickTrack ahead(file_, first_); ahead.has_next(); ahead.advance()) {
    if (ahead.next().sequence >= sequence) return ahead.next().tick;
  }
  return 0;
}

// Nobody takes these commands any more. What the link published after its tape had ended is not
// known; a tick in the time of the tape must find its state.
void BusPlayer::finish_ticks() {
  servo_.run_to_end();
  if (!servo_.track().has_next()) return;
  if (!servo_.difference_found().empty() || servo_.track().next().now_ns <= last_ns_)
    return diverge_at_tick();
  for (TickTrack left = servo_.track(); left.has_next(); left.advance()) ++result_.ticks_beyond;
}

PlayResult BusPlayer::play(bool complete, const std::string& cut) {
  result_.complete = complete;
  if (!complete) result_.cut = cut;
  while (!stopped_ && track_.has_next() && !track_.next_is(LinkEventKind::kClose)) {
    if (!track_.next_is(LinkEventKind::kTurn)) {
      diverge("\n  expected " + text_of(track_.next()) + "\n  found    the end of the turn",
              sequence_, tick_that_saw(sequence_));
      break;
    }
    static_cast<void>(link_->poll(0));
    if (!servo_.difference_found().empty()) diverge_at_tick();
  }
  stopped_ = true;
  if (!result_.diverged) finish_ticks();
  result_.ticks = servo_.ticks();
  result_.duration_s = 1e-9 * static_cast<double>(last_ns_ - first_ns_);
  return result_;
}

/// All of the file once: nothing is played that is damaged somewhere.
hal::RecordDefect check_records(std::span<const std::uint8_t> file, std::size_t first,
                                std::optional<hal::RecordEnd>& end) {
  hal::BusRecordReader reader(file, first);
  hal::BusRecord record;
  while (reader.next(record)) {
    if (record.kind == hal::kEndRecord) end = hal::end_of(record);
  }
  return reader.defect();
}

std::string place_text(const std::string& name, const hal::RecordDefect& defect) {
  const std::string where = defect.record == 0 ? std::string("header")
                                               : "record " + std::to_string(defect.record) +
                                                     " at byte " + std::to_string(defect.offset);
  return name + ": " + where + ": " + defect.text;
}

}  // namespace

PlayResult play_session(CoreSession& session, std::span<const std::uint8_t> file,
                        const std::string& name, PlayWatch watch) {
  hal::BusSession header;
  std::size_t first = 0;
  const hal::RecordDefect bad_header = hal::read_header(file, header, first);
  if (!bad_header.text.empty()) throw tools::InputError(place_text(name, bad_header));
  if (header.scene_hash != session.view().header().content_hash)
    throw tools::InputError(
        name +
        ": recorded with another scene than the one given; name the scene "
        "file of the recording, compiled by the same compiler, and --device and --delay "
        "where the run had them");
  if (header.driver != hal::ReferenceDriver().profile().name)
    throw tools::InputError(name + ": recorded with the driver '" + header.driver +
                            "'; only sessions of the reference device can be played");
  std::optional<hal::RecordEnd> end;
  const hal::RecordDefect defect = check_records(file, first, end);
  if (!defect.text.empty() && !defect.cut) throw tools::InputError(place_text(name, defect));
  if (end && end->dropped_events + end->dropped_ticks > 0)
    throw tools::InputError(name + ": " + std::to_string(end->dropped_events) + " events and " +
                            std::to_string(end->dropped_ticks) +
                            " ticks were dropped while recording; record again on a machine "
                            "with less load");
  BusPlayer player(session, header, file, first, std::move(watch));
  return player.play(end.has_value(),
                     defect.cut ? place_text(name, defect) : name + ": the last record is missing");
}

std::vector<std::uint8_t> read_recording(const std::string& path) {
  tools::note_input(path, "the recording");
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : -1;
  if (size < 0) throw tools::InputError(path + ": cannot be opened; check the path");
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  stream.seekg(0);
  if (size > 0) stream.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!stream) throw tools::InputError(path + ": cannot be read to its end");
  return bytes;
}

}  // namespace haptic::sim
