// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/plan.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <tuple>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/split_mix.hpp"

namespace haptic::tools {
namespace {

constexpr std::string_view kFirstWord = "haptic-plan";
constexpr std::string_view kVersion = "2";
/// Rounding of a quaternion's length, and of sums of lengths as a share of them.
constexpr double kUnitRounding = 1.0e-12, kLengthRounding = 1.0e-9;

std::uint64_t text_hash(std::string_view text) {
  std::uint64_t hash = hashed(text.size());
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return mixed(hash);
}

/// The shortest text that reads back as the same double.
void append_number(std::string& text, double value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  text += ' ';
  text.append(digits, end);
}

void append_count(std::string& text, std::uint64_t value) {
  text += ' ';
  text += std::to_string(value);
}

/// The words of the plan, line by line.
class PlanReader {
 public:
  PlanReader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(file_ + ":" + std::to_string(line_) + ": " + what +
                     "; make the plan again with host_sim plan");
  }

  /// Goes to the next line, which begins with `keyword`.
  void begin_line(std::string_view keyword) {
    line_ += 1;
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) fail("the file ends before '" + std::string(keyword) + "'");
    rest_ = text_.substr(at_, end - at_);
    line_at_ = at_;
    at_ = end + 1;
    if (const std::string_view found = word(); found != keyword) {
      fail("has '" + printable(found) + "' where '" + std::string(keyword) + "' belongs");
    }
  }
  [[nodiscard]] std::string_view word() {
    const std::size_t end = std::min(rest_.find(' '), rest_.size());
    const std::string_view found = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return found;
  }
  [[nodiscard]] std::string_view rest() {
    const std::string_view found = rest_;
    rest_ = {};
    return found;
  }
  void end_line() {
    if (!rest_.empty()) fail("has '" + printable(rest_) + "' behind what belongs there");
  }
  [[nodiscard]] double number(double most) {
    const std::string_view found = word();
    double value = 0;
    const auto [end, error] = std::from_chars(found.data(), found.data() + found.size(), value);
    if (error != std::errc{} || end != found.data() + found.size() || !std::isfinite(value)) {
      fail("'" + printable(found) + "' is no number");
    }
    if (std::abs(value) > most) {
      fail("'" + printable(found) + "' is beyond " + short_number(most, 6));
    }
    return value;
  }
  [[nodiscard]] std::uint64_t count(std::uint64_t most) {
    const std::string_view found = word();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(found.data(), found.data() + found.size(), value);
    if (error != std::errc{} || end != found.data() + found.size()) {
      fail("'" + printable(found) + "' is no count");
    }
    if (value > most) fail(std::to_string(value) + " is more than " + std::to_string(most));
    return value;
  }
  [[nodiscard]] std::uint64_t hash() {
    const std::string_view found = word();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(found.data(), found.data() + found.size(), value, 16);
    if (error != std::errc{} || end != found.data() + found.size() || found.size() != 16) {
      fail("'" + printable(found) + "' is no hash of 16 hexadecimal digits");
    }
    return value;
  }
  [[nodiscard]] char kind() {
    const std::string_view found = word();
    if (found != "A" && found != "B" && found != "C") {
      fail("'" + printable(found) + "' is no kind of plane; A, B and C are");
    }
    return found[0];
  }
  [[nodiscard]] std::uint32_t index(std::uint64_t most) {
    return static_cast<std::uint32_t>(count(most));
  }
  /// Where the line begins that was begun last.
  [[nodiscard]] std::size_t line_begin() const { return line_at_; }
  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }

 private:
  static std::string printable(std::string_view found) {
    std::string text(found.substr(0, 40));
    for (char& c : text) {
      if (c < ' ' || c > '~') c = '?';
    }
    return text;
  }

  std::string_view text_, rest_;
  const std::string& file_;
  std::size_t at_ = 0, line_at_ = 0;
  std::size_t line_ = 0;
};

PlanPose read_pose(PlanReader& in) {
  in.begin_line("pose");
  PlanPose pose;
  double square = 0;
  for (double& x : pose.x0_m) x = in.number(kMostPlanPlace_m);
  for (double& q : pose.q_wxyz) {
    q = in.number(2);
    square += q * q;
  }
  in.end_line();
  if (std::abs(square - 1) > 2 * kUnitRounding) in.fail("the quaternion is not of unit length");
  return pose;
}

void read_direction(PlanReader& in, std::array<double, 3>& direction) {
  double square = 0;
  for (double& x : direction) {
    x = in.number(2);
    square += x * x;
  }
  if (!(square > 0.25 && square < 4)) in.fail("a plane's direction is not of about unit length");
}

auto place_in_file(const PlanRun& run) { return std::tuple(run.first, run.piece_a, run.piece_b); }

PlanRun read_run(PlanReader& in, std::size_t steps) {
  in.begin_line("pair");
  PlanRun run;
  run.piece_a = in.index(kMostPieces);
  run.piece_b = in.index(kMostPieces);
  run.first = in.index(kMostPlanPoses);
  run.last = in.index(kMostPlanPoses);
  in.end_line();
  if (run.last < run.first || run.last >= steps) in.fail("a run of steps does not exist");
  return run;
}

PlanPlane read_plane(PlanReader& in, std::size_t steps, std::size_t& runs) {
  in.begin_line("plane");
  PlanPlane plane;
  plane.direction.kind = in.kind();
  if (plane.direction.kind != 'B') read_direction(in, plane.direction.of_a);
  if (plane.direction.kind != 'A') read_direction(in, plane.direction.of_b);
  const std::uint64_t count = in.count(kMostPlanRuns);
  in.end_line();
  runs += static_cast<std::size_t>(count);
  if (runs > kMostPlanRuns) in.fail("the planes have too many runs");
  for (std::uint64_t k = 0; k < count; ++k) {
    const PlanRun run = read_run(in, steps);
    if (!plane.runs.empty() && !(place_in_file(plane.runs.back()) < place_in_file(run))) {
      in.fail("runs of a plane are out of order");
    }
    plane.runs.push_back(run);
  }
  return plane;
}

/// True if a pair has two planes in one step.
bool has_two_planes(const Plan& plan) {
  std::vector<PlanRun> runs;
  for (const PlanPlane& plane : plan.planes) {
    runs.insert(runs.end(), plane.runs.begin(), plane.runs.end());
  }
  std::ranges::sort(
      runs, {}, [](const PlanRun& run) { return std::tuple(run.piece_a, run.piece_b, run.first); });
  return std::ranges::adjacent_find(runs, [](const PlanRun& run, const PlanRun& next) {
           return run.piece_a == next.piece_a && run.piece_b == next.piece_b &&
                  next.first <= run.last;
         }) != runs.end();
}

bool in_order(const std::vector<PlanContact>& contacts, const PlanContact& next) {
  if (contacts.empty()) return true;
  const PlanContact& last = contacts.back();
  return std::pair(last.piece_a, last.piece_b) < std::pair(next.piece_a, next.piece_b);
}

PlanStation read_station(PlanReader& in) {
  in.begin_line("station");
  PlanStation station;
  station.pose = in.index(kMostPlanPoses);
  station.clearance_m = in.number(2 * kMostPlanPlace_m);
  station.cost_to_go_m = in.number(std::numeric_limits<double>::max());
  const std::uint64_t contacts = in.count(kMostPlanRuns);
  for (std::uint64_t k = 0; k < contacts; ++k) {
    PlanContact contact;
    contact.kind = in.kind();
    contact.piece_a = in.index(kMostPieces);
    contact.piece_b = in.index(kMostPieces);
    if (!in_order(station.contacts, contact)) in.fail("contacts of a station are out of order");
    station.contacts.push_back(contact);
  }
  in.end_line();
  return station;
}

void read_poses(PlanReader& in, Plan& plan) {
  in.begin_line("poses");
  const std::uint64_t poses = in.count(kMostPlanPoses);
  in.end_line();
  if (poses < 1) in.fail("a plan has a pose at least");
  for (std::uint64_t k = 0; k < poses; ++k) {
    const PlanPose pose = read_pose(in);
    if (k > 0 && pose == plan.poses.back()) in.fail("is the pose before it once more");
    plan.poses.push_back(pose);
  }
}

void read_planes(PlanReader& in, Plan& plan) {
  in.begin_line("planes");
  const std::uint64_t planes = in.count(kMostPlanPlanes);
  in.end_line();
  std::size_t runs = 0;
  for (std::uint64_t k = 0; k < planes; ++k) {
    plan.planes.push_back(read_plane(in, plan.steps(), runs));
  }
  if (has_two_planes(plan)) in.fail("a pair of pieces has two planes in one step");
}

void read_stations(PlanReader& in, Plan& plan) {
  in.begin_line("stations");
  const std::uint64_t stations = in.count(kMostPlanStations);
  in.end_line();
  for (std::uint64_t k = 0; k < stations; ++k) {
    const PlanStation station = read_station(in);
    if (!plan.stations.empty() && station.pose <= plan.stations.back().pose) {
      in.fail("stations are out of order");
    }
    if (station.pose >= plan.poses.size()) in.fail("a station's pose does not exist");
    plan.stations.push_back(station);
  }
  if (plan.stations.empty() || plan.stations.front().pose != 0 ||
      plan.stations.back().pose + 1 != plan.poses.size()) {
    in.fail("the first and the last pose are not stations");
  }
  // Costs to go are sums of the poses' own.
  double to_go = 0;
  std::size_t station = plan.stations.size();
  for (std::size_t pose = plan.poses.size(); pose-- > 0;) {
    if (pose + 1 < plan.poses.size()) {
      to_go += step_length_m(plan.poses[pose], plan.poses[pose + 1], plan.length_m);
    }
    if (station == 0 || plan.stations[station - 1].pose != pose) continue;
    station -= 1;
    const double stated = plan.stations[station].cost_to_go_m;
    if (!(std::abs(stated - to_go) <= kLengthRounding * (to_go + plan.length_m))) {
      in.fail("station " + std::to_string(station) + " states a cost to go of " +
              short_number(stated, 9) + " m; its poses have " + short_number(to_go, 9) + " m");
    }
  }
}

}  // namespace

std::uint64_t geometry_hash(const SceneView& scene) noexcept {
  std::uint64_t hash = hashed(sizeof(Real));
  const auto add = [&](std::uint64_t word) { hash = mixed(hash ^ word) + kSplitMixStep; };
  const auto add_real = [&](double value) { add(std::bit_cast<std::uint64_t>(value)); };
  for (const BodyRecord& body : scene.bodies()) {
    add(body.piece_count);
    for (const double x : body.reference_m) add_real(x);
  }
  for (std::uint32_t k = 0; k < scene.pieces().size(); ++k) {
    const PieceView piece = scene.piece(k);
    add(std::uint64_t{piece.vertex_count} << 32 | piece.record->body);
    for (std::size_t v = 0; v < 3 * std::size_t{piece.vertex_count}; ++v) {
      add_real(static_cast<double>(piece.vertices[v]));
    }
  }
  return hash;
}

double step_length_m(const PlanPose& from, const PlanPose& to, double length_m) {
  double far2 = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    far2 += (to.x0_m[k] - from.x0_m[k]) * (to.x0_m[k] - from.x0_m[k]);
  }
  // Half the chord of two unit quaternions is the sine of a quarter of the angle between them.
  double chord2 = 0, other2 = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    chord2 += (to.q_wxyz[k] - from.q_wxyz[k]) * (to.q_wxyz[k] - from.q_wxyz[k]);
    other2 += (to.q_wxyz[k] + from.q_wxyz[k]) * (to.q_wxyz[k] + from.q_wxyz[k]);
  }
  const double turn = 4 * std::asin(std::min(1.0, std::sqrt(std::min(chord2, other2)) / 2));
  return std::sqrt(far2 + length_m * length_m * turn * turn);
}

PlanSweep::PlanSweep(const Plan& plan) {
  for (const PlanPlane& plane : plan.planes) {
    for (const PlanRun& run : plane.runs) all_.push_back({&run, &plane.direction});
  }
  std::ranges::sort(all_, {}, [](const Entry& entry) { return place_in_file(*entry.run); });
}

const std::vector<PlanWitness>& PlanSweep::at(std::size_t step) {
  if (begun_ && step == step_) return planes_;
  begun_ = true;
  step_ = step;
  std::erase_if(active_, [&](const Entry& entry) { return entry.run->last < step; });
  const auto old = static_cast<std::ptrdiff_t>(active_.size());
  const auto by_piece = [](const Entry& entry) {
    return std::pair(entry.run->piece_a, entry.run->piece_b);
  };
  for (; next_ < all_.size() && all_[next_].run->first <= step; ++next_) {
    if (all_[next_].run->last >= step) active_.push_back(all_[next_]);
  }
  // Those that begin in one step are in order, those of several steps that were left out are not.
  std::ranges::sort(active_.begin() + old, active_.end(), {}, by_piece);
  std::ranges::inplace_merge(active_, active_.begin() + old, {}, by_piece);
  planes_.clear();
  for (const Entry& entry : active_) {
    planes_.push_back({entry.run->piece_a, entry.run->piece_b, *entry.direction});
  }
  return planes_;
}

std::string plan_as_text(const Plan& plan) {
  std::string text = std::string(kFirstWord) + " " + std::string(kVersion) + "\n";
  text += "geometry " + hash_text(plan.geometry) + "\n";
  text += "scene " + plan.scene + "\n";
  text += "seed";
  append_count(text, plan.seed);
  const auto setting = [&](const char* name, double value) {
    text += "\n";
    text += name;
    append_number(text, value);
  };
  setting("tolerance", plan.tolerance_m);
  setting("contact", plan.contact_m);
  setting("length", plan.length_m);
  text += "\nposes";
  append_count(text, plan.poses.size());
  for (const PlanPose& pose : plan.poses) {
    text += "\npose";
    for (const double x : pose.x0_m) append_number(text, x);
    for (const double q : pose.q_wxyz) append_number(text, q);
  }
  text += "\nplanes";
  append_count(text, plan.planes.size());
  for (const PlanPlane& plane : plan.planes) {
    text += "\nplane ";
    text += plane.direction.kind;
    if (plane.direction.kind != 'B') {
      for (const double x : plane.direction.of_a) append_number(text, x);
    }
    if (plane.direction.kind != 'A') {
      for (const double x : plane.direction.of_b) append_number(text, x);
    }
    append_count(text, plane.runs.size());
    for (const PlanRun& run : plane.runs) {
      text += "\npair";
      for (const std::uint32_t x : {run.piece_a, run.piece_b, run.first, run.last}) {
        append_count(text, x);
      }
    }
  }
  text += "\nstations";
  append_count(text, plan.stations.size());
  for (const PlanStation& station : plan.stations) {
    text += "\nstation";
    append_count(text, station.pose);
    append_number(text, station.clearance_m);
    append_number(text, station.cost_to_go_m);
    append_count(text, station.contacts.size());
    for (const PlanContact& contact : station.contacts) {
      text += ' ';
      text += contact.kind;
      append_count(text, contact.piece_a);
      append_count(text, contact.piece_b);
    }
  }
  text += "\n";
  return text + "end " + hash_text(text_hash(text)) + "\n";
}

std::string resealed_plan(std::string_view text) {
  const std::size_t at = text.rfind("end ");
  std::string front(text.substr(0, std::min(at, text.size())));
  return front + "end " + hash_text(text_hash(front)) + "\n";
}

Plan parse_plan(std::string_view text, const std::string& file) {
  PlanReader in(text, file);
  Plan plan;
  in.begin_line(kFirstWord);
  if (const std::string_view version = in.rest(); version != kVersion) {
    if (version.ends_with('\r')) in.fail("its lines end in CR LF, and a plan's in LF alone");
    in.fail("is of another version than " + std::string(kVersion));
  }
  in.begin_line("geometry");
  plan.geometry = in.hash();
  in.end_line();
  in.begin_line("scene");
  plan.scene = in.rest();
  if (std::any_of(plan.scene.begin(), plan.scene.end(), is_control)) {
    in.fail("the scene's name has a control character");
  }
  in.begin_line("seed");
  plan.seed = in.count(std::numeric_limits<std::uint64_t>::max());
  in.end_line();
  for (const auto& [name, value] :
       {std::pair<std::string_view, double*>{"tolerance", &plan.tolerance_m},
        {"contact", &plan.contact_m},
        {"length", &plan.length_m}}) {
    in.begin_line(name);
    *value = in.number(kMostPlanPlace_m);
    if (!(*value > 0)) in.fail("the " + std::string(name) + " is not positive");
    in.end_line();
  }
  read_poses(in, plan);
  read_planes(in, plan);
  read_stations(in, plan);
  in.begin_line("end");
  const std::uint64_t stated = in.hash();
  in.end_line();
  if (stated != text_hash(text.substr(0, in.line_begin()))) {
    in.fail("the file is not what was written: its hash differs");
  }
  if (!in.at_end()) in.fail("has more behind its end");
  return plan;
}

Plan read_plan(const std::string& path) {
  return parse_plan(read_text_file(path, kMostPlanBytes, "the plan"), path);
}

}  // namespace haptic::tools
