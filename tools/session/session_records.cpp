// SPDX-License-Identifier: Apache-2.0
#include "tools/session/session_records.hpp"

#include <cerrno>

namespace haptic::tools {
namespace {

Real real(double x) noexcept { return static_cast<Real>(x); }

void put(const Vec3& from, double (&to)[3]) noexcept {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<double>(from[k]);
}
void put(const Quat& from, double (&to)[4]) noexcept {
  for (int k = 0; k < 4; ++k) to[k] = static_cast<double>(from.coeffs()[k]);
}
Vec3 vector_of(const double (&v)[3]) noexcept { return {real(v[0]), real(v[1]), real(v[2])}; }
Quat rotation_of(const double (&q)[4]) noexcept {
  return {real(q[3]), real(q[0]), real(q[1]), real(q[2])};
}

}  // namespace

MapRecord record_of(const WorkspaceMap& map) noexcept {
  MapRecord record;
  record.scale = static_cast<double>(map.scale);
  put(map.q_wd, record.q_wd);
  put(map.q_ha, record.q_ha);
  put(map.offset_w, record.offset_w);
  put(map.grip_a, record.grip_a);
  put(map.handle_offset_h, record.handle_offset_h);
  return record;
}

WorkspaceMap map_of(const MapRecord& record) noexcept {
  WorkspaceMap map;
  map.scale = real(record.scale);
  map.q_wd = rotation_of(record.q_wd);
  map.q_ha = rotation_of(record.q_ha);
  map.offset_w = vector_of(record.offset_w);
  map.grip_a = vector_of(record.grip_a);
  map.handle_offset_h = vector_of(record.handle_offset_h);
  return is_usable(map) ? map : WorkspaceMap{};
}

std::string defect_of(const SessionMessage& message, const SessionAsk& ask) {
  const bool is_request =
      message.size >= static_cast<ssize_t>(sizeof ask.magic) && ask.magic == kAskMagic;
  if (message.size == 0) return "the program that asked has gone";
  if (!is_request && message.size != -EMSGSIZE) return "what came is no request of a session";
  if (message.size != static_cast<ssize_t>(sizeof ask) || !(ask.layout == SessionLayout{}))
    return "the program's libhaptic and this run_device are of different versions (session record "
           "version " +
           std::to_string(ask.layout.version) + " against " +
           std::to_string(SessionLayout{}.version) +
           "); install both of one version, or set HAPTIC_RUN_DEVICE to the one that fits";
  if (message.descriptor_count != SessionAsk::kDescriptors)
    return "the request has not the descriptors that belong to it";
  if (!(ask.history_s >= 0 && ask.history_s <= kMostSessionHistory_s) ||
      ask.hands > kSessionDevices)
    return "a number of the request is out of its range";
  return {};
}

}  // namespace haptic::tools
