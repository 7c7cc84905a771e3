// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/log_columns.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "host_sim/motion_log/axis_groups.hpp"
#include "host_sim/motion_log/column_name.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

class ColumnSearch {
 public:
  ColumnSearch(const LogRows& log, const LogOptions& options) : log_(log), options_(options) {
    shown_ = log.names();
    std::vector<std::string> names = log.names();
    name_array(names);
    rename(names);
    for (const std::string& name : names) names_.push_back(column_name(name));
  }

  LogColumns find() {
    if (names_.empty())
      take_plain();
    else
      take_named();
    if (options_.unit_m) {
      found_.unit_m = *options_.unit_m;
      found_.unit_told = true;
    }
    return found_;
  }

 private:
  [[noreturn]] void refuse(const std::string& defect) const {
    throw tools::InputError(log_.path() + ": " + defect);
  }

  // Advice about columns that are not found, with those that there are.
  [[nodiscard]] std::string fix() const {
    std::string names;
    constexpr std::size_t kMostShown = 16;
    for (std::size_t k = 0; k < std::min(shown_.size(), kMostShown); ++k)
      names += (k > 0 ? ", " : "") + shown_[k].substr(0, 60);
    if (shown_.size() > kMostShown) names += ", ..";
    return "name them, as --columns t=STAMP,x=A,y=B,z=C,qw=D,qx=E,qy=F,qz=G (the file has: " +
           names + ")";
  }

  // The elements of the array --key get the names of a pose.
  void name_array(std::vector<std::string>& names) {
    if (options_.key.empty()) {
      return;
    }
    if (!options_.order && options_.columns.empty()) {
      refuse("--key " + options_.key +
             " leaves open in which order its quaternion stands; add --order xyzw or --order wxyz");
    }
    const bool xyzw = options_.order == QuaternionOrder::kXyzw;
    std::vector<std::string> elements = {"x", "y", "z"};
    for (const char axis : std::string_view(xyzw ? "xyzw" : "wxyz"))
      elements.push_back(std::string("q") + axis);
    if (!options_.columns.empty()) elements = options_.columns;
    for (std::size_t k = 0; k < elements.size(); ++k) {
      const std::string member = options_.key + "." + std::to_string(k);
      const auto at = std::find(names.begin(), names.end(), member);
      if (at == names.end()) {
        refuse("has no member " + member + "; --key names an array of at least " +
               std::to_string(elements.size()) + " numbers");
      }
      *at = elements[k];
    }
  }

  void rename(std::vector<std::string>& names) {
    if (options_.columns.empty() || !options_.key.empty()) return;
    if (options_.columns.front().find('=') == std::string::npos) {
      if (!names.empty() && names.size() != options_.columns.size()) {
        refuse("has " + std::to_string(names.size()) + " columns, --columns names " +
               std::to_string(options_.columns.size()) + "; name all, or as x=NAME those in use");
      }
      names = options_.columns;
      found_.row_cells = names.size();
      if (shown_.empty()) shown_ = names;
      return;
    }
    std::vector<std::string> renamed(names.size());
    for (const std::string& pair : options_.columns) {
      const std::size_t equals = pair.find('=');
      if (equals == std::string::npos)
        throw tools::UsageError("--columns: '" + pair + "' is no pair; write x=NAME");
      const std::string ours = pair.substr(0, equals), theirs = pair.substr(equals + 1);
      const auto at = std::find(names.begin(), names.end(), theirs);
      if (at == names.end()) refuse("has no column '" + theirs + "'; " + fix());
      std::string& name = renamed[static_cast<std::size_t>(at - names.begin())];
      if (!name.empty())
        throw tools::UsageError("--columns: '" + theirs + "' is named twice; write each once");
      const std::string unit = column_name(theirs).unit;
      name = column_name(ours).unit.empty() && !unit.empty() ? ours + " [" + unit + "]" : ours;
      // Another column of the name gives way.
      for (std::size_t k = 0; k < names.size(); ++k) {
        if (renamed[k].empty() && column_name(names[k]).whole == column_name(ours).whole)
          names[k].clear();
      }
    }
    for (std::size_t k = 0; k < names.size(); ++k)
      if (!renamed[k].empty()) names[k] = renamed[k];
  }

  [[nodiscard]] std::string shown(std::span<const std::size_t> columns) const {
    std::string text;
    for (const std::size_t k : columns) {
      if (!text.empty()) text += ", ";
      text += k < shown_.size() ? shown_[k] : "column " + std::to_string(k + 1);
    }
    return text;
  }

  // t, x, y, z and a quaternion, without names.
  void take_plain() {
    const std::size_t first = options_.rows_hz ? 0 : 1;
    if (!log_.is_plain() && !options_.order) {
      refuse(
          "has no line of names, so the order of its quaternion is open; add --order xyzw or "
          "--order wxyz for rows of t, x, y, z and a quaternion, or name all columns, as --columns "
          "t,x,y,z,qx,qy,qz,qw");
    }
    // TUM's trajectories: blanks, and w last.
    found_.order = options_.order.value_or(QuaternionOrder::kXyzw);
    if (first == 1) {
      found_.time = 0;
      found_.time_text = "column 1";
    }
    for (std::size_t k = 0; k < 3; ++k) found_.position[k] = first + k;
    const std::size_t w = *found_.order == QuaternionOrder::kXyzw ? 3 : 0;
    const std::size_t x = *found_.order == QuaternionOrder::kXyzw ? 0 : 1;
    found_.quaternion_wxyz = {first + 3 + w, first + 3 + x, first + 4 + x, first + 5 + x};
    found_.position_text = shown(found_.position);
    found_.quaternion_text = shown(found_.quaternion_wxyz);
    found_.row_cells = first + 7;
  }

  void take_named() {
    std::vector<AxisGroup> positions = axis_groups(names_, kPlaceAxes, &position_rank);
    std::vector<AxisGroup> turns = axis_groups(names_, kTurnAxes, &quaternion_rank);
    take_bare_quaternion(positions, turns);
    leave_out_torques(positions);
    if (positions.empty()) positions = named_by(turns);
    if (positions.empty()) refuse("no position among the columns; " + whole_fix());
    const AxisGroup& position = the_one(positions, "positions");
    if (turns.empty()) refuse("no quaternion among the columns; " + whole_fix());
    // If there are several, the one of the same pose.
    const std::string owner = owner_of(position.stem);
    const bool shared = std::any_of(turns.begin(), turns.end(), [&](const AxisGroup& turn) {
      return owner_of(turn.stem) == owner;
    });
    if (shared)
      std::erase_if(turns, [&](const AxisGroup& turn) { return owner_of(turn.stem) != owner; });
    take_position(position);
    take_quaternion(the_one(turns, "quaternions"));
    take_time();
  }

  // x, y, z and w alone beside places of another name: the quaternion.
  void take_bare_quaternion(std::vector<AxisGroup>& positions,
                            std::vector<AxisGroup>& turns) const {
    if (!turns.empty() || positions.size() < 2) return;
    turns = axis_groups(names_, kTurnAxes, [](std::string_view stem) {
      return stem.empty() ? std::optional<int>(0) : std::nullopt;
    });
    if (turns.empty()) return;
    std::erase_if(positions, [](const AxisGroup& group) { return group.stem.empty(); });
  }

  // tx, ty, tz beside fx, fy, fz are torques.
  void leave_out_torques(std::vector<AxisGroup>& positions) const {
    const auto is_force = [](std::string_view stem) {
      return stem == "f" || stem.ends_with("force") ? std::optional<int>(0) : std::nullopt;
    };
    if (axis_groups(names_, kPlaceAxes, is_force).empty()) return;
    std::erase_if(positions, [](const AxisGroup& group) { return group.stem == "t"; });
  }

  // Places of any name, as tcp_x or tcp_px, that a quaternion has too, as tcp_qx.
  [[nodiscard]] std::vector<AxisGroup> named_by(const std::vector<AxisGroup>& turns) const {
    std::vector<AxisGroup> groups =
        axis_groups(names_, kPlaceAxes, [](std::string_view) { return std::optional<int>(0); });
    std::erase_if(groups, [&](const AxisGroup& group) {
      return group.numbered || std::none_of(turns.begin(), turns.end(), [&](const AxisGroup& turn) {
               const std::string owner = owner_of(turn.stem);
               return turn.stem != group.stem && (owner == group.stem || owner + "p" == group.stem);
             });
    });
    return groups;
  }

  [[nodiscard]] std::string whole_fix() const {
    const bool arrays = std::any_of(names_.begin(), names_.end(),
                                    [](const ColumnName& name) { return name.axis == '6'; });
    return (arrays ? "of an array say --key NAME --order xyzw or wxyz; " : "") +
           std::string(
               "Euler angles, rotation vectors and matrices are not read, convert them to "
               "quaternions; else ") +
           fix();
  }

  // @throws where the best two are as likely.
  [[nodiscard]] const AxisGroup& the_one(const std::vector<AxisGroup>& groups,
                                         const std::string& what) const {
    const AxisGroup& best = groups.front();
    if (best.twice)
      refuse("two columns have the name of one of " + shown(best.columns) + "; " + fix());
    if (groups.size() > 1 && groups[1].rank == best.rank) {
      refuse("holds several " + what + ": " + shown(best.columns) + " and " +
             shown(groups[1].columns) + "; " + fix());
    }
    return best;
  }

  void take_position(const AxisGroup& group) {
    std::copy_n(group.columns.begin(), 3, found_.position.begin());
    found_.position_text = shown(group.columns);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string& unit = names_[group.columns[k]].unit;
      if (unit.empty()) {
        if (k > 0 && found_.unit_told) refuse("a unit stands at some of " + mixed_units());
        continue;
      }
      const std::optional<double> metres = length_unit_m(unit);
      if (!metres) {
        refuse("column " + shown({&group.columns[k], 1}) + " is in '" + unit +
               "'; give positions in m, cm, mm or um");
      }
      if (k > 0 && (!found_.unit_told || found_.unit_m != *metres))
        refuse("units differ among " + mixed_units());
      found_.unit_m = *metres;
      found_.unit_told = true;
    }
    take_stated_unit();
    if (options_.unit_m && found_.unit_told && found_.unit_m != *options_.unit_m) {
      throw tools::UsageError("--unit: another unit than the file states for " +
                              found_.position_text + "; leave it out");
    }
  }
  // A line above the names states one for all lengths.
  void take_stated_unit() {
    if (found_.unit_told || log_.length_unit().empty()) return;
    const std::optional<double> metres = length_unit_m(log_.length_unit());
    if (!metres) {
      refuse("its lengths are in '" + log_.length_unit() + "'; give positions in m, cm, mm or um");
    }
    found_.unit_m = *metres;
    found_.unit_told = true;
  }
  [[nodiscard]] std::string mixed_units() const {
    return found_.position_text + "; give all three in one unit";
  }

  void take_quaternion(const AxisGroup& group) {
    std::vector<std::size_t> sorted = group.columns;
    std::sort(sorted.begin(), sorted.end());
    std::array<std::size_t, 4> wxyz{};
    std::copy_n(group.columns.begin(), 4, wxyz.begin());
    if (group.numbered && !options_.order) {
      refuse("numbers leave open the order of the quaternion " + shown(group.columns) +
             "; add --order xyzw or --order wxyz");
    }
    if (options_.order) {  // by their places in the file, not by their names
      const auto* at = sorted.data();
      wxyz = *options_.order == QuaternionOrder::kXyzw
                 ? std::array<std::size_t, 4>{at[3], at[0], at[1], at[2]}
                 : std::array<std::size_t, 4>{at[0], at[1], at[2], at[3]};
    }
    const bool vector_sorted = wxyz[1] < wxyz[2] && wxyz[2] < wxyz[3];
    if (vector_sorted && wxyz[0] < wxyz[1]) found_.order = QuaternionOrder::kWxyz;
    if (vector_sorted && wxyz[0] > wxyz[3]) found_.order = QuaternionOrder::kXyzw;
    found_.quaternion_wxyz = wxyz;
    found_.quaternion_text = shown(wxyz);
  }

  void take_time() {
    if (options_.rows_hz) return;
    if (take_seconds_and_nanoseconds("headerstamp")) return;
    std::optional<TimeName> best;
    for (std::size_t k = 0; k < names_.size(); ++k) {
      const std::optional<TimeName> time = time_name(names_[k]);
      if (!time || (best && time->rank >= best->rank)) continue;
      best = time;
      found_.time = k;
    }
    const bool sure = best && best->rank == 0;
    if (!sure && take_seconds_and_nanoseconds("")) return;
    if (!best)
      refuse("no time among the columns; say --rows-hz RATE where there is none, else " + fix());
    found_.time_text = shown({&found_.time, 1});
    if (best->unit.empty()) return;
    found_.time_unit_s = time_unit_s(best->unit);
    if (!found_.time_unit_s) {
      refuse("column " + found_.time_text + " is in '" + best->unit +
             "'; give times in s, ms, us or ns");
    }
  }

  // Whole seconds and nanoseconds in two columns whose names end alike.
  bool take_seconds_and_nanoseconds(std::string_view before) {
    using Ends = std::pair<std::string_view, std::string_view>;
    static constexpr std::array<Ends, 5> kEnds = {{{"sec", "nanosec"},
                                                   {"secs", "nsecs"},
                                                   {"sec", "nsec"},
                                                   {"secs", "nanosecs"},
                                                   {"seconds", "nanoseconds"}}};
    for (const auto& [seconds, nanoseconds] : kEnds) {
      for (std::size_t k = 0; k < names_.size(); ++k) {
        const std::string& whole = names_[k].whole;
        if (!whole.ends_with(nanoseconds)) continue;
        const std::string stem = whole.substr(0, whole.size() - nanoseconds.size());
        if (!stem.ends_with(before)) continue;
        for (std::size_t j = 0; j < names_.size(); ++j) {
          if (names_[j].whole != stem + std::string(seconds)) continue;
          found_.time = j;
          found_.nanoseconds = k;
          found_.time_unit_s = 1;
          const std::array<std::size_t, 2> both = {j, k};
          found_.time_text = shown(both);
          return true;
        }
      }
    }
    return false;
  }

  const LogRows& log_;
  const LogOptions& options_;
  std::vector<std::string> shown_;
  std::vector<ColumnName> names_;
  LogColumns found_;
};

}  // namespace

std::size_t LogColumns::count() const {
  std::size_t most = 0;
  for (const std::size_t k : position) most = std::max(most, k);
  for (const std::size_t k : quaternion_wxyz) most = std::max(most, k);
  if (time != kNoColumn) most = std::max(most, time);
  if (nanoseconds != kNoColumn) most = std::max(most, nanoseconds);
  return most + 1;
}

LogColumns find_columns(const LogRows& log, const LogOptions& options) {
  return ColumnSearch(log, options).find();
}

bool holds_pose(std::span<const std::string> names) {
  std::vector<ColumnName> read;
  for (const std::string& name : names) read.push_back(column_name(name));
  return !axis_groups(read, kPlaceAxes, &position_rank).empty() &&
         !axis_groups(read, kTurnAxes, &quaternion_rank).empty();
}

}  // namespace haptic::sim
