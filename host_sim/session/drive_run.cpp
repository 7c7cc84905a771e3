// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/drive_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

constexpr const char* kDrivenHeader =
    "t_s,part,commanded_x_m,commanded_y_m,commanded_z_m,commanded_qw,commanded_qx,commanded_qy,"
    "commanded_qz,felt_x_m,felt_y_m,felt_z_m,felt_qw,felt_qx,felt_qy,felt_qz,lag_m,lag_rad,"
    "pushed_x_n,pushed_y_n,pushed_z_n,pushed_x_nm,pushed_y_nm,pushed_z_nm,touches,lost\n";

FrameRecord given_pose(const MotionSample& pose, std::uint64_t number, bool is_last) {
  FrameRecord record;
  record.number = number;
  record.stamp_ns = DriveRun::stamp_ns(pose.t_s);
  std::copy_n(pose.p, 3, record.p_m);
  for (int k = 0; k < 4; ++k) record.q_xyzw[k] = pose.q_wxyz[(k + 1) % 4];
  record.stands = is_last ? 1 : 0;
  return record;
}

void append_pose_cells(std::string& csv, const Pose& pose) {
  for (int k = 0; k < 3; ++k) append_number(csv += ',', static_cast<double>(pose.p_wa[k]));
  const Quat& q = pose.q_wa;
  for (const Real x : {q.w(), q.x(), q.y(), q.z()})
    append_number(csv += ',', static_cast<double>(x));
}

void append_cells_of(std::string& csv, const Vec3& v) {
  for (int k = 0; k < 3; ++k) append_number(csv += ',', static_cast<double>(v[k]));
}

}  // namespace

DriveStream read_drive(const std::string& argument) {
  const std::size_t at = argument.find('=');
  if (at == 0 || at == std::string::npos || at + 1 == argument.size())
    throw tools::UsageError("--drive " + argument +
                            ": give PART=MOTION, as in fixture=motion.toml");
  DriveStream stream{argument.substr(0, at), argument.substr(at + 1), {}};
  stream.poses = stream.file.ends_with(".csv") ? read_motion_csv(stream.file)
                                               : make_motion(read_motion_script(stream.file));
  return stream;
}

std::vector<DriveStream> read_drives(const std::vector<std::string>& arguments) {
  std::vector<DriveStream> streams;
  for (const std::string& argument : arguments) streams.push_back(read_drive(argument));
  return streams;
}

std::string driven_text(const std::vector<DrivenAccount>& driven) {
  std::string text;
  for (const DrivenAccount& part : driven) {
    if (part.is_loose) {
      text += tools::formatted(
          "  loose            %s: ends %.4g mm from its start; touched for %.3g s "
          "by at most %.4g N\n",
          part.part.c_str(), 1e3 * part.moved_m, part.touched_s, part.largest_push_n);
      continue;
    }
    text += tools::formatted("  driven           %s: %llu poses; ", part.part.c_str(),
                             static_cast<unsigned long long>(part.poses));
    text += tools::formatted("touched for %.3g s by at most %.4g N; ", part.touched_s,
                             part.largest_push_n);
    text += tools::formatted("behind by at most %.3g um and %.2g mrad, at %.3f s",
                             1e6 * part.largest_lag_m, 1e3 * part.largest_lag_rad, part.lag_at_s);
    if (part.lost_s > 0)
      text += tools::formatted("; lost for %.3g s from %.3f s on", part.lost_s, part.lost_from_s);
    text += '\n';
  }
  return text;
}

nlohmann::ordered_json driven_json(const std::vector<DrivenAccount>& driven) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const DrivenAccount& part : driven) {
    list.push_back({{"part", part.part},
                    {"poses", part.poses},
                    {"largest_lag_m", part.largest_lag_m},
                    {"largest_lag_rad", part.largest_lag_rad},
                    {"largest_lag_at_s", part.lag_at_s},
                    {"largest_push_n", part.largest_push_n},
                    {"touched_s", part.touched_s},
                    {"lost_s", part.lost_s},
                    {"lost_from_s", part.lost_from_s},
                    {"released_s", part.released_s}});
    if (part.is_loose) list.back()["loose_moved_m"] = part.moved_m;
  }
  return list;
}

std::int64_t DriveRun::stamp_ns(double t_s) {
  constexpr std::int64_t kFirst_ns = 1'000'000;  // a stamp of 0 is none
  return kFirst_ns + std::llround(1e9 * t_s);
}

DriveRun::DriveRun(CoreSession& session, std::vector<DriveStream> streams) : session_(session) {
  const PartScenes* const parts = session.parts();
  const std::span<const DrivenRecord> driven =
      parts != nullptr ? parts->driven() : std::span<const DrivenRecord>();
  if (!streams.empty() && driven.empty()) {
    throw tools::InputError("--drive " + streams[0].part +
                            ": the scene has no driven part; give one role = \"driven\" in its "
                            "[[part]] table and compile it again");
  }
  players_.resize(driven.size());
  records_.resize(driven.size());
  std::string names;
  for (const DrivenRecord& record : driven) {
    DrivenAccount& account = accounts_.emplace_back();
    account.part = parts->name(record.part);
    account.is_loose = record.lead != Lead::kOwner;
    if (!account.is_loose) names += (names.empty() ? "" : ", ") + account.part;
  }
  for (DriveStream& stream : streams) {
    const auto named = [&](const DrivenAccount& account) {
      return account.part == stream.part && !account.is_loose;
    };
    const auto found = std::ranges::find_if(accounts_, named);
    if (found == accounts_.end())
      throw tools::InputError("--drive " + stream.part +
                              ": no part of that name is driven; those are: " + names);
    Player& player = players_[static_cast<std::size_t>(found - accounts_.begin())];
    if (!player.poses.empty())
      throw tools::InputError("--drive " + stream.part + ": is given twice; keep one");
    player.poses = std::move(stream.poses);
  }
  if (!driven.empty()) csv_ = kDrivenHeader;
}

std::span<const FrameRecord> DriveRun::at(double t_s) {
  constexpr double kSameTime_s = 1e-9;
  for (std::size_t k = 0; k < players_.size(); ++k) {
    Player& player = players_[k];
    while (player.next < player.poses.size() &&
           player.poses[player.next].t_s <= t_s + kSameTime_s) {
      const MotionSample& pose = player.poses[player.next++];
      records_[k] = given_pose(pose, player.next, player.next == player.poses.size());
      accounts_[k].poses += 1;
    }
  }
  return records_;
}

DrivenInput DriveRun::input(double t_s) { return {at(t_s), stamp_ns(t_s), is_felt_}; }

void DriveRun::before_tick(double t_s) {
  if (!records_.empty()) session_.hands()->follow(input(t_s));
}

void DriveRun::after_tick(const tools::TickRecord& tick, const StepResult* second) {
  if (records_.empty()) return;
  const double t_s = tick.t_s;
  const auto is_not_zero = [](double x) { return x != 0; };
  is_felt_ = std::ranges::any_of(tick.force_n, is_not_zero) ||
             std::ranges::any_of(tick.torque_nm, is_not_zero) ||
             (second != nullptr && !second->wrench_w.force_w.isZero(0));
  given_j_ = session_.hand()->given_j();
  const double passed_s = has_last_ ? t_s - last_s_ : 0;
  last_s_ = t_s;
  has_last_ = true;
  for (std::size_t k = 0; k < accounts_.size(); ++k) {
    const DrivenState& state = session_.hand()->driven().states()[k];
    DrivenAccount& account = accounts_[k];
    const auto lag_m = static_cast<double>(state.lag_m);
    if (lag_m > account.largest_lag_m) {
      account.largest_lag_m = lag_m;
      account.lag_at_s = t_s;
    }
    account.largest_lag_rad = std::max(account.largest_lag_rad, static_cast<double>(state.lag_rad));
    account.largest_push_n =
        std::max(account.largest_push_n, static_cast<double>(state.pushed_w.force_w.norm()));
    if (state.touches()) account.touched_s += passed_s;
    if (state.is_lost) {
      if (account.lost_s == 0) account.lost_from_s = t_s;
      account.lost_s += passed_s;
      if (state.touches()) account.released_s += passed_s;
    }
    if (account.is_loose) {
      const PartPlace start = session_.parts()->start_of(session_.parts()->driven()[k].part);
      account.moved_m = static_cast<double>((state.felt_wa.p_wa - pose_of(start).p_wa).norm());
    }
    append_number(csv_, t_s);
    csv_ += ',' + account.part;
    append_pose_cells(csv_, state.commanded_wa);
    append_pose_cells(csv_, state.felt_wa);
    for (const Real x : {state.lag_m, state.lag_rad})
      append_number(csv_ += ',', static_cast<double>(x));
    append_cells_of(csv_, state.pushed_w.force_w);
    append_cells_of(csv_, state.pushed_w.torque_w);
    csv_ += state.touches() ? ",1" : ",0";
    csv_ += state.is_lost ? ",1\n" : ",0\n";
  }
}

std::string DriveRun::failures() const {
  std::string text;
  for (const DrivenAccount& account : accounts_) {
    if (account.lost_s == 0) continue;
    text +=
        (text.empty() ? "" : "; ") +
        tools::formatted("the poses of %s were late, too fast or none for %.3g s from %.3f s on",
                         account.part.c_str(), account.lost_s, account.lost_from_s);
    if (account.released_s > 0)
      text += tools::formatted(", and the hand was released for %.3g s", account.released_s);
  }
  return text;
}

}  // namespace haptic::sim
