// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/pressed_contact.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/session/core_session.hpp"
#include "rt_core/proxy/proxy_law.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint32_t kApproachTicks = 300, kRestTicks = 300;
/// Depth of the press in sizes.
constexpr double kDepthShare = 0.02;

/// Depth left of the contact after A has turned by phi about -y, and its derivative.
struct Depth {
  Wide value, slope;
};

/// Vertex at (lever, -height) from x_0: it rises by lever sin(phi) + height (1 - cos(phi)). Edge of
/// A along x over one of B along y: the normal turns with A, n = (-sin(phi), cos(phi)).
Depth depth_at(const PressedContact& c, const WideVec& x_d, Wide phi) {
  const Wide s = std::sin(phi), k = std::cos(phi), h = widen(c.height_m);
  if (c.kind == PressKind::kVertex) {
    const Wide lever = widen(c.lever_m);
    const Wide half = std::sin(phi / 2);
    return {(h - x_d.z) - (lever * s + 2 * h * half * half), -(lever * k + h * s)};
  }
  const Wide half = std::sin(phi / 2);
  return {(h - x_d.z) + 2 * half * half * x_d.z + s * x_d.x, s * x_d.z + k * x_d.x};
}

/// Normal of B's face, or of the two edges with A turned.
WideVec normal_at(const PressedContact& c, Wide phi) {
  if (c.kind == PressKind::kEdges) return {-std::sin(phi), 0, std::cos(phi)};
  return {std::sin(widen(c.tilt_rad)), 0, std::cos(widen(c.tilt_rad))};
}

/// Normals of B's tilted face: depth of A's flat face along it, A turned with B.
Wide flat_depth(const PressedContact& c, const WideVec& x_d) {
  return widen(c.height_m) - dot(normal_at(c, 0), x_d);
}

/// Triangular prism with its edge along x at z = -height, the ends at +-half.
Solid ridge_below(double half, double height, double top) {
  return {"ridge",
          {{-half, 0, -height},
           {half, 0, -height},
           {-half, -half, top},
           {half, -half, top},
           {-half, half, top},
           {half, half, top}},
          {{0, 1, 3, 2}, {0, 4, 5, 1}, {2, 3, 5, 4}, {0, 2, 4}, {1, 5, 3}}};
}

/// The same with its edge along y at z = 0, the body below.
Solid ridge_above(double half, double depth) {
  return {"roof",
          {{0, -half, 0},
           {0, half, 0},
           {-half, -half, -depth},
           {-half, half, -depth},
           {half, -half, -depth},
           {half, half, -depth}},
          {{0, 1, 3, 2}, {0, 4, 5, 1}, {2, 3, 5, 4}, {0, 2, 4}, {1, 5, 3}}};
}

PressedContact contact_of(PressKind kind, double size_m) {
  PressedContact c;
  c.kind = kind;
  ExtremeScene& scene = c.scene;
  scene.family = "size";
  scene.parameter = scene.size_m = size_m;
  scene.unit = "m";
  c.depth_m = kDepthShare * size_m;
  const double s = size_m;
  scene.b = box_solid("slab", {-2 * s, -2 * s, -s}, {2 * s, 2 * s, 0});
  if (kind == PressKind::kFace) {
    scene.a = centred_box("block", 0.5 * s, 0.4 * s, 0.3 * s);
    c.height_m = 0.3 * s;
  } else if (kind == PressKind::kVertex) {
    c.lever_m = 0.2 * s;
    c.height_m = 0.4 * s;
    scene.a = {"tip",
               {{c.lever_m, 0, -c.height_m},
                {-0.4 * s, -0.4 * s, 0.3 * s},
                {0.5 * s, -0.3 * s, 0.4 * s},
                {0, 0.5 * s, 0.35 * s}},
               {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
    for (auto& loop : scene.a.loops) std::swap(loop[1], loop[2]);
  } else {
    c.lever_m = 0.2 * s;  // x_0 stands that far from B's edge
    c.height_m = 0.4 * s;
    scene.a = ridge_below(s, c.height_m, 0.4 * s);
    scene.b = ridge_above(0.8 * s, 0.7 * s);
  }
  return c;
}

void add_special(std::vector<PressedContact>& list, bool quick) {
  for (const PressKind kind : {PressKind::kFace, PressKind::kVertex}) {
    PressedContact plate = contact_of(kind, 0.1);
    plate.scene.family = "plate_1um";
    plate.scene.parameter = 1e-6;
    plate.scene.b = box_solid("plate", {-0.2, -0.2, -1e-6}, {0.2, 0.2, 0});
    list.push_back(plate);
  }
  PressedContact needle = contact_of(PressKind::kVertex, 0.1);
  needle.scene.family = "needle_1e6";
  needle.scene.parameter = 1e6;
  needle.scene.unit = "length / width";
  const double w = 1e-7, h = 0.05;
  needle.lever_m = 0;
  needle.height_m = h;
  needle.scene.a = {"needle",
                    {{0, 0, -h}, {-w, -w, h}, {w, -w, h}, {0, w, h}},
                    {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}}};
  list.push_back(needle);
  for (int k = -16; k <= -2; k += quick ? 7 : 2) {
    PressedContact tilted = contact_of(PressKind::kFace, 0.1);
    tilted.scene.family = "tilt";
    tilted.scene.parameter = tilted.tilt_rad = std::pow(10.0, k);
    tilted.scene.unit = "rad";
    tilted.scene.turn_w =
        Rotation(std::cos(0.5 * tilted.tilt_rad), 0, std::sin(0.5 * tilted.tilt_rad), 0);
    list.push_back(tilted);
  }
}

/// Whether numbers at B's place lie farther apart than the depth that counts as free.
bool too_coarse(const ExtremeScene& scene) {
  const auto reach = [](const Solid& solid) {
    double reach_m = 0;
    for (const Vector& v : solid.vertices) reach_m = std::max(reach_m, v.norm());
    return static_cast<Real>(reach_m);
  };
  const double apart_m = static_cast<double>(kRealEpsilon) * scene.place_w.cwiseAbs().maxCoeff();
  const ProxyScale scale = proxy_scale(reach(scene.a), reach(scene.b), 0);
  return apart_m > static_cast<double>(scale.tolerance_m);
}

}  // namespace

const char* to_text(PressKind kind) {
  return kind == PressKind::kFace ? "face" : kind == PressKind::kVertex ? "vertex" : "edges";
}

PressWrench proxy_press(const PressedContact& c, const WideVec& x_d, Wide k_t, Wide k_r) {
  if (c.kind == PressKind::kFace) {  // lies flat: the turn is the tilt, at any cost
    return {k_t * flat_depth(c, x_d) * normal_at(c, 0), {0, k_r * widen(c.tilt_rad), 0}};
  }
  // V(phi) = k_t depth^2 / 2 + k_r phi^2 / 2; V' < 0 at -limit and > 0 at limit.
  Wide low = -0.5L, high = 0.5L;
  for (int k = 0; k < 200; ++k) {
    const Wide phi = (low + high) / 2;
    const Depth d = depth_at(c, x_d, phi);
    (k_t * d.value * d.slope + k_r * phi < 0 ? low : high) = phi;
  }
  const Wide phi = (low + high) / 2;
  return {k_t * depth_at(c, x_d, phi).value * normal_at(c, phi), {0, -k_r * phi, 0}};
}

PressWrench paper_press(const PressedContact& c, const WideVec& x_d, Wide k_f) {
  const WideVec n = normal_at(c, 0);
  const bool face = c.kind == PressKind::kFace;
  const Wide depth = face ? flat_depth(c, x_d) : depth_at(c, x_d, 0).value;
  const WideVec force = k_f * depth * n;
  if (face) return {force, {0, 0, 0}};
  // The contact on B, from x_0: eq. (3).
  const Wide along = c.kind == PressKind::kVertex ? widen(c.lever_m) : -x_d.x;
  return {force, cross({along, 0, -widen(c.height_m)}, force)};
}

std::vector<PressedContact> pressed_contacts(bool quick) {
  std::vector<PressedContact> list;
  constexpr PressKind kKinds[] = {PressKind::kFace, PressKind::kVertex, PressKind::kEdges};
  for (const PressKind kind : kKinds) {
    for (int k = -6; k <= 3; k += quick ? 9 : 1)
      list.push_back(contact_of(kind, std::pow(10.0, k)));
    for (int k = 0; k <= 4; k += quick ? 4 : 1) {
      PressedContact far = contact_of(kind, 0.1);
      far.scene.family = "offset";
      far.scene.parameter = std::pow(10.0, k);
      far.scene.place_w = Vector(1, -0.7, 0.6).normalized() * far.scene.parameter;
      list.push_back(far);
    }
  }
  add_special(list, quick);
  return list;
}

PressErrors press(const PressedContact& c, LawId law, double fault) {
  PressErrors errors;
  errors.law = law;
  errors.must_be_refused = law == LawId::kProxy && too_coarse(c.scene);
  std::vector<std::byte> blob;
  try {
    blob = compiled(c.scene, law);
  } catch (const tools::InputError& refusal) {
    errors.refusal = refusal.what();
    return errors;
  }
  CoreSession session(blob, c.scene.family);
  const SceneView& view = session.view();
  const CouplingParameters& coupling = view.parameters().coupling;
  const double radius_m = view.pieces()[view.pair_record(0).piece_a].reach_m;
  const double extent_m = view.pieces()[view.pair_record(0).piece_b].reach_m;
  const ProxyScale scale = proxy_scale(static_cast<Real>(radius_m), static_cast<Real>(extent_m), 0);
  errors.tolerance_m = static_cast<double>(scale.tolerance_m);

  const double x = c.kind == PressKind::kEdges ? c.lever_m : 0;
  const double floor_m = c.height_m - c.depth_m;
  StepResult last;
  Pose pose;
  for (std::uint32_t k = 0; k < kApproachTicks + kRestTicks; ++k) {
    const double share = std::min(1.0, static_cast<double>(k) / kApproachTicks);
    const double z = floor_m + (1 - share) * 6 * c.depth_m;
    StepInput input;
    input.sequence = k;
    input.pose_wa = pose = pose_at(c.scene.place_w + Vector(x, 0, z), Rotation::Identity());
    last = session.core().step(input);
    const bool sound = last.status == RtStatus::kOk && is_finite(last.wrench_w);
    if (!sound) errors.bad_ticks += 1;
    if (law == LawId::kProxy)
      errors.gap_m = std::min(errors.gap_m, static_cast<double>(last.proxy_gap_m));
  }
  const Vector place = c.scene.place_w;
  const WideVec x_d{widen(pose.p_wa[0]) - widen(place[0]), widen(pose.p_wa[1]) - widen(place[1]),
                    widen(pose.p_wa[2]) - widen(place[2])};
  const Wide k_t = widen(coupling.k_t_n_per_m) * (1 + widen(fault));
  const PressWrench truth = law == LawId::kProxy
                                ? proxy_press(c, x_d, k_t, widen(coupling.k_r_nm_per_rad))
                                : paper_press(c, x_d, k_t);
  const auto distance = [](const Vec3& ours, const WideVec& theirs) {
    return static_cast<double>(
        norm(WideVec{widen(ours[0]), widen(ours[1]), widen(ours[2])} - theirs));
  };
  errors.force_n = static_cast<double>(norm(truth.force_n));
  errors.force_error_n = distance(last.wrench_w.force_w, truth.force_n);
  errors.torque_error_nm = distance(last.wrench_w.torque_w, truth.torque_nm);
  // A proxy at rest has converged except for moves that it does not make; D_near has its rounding;
  // far from the origin the coordinates have theirs.
  const double unit_roundoff = static_cast<double>(kRealEpsilon);
  const double coordinates_m = 8 * unit_roundoff * (place.norm() + radius_m + extent_m);
  const double relative = HAPTIC_REAL_IS_FLOAT ? 1e-5 : 1e-12;
  const double depth_m =
      coordinates_m +
      (law == LawId::kProxy ? 2 * static_cast<double>(scale.still_m) : relative * c.scene.size_m);
  errors.force_limit_n = coupling.k_t_n_per_m * depth_m;
  // A turn by depth / r_A makes k_r times that.
  errors.torque_limit_nm = errors.force_limit_n * radius_m + coordinates_m * errors.force_n +
                           coupling.k_r_nm_per_rad * depth_m / radius_m;
  return errors;
}

}  // namespace haptic::sim
