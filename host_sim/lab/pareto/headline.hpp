// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The headline: one motion of the hand, rendered by the default law, by the other laws, and by
/// penalty on the collision libraries that were found. Time of each tick and error of its wrench
/// against the default law in steps so fine and passes so many that it has settled.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/pareto/headline_scenes.hpp"
#include "host_sim/lab/pareto/pareto_measure.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Name under which it is asked for.
inline constexpr const char* kHeadlineName = "headline";
/// Of the reference; its sub-steps are kHeadlineSubsteps.
inline constexpr std::uint32_t kReferencePasses = 20;

/// On the hand, W axes, torque about the grip point.
struct HandWrench {
  Vector force_n = Vector::Zero(), torque_nm = Vector::Zero();
  bool flawed = false;  ///< the method says that it left a pair out
};

/// A method that renders the pose of the hand, tick by tick.
class TickRenderer {
 public:
  TickRenderer() = default;
  TickRenderer(const TickRenderer&) = delete;
  TickRenderer& operator=(const TickRenderer&) = delete;
  virtual ~TickRenderer() = default;

  /// Back to the state before the first tick.
  virtual void reset() {}
  /// Takes the pose of the part's frame over into the method's own types. Not timed.
  virtual void prepare(const MotionSample& goal, std::uint64_t tick) = 0;
  /// The whole tick, timed; its result is kept in the method's own types.
  virtual void render() = 0;
  [[nodiscard]] virtual HandWrench wrench() const = 0;
};

/// Pose of the part's frame.
struct ShownPart {
  Vector p = Vector::Zero();
  Rotation q = Rotation::Identity();
};
/// A method that holds a part of its own where it can be.
class PlacedRenderer : public TickRenderer {
 public:
  /// In the tick rendered last.
  [[nodiscard]] virtual ShownPart part() const = 0;
};

/// The compiled scene under a law of the core. `passes` 0: the default; `all_pairs`: no budget of
/// visits.
[[nodiscard]] std::vector<std::byte> law_scene(const HeadlineScene& scene, LawId law,
                                               std::uint32_t passes, bool all_pairs);
/// The law of a compiled scene; the part is that of law proxy, under other laws the hand's pose.
[[nodiscard]] std::unique_ptr<PlacedRenderer> law_renderer(std::span<const std::byte> scene,
                                                           const std::string& name);
[[nodiscard]] std::unique_ptr<PlacedRenderer> law_renderer(const HeadlineScene& scene, LawId law,
                                                           std::uint32_t passes = 0,
                                                           bool all_pairs = false);
/// Which contacts of a penalty push.
enum class PenaltySum : bool { kAll, kDeepest };
/// Penalty rendering at the pose of the hand.
[[nodiscard]] std::unique_ptr<TickRenderer> penalty_renderer(const HeadlineScene& scene,
                                                             std::unique_ptr<PenaltyPeer> peer,
                                                             PenaltySum sum = PenaltySum::kAll);

/// The settled law over the motion: kReferencePasses passes, every sample of the goal, all pairs.
struct HeadlineReference {
  std::vector<HandWrench> wrenches;     ///< by tick
  std::vector<std::size_t> in_contact;  ///< ticks with a wrench; the others are free and not judged
  double largest_force_n = 0, largest_torque_nm = 0;
  double force_step_n = 0, torque_step_nm = 0;  ///< largest change of the wrench in one tick
};
[[nodiscard]] HeadlineReference headline_reference(const HeadlineScene& scene);
/// The wrenches that `settled` renders at kHeadlineSubsteps goals a tick.
[[nodiscard]] HeadlineReference settled_reference(std::span<const MotionSample> goals,
                                                  TickRenderer& settled);

struct Spread {
  double median = 0, p99 = 0, largest = 0;
};

/// One method on one scene, over the ticks in contact.
struct HeadlineMethod {
  std::string name;   ///< for files: letters, digits, underscores
  std::string title;  ///< for people
  bool drawn = true;
  std::vector<double> ns, force_error_n, torque_error_nm;  ///< by place in `in_contact`
  Spread time_ns, force_n, torque_nm;                      ///< of these
  double force_step_n = 0, torque_step_nm = 0;  ///< largest change of the wrench in one tick
  std::uint64_t flawed_ticks = 0;
};

/// Runs the method over the motion, kHeadlineSubsteps goals a tick, `repeats` times; the least time
/// of a tick counts. Errors and steps: of the last run, each of whose ticks is `seen` when
/// rendered.
[[nodiscard]] HeadlineMethod measure_renderer(std::span<const MotionSample> goals,
                                              const HeadlineReference& reference,
                                              TickRenderer& renderer, std::uint32_t repeats,
                                              const TickClock& clock,
                                              const std::function<void(std::size_t)>& seen = {});

struct HeadlineMeasure {
  std::string name, title;
  std::size_t moving_pieces = 0, fixed_pieces = 0, pairs = 0, ticks = 0;
  HeadlineReference reference;
  std::vector<HeadlineMethod> methods;  ///< the default first

  /// Null when there is none of the name.
  [[nodiscard]] const HeadlineMethod* method(const std::string& wanted) const;
};

inline constexpr const char* kDefaultMethod = "proxy";

/// Every scene, and on each law proxy with 3 (default), 1, 2 and 5 passes, law `paper`, and
/// penalty on each library; on the first also with its deepest contact
/// alone. `progress`: lines on stderr.
[[nodiscard]] std::vector<HeadlineMeasure> measure_headline(const MeasurePlan& plan,
                                                            const TickClock& clock, bool quick,
                                                            bool progress);

}  // namespace haptic::sim
