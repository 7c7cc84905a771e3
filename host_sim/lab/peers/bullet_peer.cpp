// SPDX-License-Identifier: Apache-2.0
#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <deque>
#include <vector>

#include "host_sim/lab/peers/foreign_peers.hpp"

#if !defined(BT_USE_DOUBLE_PRECISION)
#error "the Bullet peer is measured in double: build with the flags of bullet-float64"
#endif

namespace haptic::sim {
namespace {

btMatrix3x3 basis_of(const PeerPose& pose) {
  const auto& r = pose.r_wa;
  return {r[0][0], r[0][1], r[0][2], r[1][0], r[1][1], r[1][2], r[2][0], r[2][1], r[2][2]};
}

PeerVector as_peer(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

void fill(btConvexHullShape& shape, const PeerSolid& solid) {
  for (const PeerVector& v : solid.vertices) shape.addPoint(btVector3(v[0], v[1], v[2]), false);
  shape.recalcLocalAabb();
  shape.setMargin(0);
}

class BulletPeer final : public PeerQuery {
 public:
  BulletPeer(const PeerSolid& a, const PeerSolid& b) : detector_(&a_, &b_, &simplex_, &epa_) {
    fill(a_, a);
    fill(b_, b);
    // The detector copies the margins when it is made.
    detector_ = btGjkPairDetector(&a_, &b_, &simplex_, &epa_);
    first_axis_ = detector_.getCachedSeparatingAxis();
    input_.m_transformB.setIdentity();
  }

  void prepare(const PeerPose& pose) override {
    input_.m_transformA.setBasis(basis_of(pose));
    input_.m_transformA.setOrigin(btVector3(pose.p_wa[0], pose.p_wa[1], pose.p_wa[2]));
  }
  void query() override {
    point_ = btPointCollector();
    detector_.getClosestPoints(input_, point_, nullptr);
  }
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.separated = SeparatedValue::kDistance;
    answer.depth_m = point_.m_distance;
    answer.penetrating = point_.m_hasResult && point_.m_distance <= 0;
    if (point_.m_hasResult) {
      const btVector3& n = point_.m_normalOnBInWorld;
      answer.normal_w = {n.x(), n.y(), n.z()};
      answer.patch_points = 1;
    }
    return answer;
  }
  void reset() override { detector_.setCachedSeparatingAxis(first_axis_); }
  [[nodiscard]] bool coherent() const override { return true; }

 private:
  btConvexHullShape a_, b_;
  btVoronoiSimplexSolver simplex_;
  btGjkEpaPenetrationDepthSolver epa_;
  btGjkPairDetector detector_;
  btVector3 first_axis_;
  btGjkPairDetector::ClosestPointInput input_;
  btPointCollector point_;
};

class BulletPenalty final : public PenaltyPeer {
 public:
  BulletPenalty(const PenaltyBodies& bodies, double stiffness_n_per_m)
      : stiffness_n_per_m_(stiffness_n_per_m) {
    for (const PeerSolid& solid : bodies.moving) fill(moving_.emplace_back(), solid);
    for (const PeerSolid& solid : bodies.fixed) fill(fixed_.emplace_back(), solid);
    input_.m_transformB.setIdentity();
    numbers_.resize(fixed_.size());
    for (std::size_t j = 0; j < fixed_.size(); ++j) {
      numbers_[j] = j;
      btVector3 low, high;
      fixed_[j].getAabb(input_.m_transformB, low, high);
      tree_.insert(btDbvtVolume::FromMM(low, high), &numbers_[j]);
    }
    tree_.optimizeTopDown();
    for (btConvexHullShape& a : moving_) {
      for (btConvexHullShape& b : fixed_) detectors_.emplace_back(&a, &b, &simplex_, &epa_);
    }
  }

  void prepare(const PeerPose& pose) override {
    input_.m_transformA.setBasis(basis_of(pose));
    input_.m_transformA.setOrigin(btVector3(pose.p_wa[0], pose.p_wa[1], pose.p_wa[2]));
  }
  PenaltyWrench render() override {
    Meetings meetings(*this);
    for (; meetings.piece < moving_.size(); ++meetings.piece) {
      btVector3 low, high;
      moving_[meetings.piece].getAabb(input_.m_transformA, low, high);
      tree_.collideTV(tree_.m_root, btDbvtVolume::FromMM(low, high), meetings);
    }
    return meetings.wrench;
  }

 private:
  /// What the tree calls for each fixed piece whose box meets that of the moving one.
  struct Meetings : btDbvt::ICollide {
    explicit Meetings(BulletPenalty& of) : owner(of) {}
    void Process(const btDbvtNode* leaf) override {
      owner.meet(piece, *static_cast<const std::size_t*>(leaf->data), wrench);
    }
    BulletPenalty& owner;
    PenaltyWrench wrench;
    std::size_t piece = 0;  ///< of the moving body
  };

  void meet(std::size_t a, std::size_t b, PenaltyWrench& wrench) {
    btPointCollector point;
    detectors_[a * fixed_.size() + b].getClosestPoints(input_, point, nullptr);
    if (!point.m_hasResult || point.m_distance >= 0) return;
    const btVector3& n = point.m_normalOnBInWorld;
    ++wrench.pairs;
    wrench.push(stiffness_n_per_m_, -point.m_distance, as_peer(n),
                as_peer(point.m_pointInWorld + (0.5 * point.m_distance) * n),
                as_peer(input_.m_transformA.getOrigin()));
  }

  double stiffness_n_per_m_;
  std::deque<btConvexHullShape> moving_, fixed_;  // the detectors point into them
  std::vector<std::size_t> numbers_;
  btDbvt tree_;
  btVoronoiSimplexSolver simplex_;
  btGjkEpaPenetrationDepthSolver epa_;
  std::deque<btGjkPairDetector> detectors_;
  btGjkPairDetector::ClosestPointInput input_;
};

}  // namespace

std::unique_ptr<PeerQuery> make_bullet_peer(const PeerSolid& a, const PeerSolid& b) {
  return std::make_unique<BulletPeer>(a, b);
}

std::unique_ptr<PenaltyPeer> make_bullet_penalty(const PenaltyBodies& bodies,
                                                 double stiffness_n_per_m) {
  return std::make_unique<BulletPenalty>(bodies, stiffness_n_per_m);
}

}  // namespace haptic::sim
