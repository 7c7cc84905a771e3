// SPDX-License-Identifier: Apache-2.0
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision.h>

#include <deque>
#include <exception>
#include <limits>
#include <utility>

#include "host_sim/lab/peers/foreign_peers.hpp"

namespace haptic::sim {
namespace {

std::shared_ptr<fcl::Convexd> convex_of(const PeerSolid& solid) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (const PeerVector& v : solid.vertices) vertices->emplace_back(v[0], v[1], v[2]);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& loop : solid.loops) {
    faces->push_back(static_cast<int>(loop.size()));
    for (const std::uint32_t v : loop) faces->push_back(static_cast<int>(v));
  }
  auto convex =
      std::make_shared<fcl::Convexd>(vertices, static_cast<int>(solid.loops.size()), faces, true);
  convex->computeLocalAABB();
  return convex;
}

class FclPeer final : public PeerQuery {
 public:
  FclPeer(const PeerSolid& a, const PeerSolid& b, double tolerance_m)
      : a_(convex_of(a)), b_(convex_of(b)) {
    pose_a_.setIdentity();
    pose_b_.setIdentity();
    request_.num_max_contacts = 1;
    request_.enable_contact = true;
    request_.gjk_solver_type = fcl::GST_LIBCCD;
    request_.gjk_tolerance = tolerance_m;
  }

  void prepare(const PeerPose& pose) override {
    for (int i = 0; i < 3; ++i) {
      const auto row = static_cast<std::size_t>(i);
      for (int j = 0; j < 3; ++j)
        pose_a_.linear()(i, j) = pose.r_wa[row][static_cast<std::size_t>(j)];
      pose_a_.translation()[i] = pose.p_wa[row];
    }
  }
  void query() override {
    result_.clear();
    fcl::collide<double>(b_.get(), pose_b_, a_.get(), pose_a_, request_, result_);
  }
  // B first: FCL's normal points from its first object to the second.
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.penetrating = result_.isCollision();
    answer.depth_m = std::numeric_limits<double>::quiet_NaN();
    if (result_.numContacts() > 0) {
      const fcl::Contactd& contact = result_.getContact(0);
      answer.depth_m = -contact.penetration_depth;
      for (int i = 0; i < 3; ++i) answer.normal_w[static_cast<std::size_t>(i)] = contact.normal[i];
      answer.patch_points = 1;
    }
    return answer;
  }

 private:
  std::shared_ptr<fcl::Convexd> a_, b_;
  fcl::Transform3d pose_a_, pose_b_;
  fcl::CollisionRequestd request_;
  fcl::CollisionResultd result_;
};

class FclPenalty final : public PenaltyPeer {
 public:
  FclPenalty(const PenaltyBodies& bodies, double stiffness_n_per_m)
      : stiffness_n_per_m_(stiffness_n_per_m) {
    for (const PeerSolid& solid : bodies.moving) moving_.emplace_back(convex_of(solid));
    for (const PeerSolid& solid : bodies.fixed) fixed_.emplace_back(convex_of(solid));
    add(moving_, moving_tree_, &moving_mark_);
    add(fixed_, fixed_tree_, nullptr);
    pose_.setIdentity();
    request_.enable_contact = true;
  }

  void prepare(const PeerPose& pose) override {
    for (int i = 0; i < 3; ++i) {
      const auto row = static_cast<std::size_t>(i);
      for (int j = 0; j < 3; ++j)
        pose_.linear()(i, j) = pose.r_wa[row][static_cast<std::size_t>(j)];
      pose_.translation()[i] = pose.p_wa[row];
    }
    grip_w_ = pose.p_wa;
  }
  PenaltyWrench render() override {
    wrench_ = {};
    for (fcl::CollisionObjectd& object : moving_) {
      object.setTransform(pose_);
      object.computeAABB();
    }
    moving_tree_.update();
    fixed_tree_.collide(&moving_tree_, this, [](auto* a, auto* b, void* self) {
      static_cast<FclPenalty*>(self)->meet(a, b);
      return false;  // go on
    });
    return wrench_;
  }

 private:
  using Tree = fcl::DynamicAABBTreeCollisionManagerd;
  static void add(std::deque<fcl::CollisionObjectd>& objects, Tree& tree, void* mark) {
    for (fcl::CollisionObjectd& object : objects) {
      object.computeAABB();
      object.setUserData(mark);
      tree.registerObject(&object);
    }
    tree.setup();
  }
  // FCL's normal points from its first object to the second.
  void meet(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b) {
    if (a->getUserData() != nullptr) std::swap(a, b);
    result_.clear();
    try {
      fcl::collide<double>(a, b, request_, result_);
    } catch (const std::exception&) {
      ++wrench_.failures;
      return;
    }
    if (result_.numContacts() == 0) return;
    const fcl::Contactd& c = result_.getContact(0);
    ++wrench_.pairs;
    wrench_.push(stiffness_n_per_m_, c.penetration_depth, {c.normal[0], c.normal[1], c.normal[2]},
                 {c.pos[0], c.pos[1], c.pos[2]}, grip_w_);
  }

  double stiffness_n_per_m_;
  std::deque<fcl::CollisionObjectd> moving_, fixed_;  // the trees point to them
  Tree moving_tree_, fixed_tree_;
  char moving_mark_ = 0;
  fcl::Transform3d pose_;
  PeerVector grip_w_{};
  fcl::CollisionRequestd request_;
  fcl::CollisionResultd result_;
  PenaltyWrench wrench_;
};

}  // namespace

std::unique_ptr<PeerQuery> make_fcl_peer(const PeerSolid& a, const PeerSolid& b,
                                         double tolerance_m) {
  return std::make_unique<FclPeer>(a, b, tolerance_m);
}

std::unique_ptr<PenaltyPeer> make_fcl_penalty(const PenaltyBodies& bodies,
                                              double stiffness_n_per_m) {
  return std::make_unique<FclPenalty>(bodies, stiffness_n_per_m);
}

}  // namespace haptic::sim
