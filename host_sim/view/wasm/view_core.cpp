// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/wasm/view_core.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "rt_core/scene/laws.hpp"
#include "tools/c_space/c_obstacle.hpp"
#include "tools/live/live_state.hpp"

namespace haptic::sim {

using tools::CFace;
using tools::CObstacle;
using tools::FlatPair;
using tools::make_c_obstacle;
using tools::Vector;
namespace {

template <typename Number>
constexpr const char* type_text() {
  if constexpr (std::is_same_v<Number, double>) return "f64";
  if constexpr (std::is_same_v<Number, std::int64_t>) return "i64";
  if constexpr (std::is_same_v<Number, std::uint64_t>) return "u64";
  if constexpr (std::is_same_v<Number, std::uint32_t>) return "u32";
}

/// The line of a member; `member` lies in `whole`.
template <typename Whole, typename Member>
std::string member_line(const char* structure, const Whole& whole, const char* name,
                        const Member& member) {
  const auto offset =
      reinterpret_cast<const char*>(&member) - reinterpret_cast<const char*>(&whole);
  const std::size_t count = sizeof(Member) / sizeof(std::remove_all_extents_t<Member>);
  return std::string(structure) + ' ' + name + ' ' + std::to_string(offset) + ' ' +
         type_text<std::remove_all_extents_t<Member>>() + ' ' + std::to_string(count) + '\n';
}

/// Lines of a TickRecord that lies `at` bytes from the structure's begin.
std::string tick_lines(const char* structure, std::size_t at) {
  std::string lines;
  for (const tools::TickField& field : tools::kTickFields) {
    if (field.page.empty()) continue;
    lines.append(structure).append(" ").append(field.page).append(" ");
    lines.append(std::to_string(at + field.offset)).append(" ").append(field.type).append(" ");
    lines.append(std::to_string(field.count)).append("\n");
  }
  return lines;
}

}  // namespace

Vec3 vector_in(const double* v) {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

Pose pose_in(const double* p_m, const double* q_xyzw) {
  const double* const q = q_xyzw;
  return {vector_in(p_m), Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]),
                               static_cast<Real>(q[1]), static_cast<Real>(q[2]))};
}

void ViewCore::Free::operator()(std::byte* bytes) const noexcept { std::free(bytes); }

RtStatus ViewCore::open(std::span<const std::byte> blob) {
  core_ = nullptr;
  parts_.reset();
  const RtStatus opened = SceneView::open(blob, view_);
  if (opened != RtStatus::kOk) return opened;
  const RtStatus created = create();
  if (created != RtStatus::kOk) return created;
  list_state();
  newest_ = {};
  stand_second();
  legs_ = tools::GuideLegs(view_);
  judge_ = tools::SessionJudge(view_);
  scene = {};
  show_scene();
  input = {};
  result = {};
  std::copy_n(scene.start_p_wa_m, 3, input.p_wa_m);
  std::copy_n(scene.start_q_wa_xyzw, 4, input.q_wa_xyzw);
  return RtStatus::kOk;
}

/// The core, or those of the parts.
RtStatus ViewCore::create() {
  const RtStatus opened = tools::HeldParts::open(view_, parts_);
  if (opened != RtStatus::kOk) return opened;
  if (parts_ != nullptr) {
    state_ = parts_->state[0].span();
    core_ = &parts_->hand().core();
    shown_ = &parts_->hand().scene();
    return RtStatus::kOk;
  }
  shown_ = &view_;
  const std::size_t bytes =
      (HapticCore::state_bytes(view_) + kStateAlignment - 1) / kStateAlignment * kStateAlignment;
  memory_.reset(static_cast<std::byte*>(std::aligned_alloc(kStateAlignment, bytes)));
  if (memory_ == nullptr) return RtStatus::kMemoryTooSmall;
  std::memset(memory_.get(), 0, bytes);
  state_ = {memory_.get(), bytes};
  return HapticCore::create(state_, view_, core_);
}

/// Facts and room for the scene that is shown.
void ViewCore::show_scene() {
  const SceneParameters& p = shown_->parameters();
  scene.k_t_n_per_m = p.coupling.k_t_n_per_m;
  scene.k_r_nm_per_rad = p.coupling.k_r_nm_per_rad;
  scene.damping_ns_per_m = p.coupling.damping_ns_per_m;
  scene.k_f_n_per_m = p.k_f_n_per_m;
  std::copy_n(view_.parameters().start_p_wa_m, 3, scene.start_p_wa_m);
  std::copy_n(view_.parameters().start_q_wa_xyzw, 4, scene.start_q_wa_xyzw);
  std::copy_n(shown_->bodies()[0].reference_m, 3, scene.grip_a_m);
  scene.rate_hz = p.rate_hz;
  scene.epsilon_m = p.epsilon_m;
  scene.max_force_n = p.coupling.max_pull_n;
  scene.max_torque_nm = p.coupling.max_turn_nm;
  scene.content_hash = view_.header().content_hash;
  scene.state_bytes = state_.size();
  scene.law = static_cast<std::uint32_t>(p.law);
  scene.piece_count = static_cast<std::uint32_t>(shown_->pieces().size());
  scene.pair_count = static_cast<std::uint32_t>(std::min<PairIndex>(shown_->pair_count(), kNone));
  scene.body_count = static_cast<std::uint32_t>(shown_->bodies().size());
  scene.work_units = p.work_units;
  scene.max_work_units = shown_->header().capacity.max_work_units;
  scene.scalar_bytes = sizeof(Real);
  scene.hands = parts_ != nullptr ? parts_->hands.count() : 1;
  if (scene.hands > 1)
    std::copy_n(parts_->hands.hand(1).scene().bodies()[0].reference_m, 3, scene.second_grip_m);

  const std::uint32_t room = shown_->header().capacity.largest_near;
  corners_.resize(room);
  ids_.resize(room);
  contact_.polygon_w = BoundedList<Vec3>(corners_);
  contact_.ids = BoundedList<ContactId>(ids_);
  nearby_.reset();
  others_.clear();
}

void ViewCore::step() {
  StepInput step;
  step.sequence = input.sequence;
  step.stamp_ns = input.stamp_ns;
  step.pose_wa = pose_in(input.p_wa_m, input.q_wa_xyzw);
  step.twist_valid = input.twist_valid != 0;
  if (step.twist_valid) {
    step.twist_w.linear_w = vector_in(input.twist_w);
    step.twist_w.angular_w = vector_in(input.twist_w + 3);
  }
  step.accepted_valid = input.accepted_valid != 0;
  if (step.accepted_valid) {
    step.accepted_wrench_w.force_w = vector_in(input.accepted_w);
    step.accepted_wrench_w.torque_w = vector_in(input.accepted_w + 3);
  }
  step.clutched = input.clutched != 0;
  step.switches = input.switches;
  step.report_goal_contact = input.report_goal_contact != 0;
  const StepResult made = step_hands(step);
  judge_.take(made);
  if (parts_ != nullptr && core_ != &parts_->hand().core()) {
    core_ = &parts_->hand().core();
    shown_ = &parts_->hand().scene();
    show_scene();
  }
  result = tools::record_of(input.sequence, 1e-9 * static_cast<double>(input.stamp_ns), made,
                            shown_->parameters().law, vector_in(scene.grip_a_m));
  result.device_wa = step.pose_wa;
  result.felt_planes = core_->felt_contact().plane_count;
  result.felt_points = core_->felt_contact().point_count;
  felt_wa_ = made.proxy_pose_wa;
}

void ViewCore::reset() {
  result = {};
  if (parts_ == nullptr) return core_->reset();
  newest_ = {};
  // Each part at its start; the memory is the same, so what was saved of the first part fits.
  static_cast<void>(parts_->begin());
  stand_second();
  core_ = &parts_->hand().core();
  shown_ = &parts_->hand().scene();
  show_scene();
}

void ViewCore::describe_scene() {
  answer.clear();
  const auto line = [&](std::string_view text) { answer.text.append(text).append("\n"); };
  const SceneParameters& p = view_.parameters();
  line(view_.text(p.name_offset, p.name_bytes));
  line(law_name(p.law));
  for (const BodyRecord& body : shown_->bodies())
    line(shown_->text(body.name_offset, body.name_bytes));
}

void ViewCore::describe_guide() {
  answer.clear();
  answer.text = legs_.place(result.guide.state, result.guide.station);
}

void ViewCore::describe_verdict() {
  answer.clear();
  const tools::SessionVerdict verdict = judge_.verdict();
  answer.text = tools::verdict_line(verdict).view();
  answer.counts = {verdict.failed() ? 1u : 0u};
}

void ViewCore::describe_pieces() {
  answer.clear();
  constexpr double kNoShift_m[3] = {0, 0, 0};
  for (std::uint32_t k = 0; k < shown_->pieces().size(); ++k) {
    const std::uint32_t body = shown_->pieces()[k].body;
    if (body != 0 && !meets_standing()) continue;
    add_piece(*shown_, k, body, body == 0 ? kNoShift_m : shown_->bodies()[body].reference_m);
  }
}

void ViewCore::add_piece(const SceneView& in, std::uint32_t piece, std::uint32_t shown,
                         const double* shift_m) {
  const PieceView view = in.piece(piece);
  answer.counts.insert(answer.counts.end(), {shown, view.vertex_count, view.face_count});
  for (std::uint32_t f = 0; f < view.face_count; ++f) {
    const auto corners = view.face_vertices(f);
    const std::int32_t source = view.faces[f].source_face;
    answer.counts.push_back(source < 0 ? kNone : static_cast<std::uint32_t>(source));
    answer.counts.push_back(static_cast<std::uint32_t>(corners.size()));
    for (const std::uint16_t v : corners) answer.counts.push_back(v);
  }
  for (std::uint32_t v = 0; v < view.vertex_count; ++v)
    for (int axis = 0; axis < 3; ++axis)
      answer.numbers.push_back(static_cast<double>(view.vertex(v)[axis]) + shift_m[axis]);
}

void ViewCore::describe_contacts() {
  answer.clear();
  answer.counts = {0};
  std::vector<std::uint32_t> pairs = held_pairs();
  if (shown_->parameters().law != LawId::kProxy) pairs = {result.nearest_pair};
  for (const std::uint32_t pair : pairs) {
    core_->contact_geometry(pair, contact_);
    if (contact_.situation == ContactSituation::kNone) continue;
    answer.counts[0] += 1;
    answer.counts.insert(answer.counts.end(),
                         {contact_.body_b, static_cast<std::uint32_t>(contact_.situation),
                          contact_.polygon_w.size(), contact_.ids.size()});
    for (const ContactId& id : contact_.ids.view()) {
      answer.counts.push_back(static_cast<std::uint32_t>(id.type));
      for (const MeshFeature& feature : {id.of_a, id.of_b}) {
        answer.counts.push_back(static_cast<std::uint32_t>(feature.kind));
        for (const std::int32_t source : feature.source)
          answer.counts.push_back(static_cast<std::uint32_t>(source));
      }
    }
    const auto add = [&](const Vec3& v) {
      for (int axis = 0; axis < 3; ++axis) answer.numbers.push_back(static_cast<double>(v[axis]));
    };
    add(contact_.normal_w);
    for (const Vec3& corner : contact_.polygon_w.view()) add(contact_.x0_w + corner);
  }
}

void ViewCore::describe_graph(std::uint32_t most_nodes) {
  answer.clear();
  const std::vector<std::uint32_t> held = held_pairs();
  const std::vector<std::uint32_t> pairs = near_pairs();
  if (pairs.empty()) return;
  const std::uint32_t index = pairs.front();
  if (index >= core_->pair_count()) return;
  const PairView pair = shown_->pair(index);
  FlatPair flat(*shown_, index);
  flat.place(tools::place_moving(*shown_, felt_wa_));

  struct Shown {
    std::uint32_t node;
    GraphRole role;
  };
  std::vector<Shown> shown;
  std::uint32_t left_out = 0;
  // Two thirds of the room are for the neighbours.
  const auto add = [&](std::uint32_t node, GraphRole role) {
    for (Shown& other : shown) {
      if (other.node != node) continue;
      other.role = std::max(other.role, role);
      return true;
    }
    if (shown.size() >= (role == GraphRole::kNeighbor ? most_nodes : most_nodes / 3)) return false;
    shown.push_back({node, role});
    return true;
  };
  if (!held.empty()) {
    const CObstacle obstacle = make_c_obstacle(*shown_, index, felt_wa_);
    const FeltContact& felt = core_->felt_contact();
    for (const CFace& face : obstacle.faces) {
      for (std::uint32_t k = 0; k < felt.plane_count; ++k) {
        const FeltPlane& plane = felt.planes[k];
        if (plane.pair != index ||
            (plane.normal_w.cast<double>() - face.normal).norm() > kSameNormal)
          continue;
        for (const std::uint32_t node : face.nodes)
          left_out += add(node, GraphRole::kHolds) ? 0 : 1;
      }
    }
  }
  const PairReport report = core_->pair_report(index);
  if (result.has_goal_contact != 0 && report.searched) {
    for (const NearNode& near : report.near) left_out += add(near.node, GraphRole::kNear) ? 0 : 1;
  }
  if (shown.empty()) {
    // Nothing of the core's is near: the applicable node whose plane is nearest to the part.
    const auto nodes = tools::applicable_nodes(flat, tools::kApplicable_m);
    const auto largest = std::max_element(nodes.begin(), nodes.end(), [&](auto l, auto r) {
      return flat.evaluate(l).depth_m < flat.evaluate(r).depth_m;
    });
    if (largest != nodes.end()) add(*largest, GraphRole::kNeighbor);
  }
  const std::size_t active = shown.size();
  for (std::size_t k = 0; k < active; ++k) {
    const NodeFeatures of = node_features(pair, shown[k].node);
    for_each_neighbor(pair.a, pair.b, of.type, of.i, of.j, [&](std::uint32_t neighbor) {
      if (!add(neighbor, GraphRole::kNeighbor)) left_out += 1;
    });
  }
  std::vector<std::uint32_t> arcs;
  for (std::uint32_t k = 0; k < active; ++k) {
    const NodeFeatures of = node_features(pair, shown[k].node);
    for_each_neighbor(pair.a, pair.b, of.type, of.i, of.j, [&](std::uint32_t neighbor) {
      for (std::uint32_t other = k + 1; other < shown.size(); ++other) {
        if (shown[other].node == neighbor) arcs.insert(arcs.end(), {k, other});
      }
    });
  }
  const std::uint32_t body = shown_->pieces()[pair.record.piece_b].body;
  answer.counts = {index, body, static_cast<std::uint32_t>(shown.size()),
                   static_cast<std::uint32_t>(arcs.size() / 2), left_out};
  for (const Shown& one : shown) {
    const NodeFeatures of = node_features(pair, one.node);
    const FlatPair::Value value = flat.evaluate(one.node);
    const bool applies = value.violation_m <= tools::kApplicable_m;
    answer.counts.insert(answer.counts.end(),
                         {one.node, static_cast<std::uint32_t>(of.type), of.i, of.j,
                          static_cast<std::uint32_t>(one.role), applies ? 1u : 0u});
    answer.numbers.push_back(value.depth_m);
  }
  answer.counts.insert(answer.counts.end(), arcs.begin(), arcs.end());
}

void ViewCore::describe_marked(std::uint32_t index, std::uint32_t node) {
  answer.clear();
  if (index >= core_->pair_count() || node >= shown_->pair_record(index).node_count) return;
  const PairView pair = shown_->pair(index);
  const NodeFeatures of = node_features(pair, node);
  const auto corners_of = [](const PieceView& piece, ContactType type, bool of_a, std::uint32_t i) {
    std::vector<std::uint32_t> corners;
    if (type == ContactType::kC) {
      corners.assign(std::begin(piece.edges[i].vertex), std::end(piece.edges[i].vertex));
    } else if ((type == ContactType::kA) == of_a) {
      const auto loop = piece.face_vertices(i);
      corners.assign(loop.begin(), loop.end());
    } else {
      corners.push_back(i);
    }
    return corners;
  };
  const auto of_a = corners_of(pair.a, of.type, true, of.i);
  const auto of_b = corners_of(pair.b, of.type, false, of.j);
  const CObstacle obstacle = make_c_obstacle(*shown_, index, felt_wa_);
  const CFace* const face = obstacle.face_of(node);
  answer.counts = {static_cast<std::uint32_t>(of_a.size()), static_cast<std::uint32_t>(of_b.size()),
                   face == nullptr ? 0u : static_cast<std::uint32_t>(face->polygon.size())};
  const tools::PlacedMoving moving = tools::place_moving(*shown_, felt_wa_);
  for (const std::uint32_t v : of_a) {
    const Vector local = pair.a.vertex(v).cast<double>();
    for (std::size_t k = 0; k < 3; ++k)
      answer.numbers.push_back(moving.grip_w[k] + tools::vector_of(moving.r_wa[k]).dot(local));
  }
  const double* reference = shown_->bodies()[pair.b.record->body].reference_m;
  for (const std::uint32_t v : of_b) {
    for (int k = 0; k < 3; ++k)
      answer.numbers.push_back(reference[k] + static_cast<double>(pair.b.vertex(v)[k]));
  }
  if (face == nullptr) return;
  for (const Vector& corner : face->polygon)
    answer.numbers.insert(answer.numbers.end(), {corner[0], corner[1], corner[2]});
}

std::string layout_text() {
  const ViewInput in;
  const ViewDrive drive;
  const ViewScene facts;
  std::string text;
#define HAPTIC_VIEW_IN(member) text += member_line("input", in, #member, in.member)
#define HAPTIC_VIEW_DRIVE(member) text += member_line("drive", drive, #member, drive.record.member)
#define HAPTIC_VIEW_SCENE(member) text += member_line("scene", facts, #member, facts.member)
  HAPTIC_VIEW_IN(p_wa_m);
  HAPTIC_VIEW_IN(q_wa_xyzw);
  HAPTIC_VIEW_IN(twist_w);
  HAPTIC_VIEW_IN(accepted_w);
  HAPTIC_VIEW_IN(stamp_ns);
  HAPTIC_VIEW_IN(sequence);
  HAPTIC_VIEW_IN(twist_valid);
  HAPTIC_VIEW_IN(accepted_valid);
  HAPTIC_VIEW_IN(clutched);
  HAPTIC_VIEW_IN(switches);
  HAPTIC_VIEW_IN(report_goal_contact);
  HAPTIC_VIEW_DRIVE(number);
  HAPTIC_VIEW_DRIVE(stamp_ns);
  HAPTIC_VIEW_DRIVE(p_m);
  HAPTIC_VIEW_DRIVE(q_xyzw);
  HAPTIC_VIEW_DRIVE(fastest_m_per_s);
  HAPTIC_VIEW_DRIVE(fastest_rad_per_s);
  HAPTIC_VIEW_DRIVE(late_ns);
  HAPTIC_VIEW_DRIVE(stands);
  text += member_line("drive", drive, "driven", drive.driven);
  text += tick_lines("result", 0);
  HAPTIC_VIEW_SCENE(k_t_n_per_m);
  HAPTIC_VIEW_SCENE(k_r_nm_per_rad);
  HAPTIC_VIEW_SCENE(damping_ns_per_m);
  HAPTIC_VIEW_SCENE(k_f_n_per_m);
  HAPTIC_VIEW_SCENE(start_p_wa_m);
  HAPTIC_VIEW_SCENE(start_q_wa_xyzw);
  HAPTIC_VIEW_SCENE(grip_a_m);
  HAPTIC_VIEW_SCENE(rate_hz);
  HAPTIC_VIEW_SCENE(epsilon_m);
  HAPTIC_VIEW_SCENE(max_force_n);
  HAPTIC_VIEW_SCENE(max_torque_nm);
  HAPTIC_VIEW_SCENE(content_hash);
  HAPTIC_VIEW_SCENE(state_bytes);
  HAPTIC_VIEW_SCENE(law);
  HAPTIC_VIEW_SCENE(piece_count);
  HAPTIC_VIEW_SCENE(pair_count);
  HAPTIC_VIEW_SCENE(body_count);
  HAPTIC_VIEW_SCENE(work_units);
  HAPTIC_VIEW_SCENE(max_work_units);
  HAPTIC_VIEW_SCENE(scalar_bytes);
  HAPTIC_VIEW_SCENE(hands);
  HAPTIC_VIEW_SCENE(second_grip_m);
  const tools::LiveState live;
  text += tick_lines("live", offsetof(tools::LiveState, record));
  text += member_line("live", live, "hand_stamp", live.hand_stamp);
  text += member_line("live", live, "is_over", live.is_over);
  text += member_line("live", live, "knows_felt", live.knows_felt);
  text += member_line("live", live, "driven_count", live.driven_count);
  // Doubles alone.
  text += "live driven " + std::to_string(offsetof(tools::LiveState, driven)) + " f64 " +
          std::to_string(kMostDriven * tools::kDrivenTickNumbers) + '\n';
#undef HAPTIC_VIEW_IN
#undef HAPTIC_VIEW_DRIVE
#undef HAPTIC_VIEW_SCENE
  return text;
}

}  // namespace haptic::sim
