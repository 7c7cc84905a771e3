// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/bus_record.hpp"

#include <algorithm>
#include <bit>
#include <type_traits>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::hal {
namespace {

constexpr std::array<std::uint8_t, 8> kMagic{'H', 'A', 'P', 'T', 'H', 'R', 'E', 'C'};
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kFrameBytes = 8, kCheckBytes = 4;
constexpr std::size_t kEventHead = 20;
constexpr std::size_t kMostPayload = kEventHead + kMostEventBytes;
constexpr std::size_t kMostHeader = 4096;
static_assert(kMostPayload >= 8 * kMostClocks);

/// Appends numbers, lowest byte first.
class Put {
 public:
  explicit Put(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}
  template <typename T>
  void operator()(const T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      (*this)(std::bit_cast<std::uint64_t>(static_cast<double>(value)));
    } else {
      const auto bits = static_cast<std::uint64_t>(value);
      for (std::size_t k = 0; k < sizeof(T); ++k)
        bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * k)));
    }
  }

 private:
  std::vector<std::uint8_t>& bytes_;
};

/// Takes them out again; beyond the end all is zero and `short_of` is set.
class Take {
 public:
  explicit Take(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}
  template <typename T>
  void operator()(T& value) noexcept {
    if constexpr (std::is_floating_point_v<T>) {
      std::uint64_t bits = 0;
      (*this)(bits);
      value = static_cast<T>(std::bit_cast<double>(bits));
    } else if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t bits = 0;
      (*this)(bits);
      value = bits != 0;
    } else {
      std::uint64_t bits = 0;
      for (std::size_t k = 0; k < sizeof(T); ++k) bits |= std::uint64_t{byte()} << (8 * k);
      value = static_cast<T>(bits);
    }
  }
  [[nodiscard]] std::uint8_t byte() noexcept {
    if (at_ < bytes_.size()) return bytes_[at_++];
    short_of_ = true;
    return 0;
  }
  [[nodiscard]] bool whole() const noexcept { return !short_of_ && at_ == bytes_.size(); }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool short_of_ = false;
};

// The order of the fields in the file; `Each` is Put or Take.
template <typename Each, typename Vector>
void each_of(Each& each, Vector& v) {
  for (int k = 0; k < 3; ++k) each(v[k]);
}

template <typename Each, typename Turn>
void each_of_turn(Each& each, Turn& q) {
  for (int k = 0; k < 4; ++k) each(q.coeffs()[k]);
}

template <typename Each, typename Limits>
void limits_fields(Each& each, Limits& l) {
  each(l.max_force_n), each(l.max_torque_nm);
  each_of(each, l.max_axis_force_n), each_of(each, l.max_axis_torque_nm);
  each(l.slew_n_per_s), each(l.slew_nm_per_s), each(l.ramp_in_s), each(l.driven_dof);
  each(l.full_speed_m_per_s), each(l.zero_speed_m_per_s);
  each(l.full_turn_rad_per_s), each(l.zero_turn_rad_per_s);
  each(l.period_ns), each(l.held_periods), each(l.lost_periods), each(l.decay_per_period);
  each(l.jump_speed_m_per_s), each(l.jump_turn_rad_per_s);
}

template <typename Each, typename Parameters>
void servo_fields(Each& each, Parameters& p) {
  each(p.map.scale);
  each_of_turn(each, p.map.q_wd), each_of_turn(each, p.map.q_ha);
  each_of(each, p.map.offset_w), each_of(each, p.map.grip_a);
  each_of(each, p.map.handle_offset_h);
  limits_fields(each, p.limits);
  each(p.switches.deadman), each(p.switches.clutch), each(p.switches.emergency_stop);
  each_of(each, p.envelope.centre_w), each_of(each, p.envelope.half_extent_m);
  each_of_turn(each, p.envelope.q_wa), each(p.envelope.max_angle_rad);
}

template <typename Each, typename Session>
void session_fields(Each& each, Session& s) {
  each(s.scene_hash), each(s.vendor_id), each(s.product_id);
  each(s.period_ns), each(s.report_clocked);
  servo_fields(each, s.servo);
  limits_fields(each, s.link.limits);
  each(s.link.deadman), each(s.link.in_transfers), each(s.link.silence_ns);
  each(s.link.corrupt_in_a_row), each(s.link.frozen_in_a_row);
  each(s.link.answer_wait_ns), each(s.link.retry_ns);
}

template <typename Each, typename Tick>
void tick_fields(Each& each, Tick& t) {
  each(t.tick), each(t.now_ns), each(t.late_periods), each(t.emergency_stop);
  each(t.sequence), each(t.stamp_ns), each(t.link), each(t.twist_valid), each(t.device_faults);
  each(t.state_content), each(t.accepted_tick);
  for (auto& component : t.accepted_d) each(component);
  each(t.state_hash);
  for (auto& component : t.command_d) each(component);
  each(t.command_sequence), each(t.arming), each(t.faults), each(t.limiter_flags);
  each(t.arming_state);
}

template <typename Each, typename Frame>
void frame_fields(Each& each, Frame& f) {
  each(f.number), each(f.stamp_ns);
  for (auto& component : f.p_m) each(component);
  for (auto& component : f.q_xyzw) each(component);
  each(f.fastest_m_per_s), each(f.fastest_rad_per_s), each(f.late_ns), each(f.stands);
}

template <typename Each, typename Given>
void given_fields(Each& each, Given& g) {
  each(g.number);
  if (g.kind == RecordedGiven::Kind::kFrame) frame_fields(each, g.frame);
}

template <typename Each, typename End>
void end_fields(Each& each, End& e) {
  each(e.records), each(e.dropped_events), each(e.dropped_ticks);
}

template <typename Each, typename Event>
void event_fields(Each& each, Event& e) {
  std::uint16_t reserved = 0;
  each(e.code), each(e.why), each(reserved), each(e.stamp_ns), each(e.number);
}

void append_check(std::vector<std::uint8_t>& file, std::size_t begin) {
  Put put(file);
  put(crc32(std::span<const std::uint8_t>(file).subspan(begin)));
}

/// One record whose payload `fill` appends.
template <typename Fill>
void append_record(std::vector<std::uint8_t>& file, std::uint8_t kind, Fill fill) {
  const std::size_t begin = file.size();
  Put put(file);
  put(std::uint32_t{0});
  put(std::uint32_t{kind});
  fill(put);
  const std::size_t payload = file.size() - begin - kFrameBytes;
  for (std::size_t k = 0; k < 4; ++k)
    file[begin + k] = static_cast<std::uint8_t>(payload >> (8 * k));
  append_check(file, begin);
}

std::uint32_t number_at(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  std::uint32_t value = 0;
  Take take(bytes.subspan(at, 4));
  take(value);
  return value;
}

std::array<double, 6> six_of(const WrenchRecord& w) noexcept {
  return {w.force_n[0], w.force_n[1], w.force_n[2], w.torque_nm[0], w.torque_nm[1], w.torque_nm[2]};
}

/// By words of 64 bits: cheap enough for the servo thread.
std::uint64_t content_of(const DeviceState& state) noexcept {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&hash](std::uint64_t word) { hash = (hash ^ word) * 0x100000001b3u; };
  const auto add_all = [&add](const auto& values) {
    for (const Real value : values) add(std::bit_cast<std::uint64_t>(static_cast<double>(value)));
  };
  add_all(state.pose_dh.p_m);
  add_all(state.pose_dh.q_xyzw);
  add_all(state.twist_d.linear_m_per_s);
  add_all(state.twist_d.angular_rad_per_s);
  add(state.switches);
  return hash;
}

/// True if the payload has the size of its kind.
bool fits(const BusRecord& record) noexcept {
  const std::size_t size = record.payload.size();
  if (record.kind == static_cast<std::uint8_t>(LinkEventKind::kClock))
    return size > 0 && size % 8 == 0 && size <= 8 * kMostClocks;
  if (record.kind >= 1 && record.kind <= kMostLinkEventKind) return size >= kEventHead;
  if (record.kind == kTickRecord) {
    RecordedTick tick;
    Take take(record.payload);
    tick_fields(take, tick);
    return take.whole();
  }
  if (record.is_given()) {
    RecordedGiven given;
    given.kind = static_cast<RecordedGiven::Kind>(record.kind);
    Take take(record.payload);
    given_fields(take, given);
    return take.whole();
  }
  return record.kind == kEndRecord && size == 24;
}

}  // namespace

RecordedTick recorded(const ServoInput& input, const ServoResult& result) noexcept {
  RecordedTick t;
  t.tick = result.command.tick;
  t.now_ns = input.now_ns;
  t.late_periods = input.late_periods;
  t.emergency_stop = input.emergency_stop;
  t.sequence = input.state.sequence;
  t.stamp_ns = input.state.stamp_ns;
  t.link = static_cast<std::uint8_t>(input.state.link);
  t.twist_valid = input.state.twist_valid;
  t.device_faults = input.state.faults;
  t.state_content = content_of(input.state);
  t.accepted_tick = input.state.accepted_tick;
  t.accepted_d = six_of(input.state.accepted_d);
  t.state_hash = result.rendered.state_hash;
  t.command_d = six_of(result.command.wrench_d);
  t.command_sequence = result.command.sequence;
  t.arming = result.command.arming;
  t.faults = result.faults;
  t.limiter_flags = result.limiter_flags;
  t.arming_state = static_cast<std::uint8_t>(result.arming);
  return t;
}

void append_header(std::vector<std::uint8_t>& file, const BusSession& session) {
  const std::size_t begin = file.size();
  file.insert(file.end(), kMagic.begin(), kMagic.end());
  Put put(file);
  put(kVersion);
  put(std::uint32_t{0});
  put(static_cast<std::uint8_t>(sizeof(Real)));
  const std::string name = session.driver.substr(0, kMostDriverName);
  put(static_cast<std::uint8_t>(name.size()));
  file.insert(file.end(), name.begin(), name.end());
  session_fields(put, session);
  const std::size_t size = file.size() - begin + kCheckBytes;
  for (std::size_t k = 0; k < 4; ++k)
    file[begin + 12 + k] = static_cast<std::uint8_t>(size >> (8 * k));
  append_check(file, begin);
}

void append_event(std::vector<std::uint8_t>& file, const LinkEvent& event) {
  append_record(file, static_cast<std::uint8_t>(event.kind), [&](Put& put) {
    event_fields(put, event);
    const auto kept = event.bytes.first(std::min(event.bytes.size(), kMostEventBytes));
    file.insert(file.end(), kept.begin(), kept.end());
  });
}

void append_clocks(std::vector<std::uint8_t>& file, std::span<const std::int64_t> stamps_ns) {
  append_record(file, static_cast<std::uint8_t>(LinkEventKind::kClock), [&](Put& put) {
    for (const std::int64_t stamp : stamps_ns.first(std::min(stamps_ns.size(), kMostClocks)))
      put(stamp);
  });
}

void append_tick(std::vector<std::uint8_t>& file, const RecordedTick& tick) {
  append_record(file, kTickRecord, [&](Put& put) { tick_fields(put, tick); });
}

void append_given(std::vector<std::uint8_t>& file, const RecordedGiven& given) {
  append_record(file, static_cast<std::uint8_t>(given.kind),
                [&](Put& put) { given_fields(put, given); });
}

void append_end(std::vector<std::uint8_t>& file, const RecordEnd& end) {
  append_record(file, kEndRecord, [&](Put& put) { end_fields(put, end); });
}

RecordDefect read_header(std::span<const std::uint8_t> file, BusSession& session,
                         std::size_t& first) {
  RecordDefect defect;
  const auto refuse = [&](std::string text) {
    defect.text = std::move(text);
    return defect;
  };
  if (file.size() < 16 || !std::equal(kMagic.begin(), kMagic.end(), file.begin()))
    return refuse("not a recording: it does not begin with HAPTHREC");
  const std::uint32_t version = number_at(file, 8);
  if (version != kVersion)
    return refuse("version " + std::to_string(version) + " of the format, this program reads " +
                  std::to_string(kVersion) + "; record again");
  const std::size_t size = number_at(file, 12);
  if (size < 24 || size > kMostHeader) return refuse("the header says an impossible length");
  if (size > file.size()) {
    defect.cut = true;
    return refuse("the file ends within the header");
  }
  if (crc32(file.first(size - kCheckBytes)) != number_at(file, size - kCheckBytes))
    return refuse("the header's check sum is wrong");
  if (file[16] != sizeof(Real))
    return refuse("recorded with numbers of " + std::to_string(file[16]) +
                  " bytes, this program computes with " + std::to_string(sizeof(Real)) +
                  "; play it with a program of the same HAPTIC_REAL");
  const std::size_t name = file[17];
  if (name > kMostDriverName || 18 + name + kCheckBytes > size)
    return refuse("the driver's name is longer than the header");
  session.driver.assign(file.begin() + 18, file.begin() + 18 + static_cast<std::ptrdiff_t>(name));
  Take take(file.subspan(18 + name, size - kCheckBytes - 18 - name));
  session_fields(take, session);
  if (!take.whole()) return refuse("the header has another length than its fields");
  first = size;
  return defect;
}

bool BusRecordReader::refuse(std::string text, bool cut) {
  defect_ = {number_ + 1, at_, cut, std::move(text)};
  return false;
}

bool BusRecordReader::next(BusRecord& record) {
  if (!defect_.text.empty() || at_ >= file_.size()) return false;
  const std::size_t left = file_.size() - at_;
  if (left < kFrameBytes) return refuse("the file ends within a record", true);
  const std::size_t payload = number_at(file_, at_);
  const std::uint32_t kind = number_at(file_, at_ + 4);
  // Before the length is believed: damage to it must not look like the end of the file.
  if (payload > kMostPayload) return refuse("impossible length " + std::to_string(payload));
  const std::size_t size = kFrameBytes + payload + kCheckBytes;
  if (size > left) return refuse("the file ends within a record", true);
  const std::size_t checked = size - kCheckBytes;
  if (crc32(file_.subspan(at_, checked)) != number_at(file_, at_ + checked))
    return refuse("wrong check sum");
  BusRecord found{number_ + 1, at_, static_cast<std::uint8_t>(kind),
                  file_.subspan(at_ + kFrameBytes, payload)};
  if (kind > 0xff || !fits(found)) return refuse("a record of no known kind and length");
  record = found;
  ++number_;
  at_ += size;
  return true;
}

LinkEvent event_of(const BusRecord& record) noexcept {
  LinkEvent event;
  event.kind = static_cast<LinkEventKind>(record.kind);
  Take take(record.payload.first(kEventHead));
  event_fields(take, event);
  event.bytes = record.payload.subspan(kEventHead);
  return event;
}

std::size_t clock_count(const BusRecord& record) noexcept { return record.payload.size() / 8; }

std::int64_t clock_of(const BusRecord& record, std::size_t index) noexcept {
  std::int64_t stamp_ns = 0;
  Take take(record.payload.subspan(8 * index, 8));
  take(stamp_ns);
  return stamp_ns;
}

RecordedTick tick_of(const BusRecord& record) noexcept {
  RecordedTick tick;
  Take take(record.payload);
  tick_fields(take, tick);
  return tick;
}

RecordedGiven given_of(const BusRecord& record) noexcept {
  RecordedGiven given;
  given.kind = static_cast<RecordedGiven::Kind>(record.kind);
  Take take(record.payload);
  given_fields(take, given);
  return given;
}

RecordEnd end_of(const BusRecord& record) noexcept {
  RecordEnd end;
  Take take(record.payload);
  end_fields(take, end);
  return end;
}

}  // namespace haptic::hal
