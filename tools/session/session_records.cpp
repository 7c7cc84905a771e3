// SPDX-License-Identifier: Apache-2.0
#include "tools/session/session_records.hpp"

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

}  // namespace haptic::tools
