// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/crossings.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {
namespace {

constexpr double kTick_s = 1e-3, kTurn = 6.283185307179586;
constexpr Wide kFiftyMillimetres = 0.05L;
/// Ticks at the end in which the device rests.
constexpr std::uint64_t kRest = 60;

double log_uniform(Seeded& random, double low, double high) {
  return low * std::exp(random.uniform(0, std::log(high / low)));
}

enum Shape : std::uint32_t { kRod, kBlade, kSheet };
constexpr const char* kShapeNames[] = {"rod", "blade", "sheet"};

struct Thin {
  Solid solid;
  double half_x_m, half_y_m, thickness_m;
};

/// Long along x, thinnest along z.
Thin thin_of(Shape shape, double length_m, double thickness_m, Seeded& random) {
  double width = thickness_m;
  if (shape == kBlade) width = random.uniform(0.004, 0.015);
  if (shape == kSheet) width = random.uniform(0.7, 1.0) * length_m;
  return {centred_box(kShapeNames[shape], length_m / 2, width / 2, thickness_m / 2), length_m / 2,
          width / 2, thickness_m};
}

struct Crossing {
  FuzzScene scene;
  std::string group;
  double thinner_m = 0;
  Rotation frame;                 ///< the obstacle rolled about its length, as it is met
  Rotation tilt;                  ///< of the part, before it yaws
  Vector from, velocity_m_per_s;  /// in the frame
  double swing_rad, swing_hz, phase;
  std::uint64_t ticks = 0;

  [[nodiscard]] Pose device(std::uint64_t tick) const {
    const double t = static_cast<double>(std::min(tick, ticks)) * kTick_s;
    const double yaw = swing_rad * std::sin(kTurn * swing_hz * t + phase);
    const Rotation turn(Eigen::AngleAxisd(yaw, Vector::UnitZ()));
    return pose_at(frame * (from + t * velocity_m_per_s), frame * turn * tilt);
  }
};

Rotation about_x(double angle_rad) {
  return Rotation(Eigen::AngleAxisd(angle_rad, Vector::UnitX()));
}

/// Flat, on edge, or anyhow.
double roll_of(Seeded& random) {
  const std::uint32_t k = random.below(3);
  return k == 0 ? 0 : k == 1 ? kTurn / 4 : random.uniform(0, kTurn / 2);
}

Crossing crossing_of(std::uint64_t number, std::uint64_t random_ones, std::uint64_t rods,
                     Seeded& random) {
  Crossing c;
  const bool thin_rods = number >= random_ones && number < random_ones + rods;
  const bool parallel = number >= random_ones + rods;
  Shape part = static_cast<Shape>(number % 3), obstacle = static_cast<Shape>(number / 3 % 3);
  double length_m = random.uniform(0.02, 0.1), other_m = random.uniform(0.02, 0.1);
  double thick_m = log_uniform(random, 1e-5, 1e-3), other_thick_m = log_uniform(random, 1e-5, 1e-3);
  double speed = log_uniform(random, 0.01, 2.0);
  if (thin_rods) {
    part = obstacle = kRod;
    length_m = other_m = 0.1;
    thick_m = other_thick_m = 2e-4;
    speed = 1.2;
  }
  const Thin a = thin_of(part, length_m, thick_m, random);
  const Thin b = thin_of(obstacle, other_m, other_thick_m, random);
  c.thinner_m = std::min(a.thickness_m, b.thickness_m);
  c.group = thin_rods  ? "two rods of 0.2 mm"
            : parallel ? "nearly parallel"
                       : std::string(kShapeNames[part]) + " at " + kShapeNames[obstacle];
  c.scene.name = c.group;
  c.scene.part = a.solid;
  c.scene.pieces = {b.solid};
  c.frame = thin_rods ? Rotation::Identity() : about_x(roll_of(random));
  c.scene.device = number % 2 == 1;
  const double pitch = random.below(2) == 0 ? 0 : random.uniform(-0.05, 0.05);
  c.tilt = Rotation(Eigen::AngleAxisd(pitch, Vector::UnitY())) *
           about_x(thin_rods ? 0 : roll_of(random));
  // Above all that either can reach.
  const double height = std::hypot(a.half_y_m, thick_m) + std::hypot(b.half_y_m, other_thick_m) +
                        std::abs(pitch) * a.half_x_m + 1e-3;
  const double beyond = height + random.uniform(0.005, 0.02);
  c.ticks = static_cast<std::uint64_t>(std::ceil((height + beyond) / speed / kTick_s));
  const double lasts = static_cast<double>(c.ticks) * kTick_s;
  c.swing_rad = parallel ? log_uniform(random, 1e-6, 1e-2) : random.uniform(0.05, 1.2);
  if (random.below(2) == 0 || thin_rods) {
    // Parallel within a few ticks of the first touch.
    const double touch_s = (height - (thick_m + other_thick_m) / 2) / speed;
    const double at_s = touch_s + random.uniform(-2, 2) * kTick_s;
    if (!parallel) c.swing_rad = 1;
    c.swing_hz = log_uniform(random, 1, 20) / (kTurn * c.swing_rad);
    c.phase = -kTurn * c.swing_hz * at_s;
  } else {
    // One to four times on the way, at 10 rad/s at the most.
    c.swing_hz = std::min(random.uniform(0.5, 2.0) / lasts, 10.0 / (kTurn * c.swing_rad));
    c.phase = -kTurn * c.swing_hz * random.uniform(0.3, 0.8) * lasts;
  }
  const double x = 0.3 * std::min(length_m, other_m);
  const double y = 0.3 * std::max(a.half_y_m, b.half_y_m);
  const Vector lateral(random.uniform(-0.3, 0.3), random.uniform(-0.05, 0.05), 0);
  c.velocity_m_per_s = speed * (lateral - Vector::UnitZ());
  c.from = Vector(random.uniform(-x, x), random.uniform(-y, y), height) -
           lateral * (height + beyond) / 2;
  c.scene.start = c.frame * c.from;
  return c;
}

/// One crossing with so many passes in a tick.
void cross(const Crossing& crossing, std::uint32_t passes, const std::string& label,
           std::optional<ProxyFault> fault, CrossingTotals& totals) {
  const std::vector<std::byte> blob = compiled(crossing.scene, 0, passes);
  CoreSession session(blob, crossing.scene.name);
  ProxyJudge judge(crossing.scene, session.view());
  if (fault) damage(session, *fault);
  const Wide share = judge.radius_m() / kFiftyMillimetres, allowed = judge.allowed_depth_m();
  const std::uint64_t repeats = passes == 1 ? kDefaultProxyPasses : 1;
  StepInput input;
  WidePose before;
  bool met = false, deep = false, dip = false, through = false;
  for (std::uint64_t t = 0; t < (crossing.ticks + kRest) * repeats; ++t) {
    input.pose_wa = crossing.device(t / repeats);
    ++input.sequence;
    const StepResult result = session.core().step(input);
    const WidePose after = wide_pose(result.proxy_pose_wa);
    met = met || norm(after.p - wide_pose(result.goal_pose_wa).p) > 1e-5L;
    const auto fail = [&](const char* kind, Wide gap) {
      totals.failures.add(kind, failure_text(label + ", tick " + std::to_string(t / repeats) +
                                                 ", pass " + std::to_string(t % repeats),
                                             result.proxy_pose_wa,
                                             "gap " + number_text(gap) + " m, thickness " +
                                                 number_text(widen(crossing.thinner_m)) + " m"));
    };
    const Wide end = judge.end_gap_m(after, -allowed);
    ++totals.ends;
    totals.worst_end_m = std::min(totals.worst_end_m, end / share);
    if (end < -allowed && !deep) {
      deep = true;
      fail("end too deep", end);
    }
    if (passes == 1 && t > 0) {
      const Wide gap = judge.path_gap_m(before, after);
      ++totals.paths;
      totals.worst_path_m = std::min(totals.worst_path_m, gap / share);
      if (gap < -widen(crossing.thinner_m) / 10) {
        if (!through) fail("through", gap);
        through = true;
      } else if (gap < -allowed) {
        if (!dip) fail("dips on the way", gap);
        dip = true;
      }
    }
    before = after;
    if (through) break;
  }
  if (met) totals.met = 1;
  if (deep) totals.deep = 1;
  if (through) {
    totals.through = 1;
  } else if (dip) {
    totals.dips = 1;
  }
}

std::vector<Cell> cells_of(const std::string& group, const CrossingTotals& t, bool file) {
  const Cell name = file ? quoted(group) : Cell(group);
  return {name,
          t.crossings,
          t.met,
          t.paths,
          number_text(t.worst_end_m * 1e6L),
          number_text(t.worst_path_m * 1e6L),
          t.through,
          t.dips,
          t.deep};
}

ReportTable crossing_table(const CrossingResult& result, bool file) {
  ReportTable table(file ? "group,crossings,met,paths,worst_end_um,worst_path_um,through,dips,deep"
                         : "group,crossings,met,ways,worst end um,worst way um,through,dips,ends "
                           "too deep");
  for (const CrossingRow& row : result.rows) table.add(cells_of(row.group, row.totals, file));
  return table;
}

}  // namespace

void CrossingTotals::add(const CrossingTotals& other) {
  using T = CrossingTotals;
  for (const auto field :
       {&T::crossings, &T::met, &T::paths, &T::ends, &T::through, &T::dips, &T::deep}) {
    this->*field += other.*field;
  }
  worst_end_m = std::min(worst_end_m, other.worst_end_m);
  worst_path_m = std::min(worst_path_m, other.worst_path_m);
  failures.add(other.failures);
}

CrossingResult run_crossings(const CrossingSize& size, const RunOptions& options) {
  const std::uint64_t rods = (3 * size.crossings + 9) / 10, parallel = (size.crossings + 9) / 10;
  const std::uint64_t count = size.crossings + rods + parallel;
  if (size.only && *size.only >= count) {
    throw tools::InputError("no crossing " + std::to_string(*size.only) + "; there are " +
                            std::to_string(count) + ", from 0");
  }
  const std::vector<std::uint64_t> numbers = numbers_of(count, size.only);
  std::vector<CrossingRow> all(numbers.size());
  run_shards(
      numbers.size(), options, "crossings", [] { return 0; },
      [&](int, std::size_t k) {
        Seeded random(seed_of(size.seed, numbers[k]));
        const Crossing crossing = crossing_of(numbers[k], size.crossings, rods, random);
        all[k].group = crossing.group;
        CrossingTotals& totals = all[k].totals;
        totals.crossings = 1;
        const std::string label = crossing.group + ", seed " + std::to_string(size.seed) +
                                  ", crossing " + std::to_string(numbers[k]);
        cross(crossing, 1, label, size.fault, totals);
        cross(crossing, kDefaultProxyPasses, label + ", all passes", size.fault, totals);
      });
  Groups<std::string, CrossingTotals> groups;
  for (const CrossingRow& one : all) groups.at(one.group).add(one.totals);
  CrossingResult result{size, {}};
  for (const auto& [group, totals] : groups.list()) result.rows.push_back({group, totals});
  return result;
}

std::string crossings_page(const CrossingResult& result) {
  const CrossingTotals t = result.totals();
  std::string text = "# Thin parts at thin obstacles\n\n";
  text += std::to_string(t.crossings) + " crossings, seed " + std::to_string(result.size.seed) +
          ": rods, blades and sheets of 10 um to 1 mm at 0.01 to 2 m/s that turn through parallel. "
          "The straight way of every pass is judged; gaps are for a part of 50 mm and must be at "
          "least -0.1 um. Through: a way sinks in by a tenth of the thinner one.\n\n";
  return text + crossing_table(result, false).markdown() + failure_section(t.failures);
}

CampaignEnd crossings_end(const CrossingResult& result) {
  const CrossingTotals t = result.totals();
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["crossings"] = t.crossings;
  j["passed"] = t.failed() == 0;
  j["through"] = t.through;
  j["dips"] = t.dips;
  j["ends_too_deep"] = t.deep;
  j["worst_end_gap_m"] = static_cast<double>(t.worst_end_m);
  j["worst_path_gap_m"] = static_cast<double>(t.worst_path_m);
  j["groups"] = crossing_table(result, true).json();
  j["failures"] = t.failures.lines();
  const std::string page = crossings_page(result);
  return {page, campaign_files("crossings", crossing_table(result, true).csv(), j, page),
          t.failed() == 0};
}

}  // namespace haptic::sim
