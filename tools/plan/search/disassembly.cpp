// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/disassembly.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/plan/assembly_stages.hpp"
#include "tools/plan/search/inside_surface.hpp"

namespace haptic::tools {
namespace {

/// Ticks of the core that a search has in the first round, and how the rounds grow.
constexpr std::uint64_t kFirstTicks = 20'000, kTicksGrow = 3;
/// Ticks of the search for the end of a way, to a place that was given.
constexpr std::uint64_t kReachTicks = 60'000;
/// Room between parts that lie beside the assembly, in radii of the largest.
constexpr double kApart = 2.2;
/// Parts that overlap by about a depth are free with this many of it as the scene's tolerance.
constexpr double kCountedDepths = 1.25;

PartPlace place_of_mesh(const Pose& pose) {
  PartPlace place;
  for (int k = 0; k < 3; ++k) place.p_wa_m[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) place.q_wa_xyzw[k] = static_cast<double>(pose.q_wa.coeffs()[k]);
  return place;
}

/// The places beside the assembly where parts may be laid: on a ring about it.
struct Ring {
  Vec3d centre = Vec3d::Zero();
  double radius_m = 0;
  std::vector<bool> taken;

  [[nodiscard]] Vec3d place(std::size_t slot) const {
    const double angle =
        2 * std::numbers::pi * static_cast<double>(slot) / static_cast<double>(taken.size());
    return centre + radius_m * Vec3d(std::cos(angle), std::sin(angle), 0);
  }
};

/// A part and the scene in which it is taken out of what is left.
struct Candidate {
  Candidate(SceneBytes bytes) : scene(std::move(bytes)) {
    if (SceneView::open(scene.span(), view) != RtStatus::kOk)
      throw InputError("the scene of a part does not open; compile the scene again");
  }
  Candidate(const Candidate&) = delete;
  Candidate& operator=(const Candidate&) = delete;

  SceneBytes scene;
  SceneView view;
  std::optional<WayOut> way;
  PlanPose at;
  StuckPart stuck;
};

class TakingApart {
 public:
  TakingApart(const PartScenes& parts, std::vector<PartPlace> places,
              const std::vector<AssembledPart>& movable, const DisassemblyLimits& limits,
              const std::function<void(const std::string&)>& say)
      : parts_(parts), places_(std::move(places)), left_(movable), limits_(limits), say_(say) {
    began_s_ = limits_.clock_s();
    candidates_.resize(parts_.count());
  }

  Disassembly run() {
    measure();
    settle();
    while (!left_.empty() && take_one()) {
    }
    for (const AssembledPart& part : left_) result_.stuck.push_back(stuck(part));
    result_.seconds = seconds();
    return std::move(result_);
  }

 private:
  [[nodiscard]] double seconds() const { return limits_.clock_s() - began_s_; }
  [[nodiscard]] std::string name(std::uint32_t part) const {
    return "'" + std::string(parts_.name(part)) + "'";
  }
  [[nodiscard]] bool is_out(std::uint32_t part) const {
    return std::ranges::find(result_.taken, part, &TakenPart::part) != result_.taken.end();
  }

  /// Made once for what is left.
  Candidate& candidate(std::uint32_t part) {
    std::unique_ptr<Candidate>& made = candidates_[part];
    if (made) return *made;
    made = std::make_unique<Candidate>(scene_with_places(parts_, part, places_));
    const std::span<const std::uint32_t> others = parts_.others_of(part);
    Ball rest = ball_about(made->view, [&](std::size_t body) { return !is_out(others[body - 1]); });
    SlidingPart sliding(made->view);
    made->at = sliding.grip_pose(pose_of(places_[part]));
    if (rest.radius_m == 0) rest.centre = haptic::tools::place_of(made->at);
    made->way.emplace(made->view, rest, limits_.seed);
    made->stuck.part = part;
    return *made;
  }

  /// How large the parts are; then the smallest goes first, where several may.
  void measure() {
    if (left_.size() > kMostTakenApart) {
      throw InputError(
          formatted("%zu parts are to be taken apart, and an order is found for %zu at "
                    "most; make those that are put together first fixed",
                    left_.size(), kMostTakenApart));
    }
    std::vector<double> radii(parts_.count(), 0);
    double most_m = 0;
    Ball all;
    for (const AssembledPart& part : left_) {
      Candidate& of = candidate(part.part);
      const double radius_m = radii[part.part] = of.way->part().radius_m();
      most_m = std::max(most_m, radius_m);
      const Ball others = ball_about(of.view, [](std::size_t) { return true; });
      const double reach_m = (haptic::tools::place_of(of.at) - others.centre).norm() + radius_m;
      const double ball_m = std::max(others.radius_m, reach_m);
      if (all.radius_m == 0 || ball_m < all.radius_m) all = {others.centre, ball_m};
    }
    size_m_ = 2 * all.radius_m;
    const double beside_m = 1.2 * (all.radius_m + most_m) + kApart * most_m;
    const double half =
        std::numbers::pi / static_cast<double>(std::max<std::size_t>(left_.size(), 2));
    ring_ = {all.centre, std::max(beside_m, kApart * most_m / (2 * std::sin(half))),
             std::vector<bool>(left_.size(), false)};
    std::ranges::stable_sort(left_, [&](const AssembledPart& a, const AssembledPart& b) {
      return radii[a.part] < radii[b.part];
    });
  }

  /// Moves parts that overlap others by rounding: from what never moves on, each out of those that
  /// were looked at before it, which it lies on or leans on.
  void settle() {
    const double most_m = kSettleShare * size_m_;
    if (!are_free()) {
      const std::vector<PartPlace> assembled = places_;
      std::vector<std::uint32_t> waiting;
      for (const AssembledPart& part : left_) {
        places_[part.part] = far_away(waiting.size());
        waiting.push_back(part.part);
      }
      while (!waiting.empty()) settle_next(waiting, assembled, most_m);
      forget();
    }
    for (const AssembledPart& part : left_) {
      Candidate& of = candidate(part.part);
      double depth_m = 0;
      if (push_out(of.way->prover(), of.at, 0, depth_m)) refuse_overlap(of, depth_m, most_m);
      const auto body = enclosing_body(of.view, of.at);
      if (!body) continue;
      throw InputError(name(part.part) + " lies within the closed surface of " +
                       name(parts_.others_of(part.part)[*body - 1]) +
                       " where it is assembled; give other poses");
    }
  }

  bool are_free() {
    return std::ranges::all_of(left_, [&](const AssembledPart& part) {
      Candidate& of = candidate(part.part);
      return of.way->prover().is_free(of.at);
    });
  }

  /// The part of `waiting` that is nearest to those that stand.
  void settle_next(std::vector<std::uint32_t>& waiting, const std::vector<PartPlace>& assembled,
                   double most_m) {
    double least_m = std::numeric_limits<double>::infinity();
    std::size_t nearest = 0;
    for (std::size_t k = 0; k < waiting.size(); ++k) {
      const PartPlace away = std::exchange(places_[waiting[k]], assembled[waiting[k]]);
      candidates_[waiting[k]].reset();
      Candidate& of = candidate(waiting[k]);
      const double gap_m = of.way->prover().clearance(of.at).gap_m;
      // The largest of several alike, which is the last.
      if (gap_m <= least_m) nearest = k;
      least_m = std::min(least_m, gap_m);
      places_[waiting[k]] = away;
    }
    const std::uint32_t part = waiting[nearest];
    Candidate& of = candidate(part);
    double depth_m = 0;
    const std::optional<PlanPose> free = of.way->settled(of.at, most_m, depth_m);
    if (!free) refuse_overlap(of, depth_m, most_m);
    places_[part] = assembled[part];
    if (!(*free == of.at)) {
      const double moved_m =
          (haptic::tools::place_of(*free) - haptic::tools::place_of(of.at)).norm();
      result_.settled.push_back({part, moved_m});
      places_[part] = place_of_mesh(of.way->part().mesh_pose(*free));
    }
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(nearest));
  }

  /// Where a part touches nothing while others are looked at.
  [[nodiscard]] PartPlace far_away(std::size_t number) const {
    PartPlace place;
    place.p_wa_m[0] = ring_.centre.x() + 8 * static_cast<double>(number + 1) * ring_.radius_m;
    return place;
  }

  [[noreturn]] void refuse_overlap(Candidate& of, double depth_m, double most_m) {
    const std::uint32_t part = of.stuck.part;
    static_cast<void>(of.way->prover().is_free(of.at));
    const auto pieces = of.view.pieces();
    const PieceRecord& piece = pieces[of.way->prover().blocked().piece_b];
    const std::string other = name(parts_.others_of(part)[piece.body - 1]);
    const std::string surfaces =
        surfaces_of(is_flat(pieces.front()) ? name(part) : "", is_flat(piece) ? other : "");
    throw InputError(
        name(part) + " and " + other +
        formatted(" overlap where they are assembled, by %.3g m about, and no free place is within "
                  "%.3g m (%.0e of the assembly's size); give poses at which they do not, or ",
                  depth_m, most_m, kSettleShare) +
        surfaces +
        formatted("[coupling] tolerance_m = %.1e, the depth that counts as free",
                  kCountedDepths * depth_m));
  }

  /// No depth of a facet counts as free.
  [[nodiscard]] static std::string surfaces_of(const std::string& one, const std::string& other) {
    if (one.empty() && other.empty()) return "";
    const std::string both = one.empty() ? other : other.empty() ? one : one + " and " + other;
    return "as = \"solid\" in the table of " + both + ", a surface, which has no depth, and ";
  }

  void forget() {
    for (std::unique_ptr<Candidate>& candidate : candidates_) candidate.reset();
  }

  /// Takes the part out that is cheapest to take. False: none was found.
  bool take_one() {
    for (std::uint32_t level = 0;; ++level) {
      for (std::size_t k = 0; k < left_.size(); ++k) {
        if (seconds() > limits_.seconds) {
          result_.timed_out = true;
          return false;
        }
        const AssembledPart part = left_[k];
        std::optional<OutWay> way = way_out(candidate(part.part), level);
        if (!way || !lay_down(part, *way)) continue;
        left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(k));
        forget();
        return true;
      }
    }
  }

  std::optional<OutWay> way_out(Candidate& of, std::uint32_t level) {
    if (level == 0) return of.way->straight(of.at);
    if (level == 1) return of.way->by_cells(of.at, of.stuck.no_translation);
    const std::uint32_t round = level - 2;
    SearchLimits search;
    search.seconds = std::max(limits_.seconds - seconds(), 0.0);
    search.clock_s = limits_.clock_s;
    search.most_ticks = kFirstTicks;
    for (std::uint32_t k = 0; k < std::min(round, 20u); ++k) search.most_ticks *= kTicksGrow;
    search.seed = hashed(limits_.seed + 64 * round + of.stuck.part);
    say_(formatted("%.0f s, %zu parts are out, %zu left; round %u: ", seconds(),
                   result_.taken.size(), left_.size(), round + 1) +
         name(of.stuck.part));
    std::optional<OutWay> way = of.way->by_search(of.at, round, search, [](const SearchState&) {});
    note_holds(of);
    return way;
  }

  void note_holds(Candidate& of) {
    if (of.way->held_by().empty()) return;
    of.stuck.holds.clear();
    for (const HoldingPlane& plane : of.way->held_by()) {
      const PairRecord pair = of.view.pair_record(plane.pair);
      const std::uint32_t body = of.view.pieces()[pair.piece_b].body;
      of.stuck.holds.push_back(
          {parts_.others_of(of.stuck.part)[body - 1], plane, pair.piece_a, pair.piece_b});
    }
  }

  /// On to where the part is to lie.
  bool lay_down(const AssembledPart& part, OutWay& way) {
    Candidate& of = candidate(part.part);
    const auto keep = [&](const PartPlace& lies) {
      result_.taken.push_back({part.part, places_[part.part], lies, std::move(way)});
      places_[part.part] = lies;
      say_(formatted("%.0f s, %zu of %zu: ", seconds(), result_.taken.size(),
                     result_.taken.size() + left_.size() - 1) +
           name(part.part) + " is out");
      return true;
    };
    if (part.lies) {
      const PlanPose to = of.way->part().grip_pose(pose_of(*part.lies));
      return reach(of, way, to) && keep(*part.lies);
    }
    const Vec3d end = haptic::tools::place_of(way.motion.corners.back());
    std::vector<std::size_t> slots;
    for (std::size_t k = 0; k < ring_.taken.size(); ++k)
      if (!ring_.taken[k]) slots.push_back(k);
    std::ranges::stable_sort(slots, std::less<>{},
                             [&](std::size_t k) { return (ring_.place(k) - end).norm(); });
    for (const std::size_t slot : slots) {
      const PlanPose to = plan_pose(ring_.place(slot), turn_of(way.motion.corners.back()));
      if (!of.way->go_on(way, to)) continue;
      ring_.taken[slot] = true;
      return keep(place_of_mesh(of.way->part().mesh_pose(to)));
    }
    return false;
  }

  bool reach(Candidate& of, OutWay& way, const PlanPose& to) {
    if (of.way->go_on(way, to)) return true;
    if (!of.way->prover().is_free(to)) return false;
    SearchLimits search;
    search.seconds = std::max(limits_.seconds - seconds(), 0.0);
    search.clock_s = limits_.clock_s;
    search.most_ticks = kReachTicks;
    search.seed = limits_.seed;
    const SearchResult found =
        search_plan(of.view, of.way->part(), of.way->prover(), way.motion.corners.back(), to,
                    search, [](const SearchState&) {});
    if (!found.found) return false;
    const std::vector<PlanPose>& corners = found.motion.corners;
    way.motion.corners.insert(way.motion.corners.end(), corners.begin() + 1, corners.end());
    return true;
  }

  StuckPart stuck(const AssembledPart& part) {
    Candidate& of = candidate(part.part);
    if (of.stuck.holds.empty()) {
      // The time was over before the search came to it: pushed once, it says what it leans on.
      SearchLimits search;
      search.most_ticks = 2000;
      static_cast<void>(of.way->by_search(of.at, 0, search, [](const SearchState&) {}));
      note_holds(of);
    }
    return of.stuck;
  }

  const PartScenes& parts_;
  std::vector<PartPlace> places_;
  std::vector<AssembledPart> left_;
  const DisassemblyLimits& limits_;
  const std::function<void(const std::string&)>& say_;
  std::vector<std::unique_ptr<Candidate>> candidates_;  ///< by part
  Ring ring_;
  double size_m_ = 0, began_s_ = 0;
  Disassembly result_;
};

}  // namespace

Disassembly take_apart(const PartScenes& parts, std::vector<PartPlace> places,
                       const std::vector<AssembledPart>& movable, const DisassemblyLimits& limits,
                       const std::function<void(const std::string&)>& say) {
  return TakingApart(parts, std::move(places), movable, limits, say).run();
}

}  // namespace haptic::tools
