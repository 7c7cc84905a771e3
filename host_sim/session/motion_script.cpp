// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/motion_script.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <string_view>

#include "rt_core/base/rotation.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/split_mix.hpp"
#include "tools/common/toml_file.hpp"
#include "tools/common/toml_table.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kLargestScriptBytes = std::size_t{1} << 24;
constexpr double kLargestRate_hz = 20000.0;
constexpr double kLargestSampleCount = 2.0e7;
constexpr double kLargestPosition_m = 10.0;  // beyond, a script is in millimetres
constexpr double kLargestTime_s = 1.0e5;
constexpr double kQuaternionTolerance = 1.0e-3;
// The shorter way round is ambiguous at a half turn; stay clear of it.
constexpr double kLargestTurn_rad = 3.0;
constexpr double kTwoPi = 6.28318530717958647693;

// ---- Reading ----

// The script being read; every refusal names its file and line.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {}

  [[noreturn]] void refuse(const toml::source_region& place, const std::string& defect) const {
    throw tools::InputError(path_ + ":" + std::to_string(place.begin.line) + ": " + defect);
  }

  void check_keys(const toml::table& table, std::initializer_list<std::string_view> allowed) const {
    for (const auto& [key, value] : table) {
      if (std::find(allowed.begin(), allowed.end(), key.str()) != allowed.end()) continue;
      std::string list;
      for (const std::string_view name : allowed) {
        list += list.empty() ? "" : ", ";
        list += name;
      }
      const std::string near = tools::nearest_word(key.str(), {allowed.begin(), allowed.end()});
      refuse(key.source(), "unknown key '" + std::string(key.str()) + "'; " +
                               (near.empty() ? "" : "did you mean '" + near + "'? ") +
                               "Known here: " + list);
    }
  }

  const toml::node& required(const toml::table& table, std::string_view key) const {
    const toml::node* node = table.get(key);
    if (node == nullptr)
      refuse(table.source(), "the key '" + std::string(key) + "' is missing; add it");
    return *node;
  }

  double number(const toml::node& node, std::string_view name, double low, double high) const {
    const auto value = node.value<double>();
    const std::string wanted = tools::short_number(low, 9) + " to " + tools::short_number(high, 9);
    if (!node.is_number() || !value) {
      refuse(node.source(),
             std::string(name) + " must be a number, without quotes, from " + wanted);
    }
    if (!(*value >= low && *value <= high)) {
      refuse(node.source(), std::string(name) + " must be a number from " + wanted + ", and is " +
                                tools::short_number(*value, 9) + unit_question(name));
    }
    return *value;
  }

  double number_or(const toml::table& table, std::string_view key, double low, double high,
                   double otherwise) const {
    const toml::node* node = table.get(key);
    return node == nullptr ? otherwise : number(*node, key, low, high);
  }

  template <std::size_t kSize>
  void numbers(const toml::node& node, std::string_view name, double low, double high,
               double (&out)[kSize]) const {
    const toml::array* list = node.as_array();
    if (list == nullptr || list->size() != kSize) {
      refuse(node.source(),
             std::string(name) + " must be a list of " + std::to_string(kSize) + " numbers");
    }
    for (std::size_t i = 0; i < kSize; ++i) out[i] = number(*list->get(i), name, low, high);
  }

  std::string text(const toml::node& node, std::string_view name) const {
    const auto value = node.value<std::string>();
    if (!value || value->empty()) {
      refuse(node.source(), std::string(name) + " must be a text in quotes, not empty");
    }
    return *value;
  }

 private:
  /// Guess of the unit of a number that is out of its range.
  static std::string unit_question(std::string_view name) {
    if (name == "position_m") return "; it is in metres: are these millimetres?";
    if (name == "angle_rad") return "; it is in radians: are these degrees?";
    if (name == "t_s") return "; it is in seconds: are these milliseconds?";
    return {};
  }

  const std::string& path_;
};

Quat to_quat(const double (&q)[4]) {
  return Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
              static_cast<Real>(q[3]));
}

// Normalised in double, so that the motion is unit to double precision for either Real.
void store(const Quat& quat, double (&q)[4]) {
  const std::array<double, 4> raw = {static_cast<double>(quat.w()), static_cast<double>(quat.x()),
                                     static_cast<double>(quat.y()), static_cast<double>(quat.z())};
  const double square = ((raw[0] * raw[0] + raw[1] * raw[1]) + raw[2] * raw[2]) + raw[3] * raw[3];
  const double scale = 1.0 / std::sqrt(square);
  for (std::size_t i = 0; i < 4; ++i) q[i] = scale * raw[i];
}

void read_quaternion(const Reader& reader, const toml::node& node, double (&q)[4]) {
  const toml::table* table = node.as_table();
  if (table == nullptr)
    reader.refuse(node.source(), "quaternion must be a table, as { w = 1, x = 0, y = 0, z = 0 }");
  reader.check_keys(*table, {"w", "x", "y", "z"});
  constexpr std::array<std::string_view, 4> kNames = {"w", "x", "y", "z"};
  double square = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = reader.number(reader.required(*table, kNames[i]), kNames[i], -2.0, 2.0);
    square += q[i] * q[i];
  }
  const double length = std::sqrt(square);
  if (!(std::abs(length - 1.0) <= kQuaternionTolerance)) {
    reader.refuse(node.source(),
                  "the quaternion has length " + std::to_string(length) + ", not 1; normalise it");
  }
  for (double& component : q) component /= length;
}

// Orientation: `quaternion`, or `axis` with `angle_rad`, or neither for the identity.
void read_orientation(const Reader& reader, const toml::table& table, double (&q)[4]) {
  const toml::node* quaternion = table.get("quaternion");
  const toml::node* axis = table.get("axis");
  const toml::node* angle = table.get("angle_rad");
  if (quaternion != nullptr && (axis != nullptr || angle != nullptr)) {
    reader.refuse(quaternion->source(),
                  "orientation given twice; keep quaternion, or axis and angle_rad");
  }
  if ((axis != nullptr) != (angle != nullptr)) {
    reader.refuse((axis != nullptr ? axis : angle)->source(),
                  "axis and angle_rad go together; give both");
  }
  if (quaternion != nullptr) read_quaternion(reader, *quaternion, q);
  if (axis == nullptr) return;
  double direction[3] = {0.0, 0.0, 0.0};
  reader.numbers(*axis, "axis", -1.0e6, 1.0e6, direction);
  const double angle_rad = reader.number(*angle, "angle_rad", -kTwoPi, kTwoPi);
  double square = 0.0;
  for (const double c : direction) square += c * c;
  if (!(square > 1.0e-12)) reader.refuse(axis->source(), "axis has no length; give a direction");
  const double scale = angle_rad / std::sqrt(square);
  store(
      so3_exp(Vec3(static_cast<Real>(scale * direction[0]), static_cast<Real>(scale * direction[1]),
                   static_cast<Real>(scale * direction[2]))),
      q);
}

Vec3 turn_between(const WayPoint& from, const WayPoint& to) {
  return so3_log(to_quat(from.q_wxyz).conjugate() * to_quat(to.q_wxyz));
}

WayPoint read_waypoint(const Reader& reader, const toml::table& table) {
  reader.check_keys(table, {"phase", "t_s", "position_m", "quaternion", "axis", "angle_rad",
                            "tremor", "hold", "let_go"});
  WayPoint point;
  if (const toml::node* phase = table.get("phase")) point.phase = reader.text(*phase, "phase");
  point.t_s = reader.number(reader.required(table, "t_s"), "t_s", 0.0, kLargestTime_s);
  reader.numbers(reader.required(table, "position_m"), "position_m", -kLargestPosition_m,
                 kLargestPosition_m, point.p);
  read_orientation(reader, table, point.q_wxyz);
  point.tremor = reader.number_or(table, "tremor", 0.0, 1.0, 1.0);
  return point;
}

/// `hold = "part"` or `let_go = true`, done where the way point is reached.
void read_hold(const Reader& reader, const toml::table& table, double t_s,
               std::vector<HoldCommand>& holds) {
  const toml::node* hold = table.get("hold");
  const toml::node* let_go = table.get("let_go");
  if (hold != nullptr && let_go != nullptr)
    reader.refuse(let_go->source(), "hold is given too; to hold a part lets go of the one before");
  if (hold != nullptr) holds.push_back({t_s, reader.text(*hold, "hold")});
  if (let_go == nullptr) return;
  const auto value = let_go->value<bool>();
  if (!let_go->is_boolean() || !value || !*value)
    reader.refuse(let_go->source(), "let_go must be true, or left out");
  holds.push_back({t_s, ""});
}

void read_waypoints(const Reader& reader, const toml::table& root, MotionScript& script) {
  const toml::node& node = reader.required(root, "waypoint");
  const toml::array* list = node.as_array();
  if (list == nullptr || !list->is_array_of_tables() || list->size() < 2) {
    reader.refuse(node.source(), "give at least two [[waypoint]] tables");
  }
  for (const toml::node& entry : *list) {
    const WayPoint point = read_waypoint(reader, *entry.as_table());
    if (!script.waypoints.empty()) {
      const WayPoint& before = script.waypoints.back();
      if (!(point.t_s > before.t_s)) {
        reader.refuse(entry.source(), "t_s must be later than that of the way point before, " +
                                          tools::short_number(before.t_s, 9) + " s, and is " +
                                          tools::short_number(point.t_s, 9) + " s");
      }
      if (static_cast<double>(turn_between(before, point).norm()) > kLargestTurn_rad) {
        reader.refuse(entry.source(),
                      "turns by more than 3 rad from the way point before, where the "
                      "direction is ambiguous; add a way point between");
      }
    }
    script.waypoints.push_back(point);
    read_hold(reader, *entry.as_table(), point.t_s, script.holds);
  }
  const double duration_s = script.waypoints.back().t_s - script.waypoints.front().t_s;
  if (duration_s * script.rate_hz > kLargestSampleCount) {
    reader.refuse(node.source(), "more than 20 million samples; lower rate_hz or the times");
  }
}

void read_tremor(const Reader& reader, const toml::node& node, double rate_hz, Tremor& tremor) {
  const toml::table* table = node.as_table();
  if (table == nullptr) reader.refuse(node.source(), "tremor must be a table");
  reader.check_keys(*table, {"position_m", "angle_rad", "band_hz"});
  tremor.position_m = reader.number_or(*table, "position_m", 0.0, 0.1, 0.0);
  tremor.angle_rad = reader.number_or(*table, "angle_rad", 0.0, 1.0, 0.0);
  if (const toml::node* band = table->get("band_hz")) {
    reader.numbers(*band, "band_hz", 0.0, 0.5 * rate_hz, tremor.band_hz);
    if (!(tremor.band_hz[0] <= tremor.band_hz[1])) {
      reader.refuse(band->source(), "band_hz runs backwards; give the lower frequency first");
    }
  }
}

// ---- Generating ----

// Sum of three sines with the peak at most 1.
class TremorAxis {
 public:
  TremorAxis(tools::SplitMix64& random, const double (&band_hz)[2]) {
    for (Sine& sine : sines_) {
      sine.frequency_hz = band_hz[0] + (band_hz[1] - band_hz[0]) * random.uniform();
      sine.phase_cycles = random.uniform();
    }
  }

  [[nodiscard]] double at(double t_s) const {
    double sum = 0.0;
    for (const Sine& sine : sines_) {
      // Whole cycles are dropped in double, so that the argument is small for either Real.
      const double cycles = sine.frequency_hz * t_s + sine.phase_cycles;
      const double fraction = cycles - std::floor(cycles);
      sum += static_cast<double>(bounded_sin(static_cast<Real>(kTwoPi * fraction)));
    }
    return sum / static_cast<double>(sines_.size());
  }

 private:
  struct Sine {
    double frequency_hz = 0.0;
    double phase_cycles = 0.0;
  };
  std::array<Sine, 3> sines_;
};

// Minimum-jerk blend from 0 to 1: zero velocity and acceleration at both ends (Flash, Hogan 1985).
double minimum_jerk(double s) { return s * s * s * (10.0 + s * (6.0 * s - 15.0)); }

// Index of the way point that ends the segment holding t_s, at least 1.
std::size_t segment_end(const MotionScript& script, double t_s) {
  std::size_t end = 1;
  while (end + 1 < script.waypoints.size() && t_s >= script.waypoints[end].t_s) ++end;
  return end;
}

/// A script that is a log, a motion or a scene by its name.
void refuse_what_is_no_script(const std::string& path) {
  if (path.ends_with(".rtscene"))
    throw tools::UsageError(path + ": a script is TOML with way points; 'host_sim motion --for " +
                            path + " -o motion.csv' makes a motion for a compiled scene");
  for (const std::string_view end : {".csv", ".tsv", ".txt", ".tum", ".json", ".jsonl"}) {
    if (!path.ends_with(end)) continue;
    throw tools::UsageError(path +
                            ": a script is TOML with way points; a motion is played by 'host_sim "
                            "replay SCENE.rtscene --motion " +
                            path + "', and made of a log by 'host_sim motion --from " + path +
                            " -o motion.csv'");
  }
}

}  // namespace

MotionScript read_motion_script(const std::string& path) {
  refuse_what_is_no_script(path);
  const Reader reader(path);
  const toml::table root = tools::read_toml_file(path, kLargestScriptBytes, "the motion script");
  if (!root.contains("waypoint") && (root.contains("moving") || root.contains("rendering")))
    throw tools::InputError(path + ": is a scene file; compile it with 'graph_compiler " + path +
                            " -o SCENE.rtscene', and make a motion for it with 'host_sim motion "
                            "--for SCENE.rtscene', or of a script of way points");
  reader.check_keys(root, {"format", "rate_hz", "seed", "tremor", "waypoint"});
  const toml::node& format = reader.required(root, "format");
  if (format.value<double>() != 1.0)
    reader.refuse(format.source(), "format must be 1, which is what this program reads");
  MotionScript script;
  script.rate_hz = reader.number_or(root, "rate_hz", 1.0, kLargestRate_hz, script.rate_hz);
  if (const toml::node* seed = root.get("seed")) {
    const auto value = seed->value_exact<std::int64_t>();
    if (!value || *value < 0) {
      reader.refuse(seed->source(), "seed must be a whole number without a point, not negative");
    }
    script.seed = static_cast<std::uint64_t>(*value);
  }
  if (const toml::node* tremor = root.get("tremor")) {
    read_tremor(reader, *tremor, script.rate_hz, script.tremor);
  }
  read_waypoints(reader, root, script);
  return script;
}

std::vector<MotionSample> make_motion(const MotionScript& script) {
  tools::SplitMix64 random(script.seed);
  std::vector<TremorAxis> axes;  // x y z, then the rotations about x y z
  for (int i = 0; i < 6; ++i) axes.emplace_back(random, script.tremor.band_hz);

  const double start_s = script.waypoints.front().t_s;
  const double duration_s = script.waypoints.back().t_s - start_s;
  // Half a thousandth of a period: a duration that is a multiple of it keeps its last sample.
  const auto steps = static_cast<std::size_t>(duration_s * script.rate_hz + 5.0e-4);
  std::vector<MotionSample> motion;
  motion.reserve(steps + 1);
  std::size_t end = 0;
  Vec3 turn = Vec3::Zero();
  for (std::size_t i = 0; i <= steps; ++i) {
    MotionSample sample;
    sample.t_s = start_s + static_cast<double>(i) / script.rate_hz;
    const std::size_t now = segment_end(script, sample.t_s);
    const WayPoint& from = script.waypoints[now - 1];
    const WayPoint& to = script.waypoints[now];
    if (now != end) turn = turn_between(from, to);
    end = now;
    const double s = std::clamp((sample.t_s - from.t_s) / (to.t_s - from.t_s), 0.0, 1.0);
    const double blend = minimum_jerk(s);
    const double factor = from.tremor + (to.tremor - from.tremor) * blend;
    const double shift_m = factor * script.tremor.position_m;
    const double angle_rad = factor * script.tremor.angle_rad;
    Vec3 shake = Vec3::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sample.p[axis] =
          from.p[axis] + (to.p[axis] - from.p[axis]) * blend + shift_m * axes[axis].at(sample.t_s);
      shake[static_cast<Eigen::Index>(axis)] =
          static_cast<Real>(angle_rad * axes[axis + 3].at(sample.t_s));
    }
    store(so3_exp(shake) * to_quat(from.q_wxyz) * so3_exp(static_cast<Real>(blend) * turn),
          sample.q_wxyz);
    motion.push_back(sample);
  }
  return motion;
}

const std::string& phase_at(const MotionScript& script, double t_s) {
  return script.waypoints[segment_end(script, t_s)].phase;
}

}  // namespace haptic::sim
