// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Contacts of a run as CSV: of every pair that touches in a tick its situation, contact plane and
/// frame, polygon H and basic contacts by the numbers of the user's meshes.

#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/haptic_core.hpp"

namespace haptic::sim {

/// Header, without the end of line. Points in W [m]: `p` = pi(x_0^A) of the plane, `n` and `e1` of
/// the frame; `polygon_m` the corners "x y z" with ; between; `contacts` as contact_text has them,
/// with ; between.
inline constexpr const char* kContactCsvHeader =
    "tick,t_s,pair,static_body,situation,d_near_m,px_m,py_m,pz_m,nx,ny,nz,e1x,e1y,e1z,polygon_m,"
    "contacts";

/// Type, feature of A, feature of B; vertices and faces by their numbers in the mesh files, from 0,
/// edges by their two vertices: A:f3/v5, B:v0/f1, C:e0-3/e4-5. `*` for what a cut of the
/// decomposition made.
[[nodiscard]] std::string contact_text(const ContactId& id);

class ContactLog {
 public:
  /// Room for the contacts of any pair of `scene`.
  explicit ContactLog(const SceneView& scene);
  ContactLog(const ContactLog&) = delete;
  ContactLog& operator=(const ContactLog&) = delete;

  /// Takes over what `core` found in its last tick, which was given `input`. Cost: that of
  /// HapticCore::contact_geometry for each pair.
  void add(HapticCore& core, const StepInput& input, double t_s);
  /// The whole file so far, 17 significant digits, LF.
  [[nodiscard]] const std::string& csv() const { return csv_; }

 private:
  void append(const StepInput& input, double t_s, PairIndex pair);

  std::vector<Vec3> corners_;
  std::vector<ContactId> ids_;
  ContactGeometry contact_;
  std::string csv_;
  bool of_felt_ = false;  ///< law kProxy: the pairs that the part touches, not all
};

}  // namespace haptic::sim
