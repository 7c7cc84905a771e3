// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_of_file.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/proxy/free_motion.hpp"
#include "tools/common/error.hpp"
#include "tools/common/movers.hpp"

namespace haptic::sim {
namespace {

constexpr double kHandTilt_rad = 0.6, kOwnerTilt_rad = 0.3;
/// How far an owner leads a driven part from its start, in radii of it.
constexpr double kOwnerReach = 0.5;
/// The radius at which a turn of a driven part counts like a displacement, in radii of it.
constexpr double kTurnShareOfMover = 0.5;

Vector vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// A scene within the file, copied to where it may be opened.
class OpenScene {
 public:
  OpenScene(std::span<const std::byte> bytes, const std::string& path)
      : bytes_(tools::SceneBytes(bytes)) {
    const RtStatus opened = SceneView::open(std::as_const(bytes_).span(), view_);
    if (opened != RtStatus::kOk)
      throw tools::InputError(path + ": a scene of its parts is refused: " + to_text(opened) +
                              "; compile it again");
  }
  OpenScene(const OpenScene&) = delete;
  OpenScene& operator=(const OpenScene&) = delete;
  [[nodiscard]] const SceneView& view() const { return view_; }

 private:
  tools::SceneBytes bytes_;
  SceneView view_;
};

/// The shape of a body of a scene, moved by `by`.
void add_shape(const SceneView& view, std::uint32_t body, const Vector& by, FuzzBody& shape) {
  const BodyRecord& record = view.bodies()[body];
  for (std::uint32_t k = 0; k < record.piece_count; ++k) {
    const PieceView piece = view.piece(record.piece_begin + k);
    std::vector<Vector> vertices;
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v)
      vertices.push_back(piece.vertex(v).cast<double>() + by);
    if (!piece.is_facet()) {
      Solid solid;
      solid.vertices = std::move(vertices);
      for (std::uint32_t f = 0; f < piece.face_count; ++f) {
        const std::span<const std::uint16_t> loop = piece.face_vertices(f);
        solid.loops.emplace_back(loop.begin(), loop.end());
      }
      shape.pieces.push_back(std::move(solid));
      continue;
    }
    const auto first = static_cast<std::uint32_t>(shape.surface.vertices.size());
    shape.surface.vertices.insert(shape.surface.vertices.end(), vertices.begin(), vertices.end());
    const std::span<const std::uint16_t> loop = piece.face_vertices(0);
    for (std::size_t j = 2; j < loop.size(); ++j)
      shape.surface.triangles.push_back({first + loop[0], first + loop[j - 1], first + loop[j]});
  }
}

/// A body with a facet is judged by triangles alone.
void make_one_kind(FuzzBody& shape) {
  if (shape.surface.triangles.empty()) return;
  for (const Solid& piece : shape.pieces) {
    const auto first = static_cast<std::uint32_t>(shape.surface.vertices.size());
    shape.surface.vertices.insert(shape.surface.vertices.end(), piece.vertices.begin(),
                                  piece.vertices.end());
    for (const auto& loop : piece.loops) {
      for (std::size_t j = 2; j < loop.size(); ++j)
        shape.surface.triangles.push_back({first + loop[0], first + loop[j - 1], first + loop[j]});
    }
  }
  shape.pieces.clear();
}

Spring mover_spring(const Spring& hand, const DrivenRecord& record) {
  Spring spring;
  spring.k_t_n_per_m = static_cast<Real>(record.ratio) * hand.k_t_n_per_m;
  spring.length_m = static_cast<Real>(kTurnShareOfMover * record.radius_m);
  spring.k_r_nm_per_rad = spring.k_t_n_per_m * spring.length_m * spring.length_m;
  if (record.lead != Lead::kOwner) return spring;
  spring.soft_translation_m = static_cast<Real>(record.push_n) / spring.k_t_n_per_m;
  spring.soft_rotation_rad = spring.soft_translation_m / spring.length_m;
  return spring;
}

class FileBodies {
 public:
  FileBodies(const std::string& path, const CoreSession& session)
      : path_(path), parts_(*session.parts()) {
    BodiesScene& scene = compiled_.scene;
    const SceneParameters& p = session.view().parameters();
    scene.of_case = "scene";
    scene.name = path;
    scene.keeps_starts = true;
    scene.passes = p.coupling.passes;
    scene.work_units = p.work_units;
    for (std::uint32_t hand = 0; hand < parts_.hands(); ++hand) add_hand(hand);
    for (std::uint32_t mover = 0; mover < parts_.driven().size(); ++mover)
      if (meets_any(mover)) add_mover(mover);
    add_pairs();
    add_ranges();
  }

  [[nodiscard]] CompiledBodies take() { return std::move(compiled_); }

 private:
  [[nodiscard]] std::span<const std::byte> pair(std::uint32_t a, std::uint32_t b) const {
    return parts_.pair_scene(a, b);
  }

  [[nodiscard]] bool meets_any(std::uint32_t mover) const {
    const std::uint32_t own = parts_.driven()[mover].part;
    if (parts_[own].role == PartRole::kLoose && parts_.meets_standing(own)) return true;
    for (std::uint32_t part = 0; part < parts_.count(); ++part) {
      const bool moves = part < parts_.hands() || parts_[part].role == PartRole::kDriven ||
                         parts_[part].role == PartRole::kLoose;
      if (moves && !(pair(own, part).empty() && pair(part, own).empty())) return true;
    }
    return false;
  }

  /// The body of a part, about the point `grip_m` of its mesh frame.
  FuzzBody& add(std::uint32_t part, BodyRole role, const Vector& grip_m, const SceneView& shape,
                std::uint32_t body) {
    FuzzBody added;
    added.name = std::string(parts_.name(part));
    added.role = role;
    add_shape(shape, body, vector_of(shape.bodies()[body].reference_m) - grip_m, added);
    make_one_kind(added);
    const PartPlace start = parts_.start_of(part);
    const Rotation turn(start.q_wa_xyzw[3], start.q_wa_xyzw[0], start.q_wa_xyzw[1],
                        start.q_wa_xyzw[2]);
    added.start_turn = turn.normalized();
    added.start = vector_of(start.p_wa_m) + added.start_turn * grip_m;
    numbers_.push_back(part);
    compiled_.scene.bodies.push_back(std::move(added));
    return compiled_.scene.bodies.back();
  }

  void add_hand(std::uint32_t hand) {
    const OpenScene held(parts_.scene_of(hand), path_);
    const BodyRecord& record = held.view().bodies()[0];
    MovingBody is;
    is.spring = coupling_spring(held.view().parameters().coupling);
    is.grip_m = vector_of(record.reference_m).cast<Real>();
    is.radius_m = scene_size(held.view()).radius_m;
    if (hand == 0) {
      first_ = is.spring;
      compiled_.scene.scale = proxy_scale(held.view());
    }
    add(hand, BodyRole::kHand, vector_of(record.reference_m), held.view(), 0).is = is;
  }

  void add_mover(std::uint32_t mover) {
    const DrivenRecord& record = parts_.driven()[mover];
    SceneView shape;
    std::uint32_t body = 0;
    if (!tools::open_mover_shape(parts_, mover, shape, body)) return;
    MovingBody is;
    is.spring = mover_spring(first_, record);
    is.grip_m = vector_of(record.middle_m).cast<Real>();
    is.radius_m = static_cast<Real>(record.radius_m);
    is.is_held_back = false;
    const bool drives = record.lead == Lead::kOwner;
    FuzzBody& added = add(record.part, drives ? BodyRole::kDriver : BodyRole::kLoose,
                          vector_of(record.middle_m), shape, body);
    added.is = is;
    added.yield_n = record.push_n;
    if (record.lead == Lead::kWeight) added.sink_m = record.fastest_m_per_s * record.late_s;
    if (!drives) return;
    added.fastest_m_per_s = record.fastest_m_per_s;
    added.fastest_rad_per_s = record.fastest_rad_per_s;
  }

  void add_pair(std::size_t a, std::size_t b, std::span<const std::byte> bytes) {
    if (bytes.empty()) return;
    CompiledBodyPair pair{a, b, {bytes.begin(), bytes.end()}, std::nullopt};
    const OpenScene opened(bytes, path_);
    const ProxyScale scale = proxy_scale(opened.view());
    if (scale.tolerance_m > compiled_.scene.scale->tolerance_m) compiled_.scene.scale = scale;
    if (b == kFuzzStanding) {
      pair.standing.emplace();
      for (std::uint32_t k = 1; k < opened.view().bodies().size(); ++k)
        add_shape(opened.view(), k, vector_of(opened.view().bodies()[k].reference_m),
                  *pair.standing);
      std::vector<Solid>& all = compiled_.scene.standing;
      all.insert(all.end(), pair.standing->pieces.begin(), pair.standing->pieces.end());
      make_one_kind(*pair.standing);
    }
    compiled_.pairs.push_back(std::move(pair));
  }

  /// In the order of the law of the scene (rt_core/bodies/joint_motion.cpp).
  void add_pairs() {
    const std::size_t hands = parts_.hands(), count = numbers_.size();
    for (std::size_t hand = 0; hand < hands; ++hand) {
      if (parts_.meets_standing(numbers_[hand]))
        add_pair(hand, kFuzzStanding, parts_.scene_of(numbers_[hand]));
    }
    for (std::size_t a = 0; a < hands && hands > 1; ++a)
      add_pair(a, 1 - a, pair(numbers_[a], numbers_[1 - a]));
    for (std::size_t mover = hands; mover < count; ++mover) {
      for (std::size_t hand = 0; hand < hands; ++hand)
        add_pair(hand, mover, pair(numbers_[hand], numbers_[mover]));
    }
    for (std::size_t mover = hands; mover < count; ++mover) {
      if (compiled_.scene.bodies[mover].role != BodyRole::kLoose) continue;
      if (parts_.meets_standing(numbers_[mover]))
        add_pair(mover, kFuzzStanding, parts_.scene_of(numbers_[mover]));
      for (std::size_t other = 0; other < count; ++other)
        if (other != mover) add_pair(mover, other, pair(numbers_[mover], numbers_[other]));
    }
  }

  void add_ranges() {
    std::vector<FuzzBody>& bodies = compiled_.scene.bodies;
    Vector low = bodies[0].start, high = low;
    for (const FuzzBody& body : bodies) {
      const Vector radius = Vector::Constant(body.radius_m());
      low = low.cwiseMin(body.start - radius);
      high = high.cwiseMax(body.start + radius);
    }
    for (FuzzBody& body : bodies) {
      body.range.turn = body.start_turn;
      if (body.role == BodyRole::kHand) {
        body.range.home = (low + high) / 2;
        body.range.reach_m = (high - low) / 2;
        body.range.tilt_rad = kHandTilt_rad;
      } else {
        body.range.home = body.start;
        body.range.reach_m = Vector::Constant(kOwnerReach * body.radius_m());
        body.range.tilt_rad = kOwnerTilt_rad;
      }
    }
  }

  const std::string& path_;
  const PartScenes& parts_;
  CompiledBodies compiled_;
  std::vector<std::uint32_t> numbers_;  ///< of the parts, by body
  Spring first_;                        ///< of the first hand
};

}  // namespace

CompiledBodies bodies_of_file(const std::string& path) {
  const CoreSession session(path, GoalContact::kLeftOut);
  if (session.parts() == nullptr ||
      (session.parts()->hands() < 2 && session.parts()->driven().empty())) {
    throw tools::InputError(path +
                            ": one part moves at a time; judge it by 'host_sim replay SCENE MOTION "
                            "--check', or give a scene with parts of role hand2, driven or loose");
  }
  return FileBodies(path, session).take();
}

double friction_of(const CompiledBodies& compiled) {
  double largest = 0;
  for (const CompiledBodyPair& pair : compiled.pairs) {
    const OpenScene opened(pair.blob, compiled.scene.name);
    for (const BodyRecord& body : opened.view().bodies())
      largest = std::max(largest, body.friction);
  }
  return largest;
}

}  // namespace haptic::sim
