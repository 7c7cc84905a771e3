// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/motion_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "host_sim/motion_log/log_clock.hpp"
#include "host_sim/motion_log/log_number.hpp"
#include "host_sim/motion_log/log_rows.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

// Lengths that differ from 1 by more are told.
constexpr double kToldRounding = 1e-6;
constexpr double kNanosecondsOfSecond = 1e9;
// Beyond it a position is none, and its square no number.
constexpr double kMostPosition_m = 1e9;

std::string cell_name(const LogRows& log, std::size_t column) {
  return column < log.names().size() ? "column " + log.names()[column].substr(0, 60)
                                     : "column " + std::to_string(column + 1);
}

[[noreturn]] void refuse_cell(const LogRows& log, std::size_t column) {
  const std::string_view cell = log.cells()[column];
  std::string defect = cell_name(log, column);
  if (cell.empty()) {
    defect += " is empty; complete or remove the sample";
  } else if (is_not_finite_word(cell)) {
    defect += " is " + std::string(cell) + "; drop or complete the sample";
  } else {
    defect += " is '" + std::string(cell.substr(0, 40)) +
              "', no number in range; write it as 0.001 or 1e-3";
  }
  log.refuse(defect);
}

double number_at(const LogRows& log, std::size_t column) {
  const std::optional<double> value = log_number(log.cells()[column], log.has_decimal_commas());
  if (!value) refuse_cell(log, column);
  return *value;
}

LogTime time_at(const LogRows& log, const LogColumns& columns) {
  std::optional<LogTime> time = log_time(log.cells()[columns.time], log.has_decimal_commas());
  if (!time) {
    const std::string_view cell = log.cells()[columns.time];
    const bool date = cell.find_first_of("T:") != std::string_view::npos && cell.size() > 7;
    if (date) {
      log.refuse(cell_name(log, columns.time) + " is a date or a time of day, '" +
                 std::string(cell.substr(0, 40)) +
                 "'; write times as seconds, or leave them out with --rows-hz RATE");
    }
    refuse_cell(log, columns.time);
  }
  if (columns.nanoseconds != kNoColumn) {
    const double nanoseconds = number_at(log, columns.nanoseconds);
    if (nanoseconds < 0 || nanoseconds >= kNanosecondsOfSecond) {
      log.refuse(cell_name(log, columns.nanoseconds) +
                 " is not within a second; name the times with --columns t=NAME");
    }
    time->part += nanoseconds / kNanosecondsOfSecond;
  }
  return *time;
}

void take_position(const LogRows& log, const LogColumns& columns, MotionSample& sample) {
  for (std::size_t k = 0; k < 3; ++k) {
    sample.p[k] = columns.unit_m * number_at(log, columns.position[k]);
    if (std::abs(sample.p[k]) > kMostPosition_m) {
      log.refuse(cell_name(log, columns.position[k]) +
                 " is no place on Earth; drop the sample, or correct the unit");
    }
  }
}

class LogReader {
 public:
  explicit LogReader(const LogOptions& options) : options_(options), rows_(open_log(options.path)) {
    log_.path = options.path;
    log_.form = rows_->form();
    log_.columns = find_columns(*rows_, options);
  }

  MotionLog read() {
    while (rows_->next()) take_row();
    if (log_.samples.size() < 2) {
      throw tools::InputError(options_.path + ": holds " + std::to_string(log_.samples.size()) +
                              " samples; a motion has two at least");
    }
    take_times();
    return std::move(log_);
  }

 private:
  void take_row() {
    require_width();
    const LogColumns& columns = log_.columns;
    MotionSample sample;
    if (columns.time != kNoColumn) times_.push_back(time_at(*rows_, columns));
    take_position(*rows_, columns, sample);
    take_quaternion(sample);
    log_.samples.push_back(sample);
    log_.lines.push_back(rows_->line());
  }

  // 3 x 4 or 4 x 4 numbers, perhaps behind a time.
  [[nodiscard]] bool is_matrix_row(std::size_t width) const {
    return rows_->names().empty() && (width == 12 || width == 13 || width == 16 || width == 17);
  }

  void require_width() {
    const std::size_t width = rows_->cells().size(), wanted = log_.columns.row_cells;
    if (wanted != 0 ? width == wanted : width >= log_.columns.count()) return;
    rows_->refuse("has " + std::to_string(width) + " numbers where " +
                  std::to_string(wanted != 0 ? wanted : log_.columns.count()) + " are expected; " +
                  (is_matrix_row(width)
                       ? "matrices are not read, convert them to quaternions (KITTI's files have "
                         "no times either: add them)"
                       : "name all columns in their order with --columns, as "
                         "t,x,y,z,qx,qy,qz,qw"));
  }

  void take_quaternion(MotionSample& sample) {
    const std::array<std::size_t, 4>& at = log_.columns.quaternion_wxyz;
    double square = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      sample.q_wxyz[k] = number_at(*rows_, at[k]);
      square += sample.q_wxyz[k] * sample.q_wxyz[k];
    }
    const double length = std::sqrt(square);
    if (!(std::abs(length - 1) <= kLogQuaternionTolerance)) {
      rows_->refuse("the quaternion " + log_.columns.quaternion_text + " has length " +
                    tools::short_number(length, 5) +
                    ", not 1; drop the sample, or name the right columns with --columns");
    }
    log_.normalised += std::abs(length - 1) > kToldRounding ? 1U : 0U;
    if (std::abs(length - 1) > std::abs(log_.worst_length - 1)) log_.worst_length = length;
    double dot = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      sample.q_wxyz[k] /= length;
      if (!log_.samples.empty()) dot += sample.q_wxyz[k] * log_.samples.back().q_wxyz[k];
    }
    // The same turn, on the side of the sample before.
    const bool other_side = dot < 0;
    if (other_side)
      for (double& x : sample.q_wxyz) x = -x;
    log_.turned += other_side != other_side_ ? 1U : 0U;
    other_side_ = other_side;
  }

  void take_times() {
    if (log_.columns.time == kNoColumn) {
      log_.clock = "counted, " + tools::short_number(*options_.rows_hz, 6) + " rows a second";
      for (std::size_t k = 0; k < log_.samples.size(); ++k)
        log_.samples[k].t_s = static_cast<double>(k) / *options_.rows_hz;
      return;
    }
    const LogClock clock = clock_of(options_.path, times_, log_.lines, log_.columns, options_);
    log_.clock = clock.text;
    for (std::size_t k = 0; k < log_.samples.size(); ++k) log_.samples[k].t_s = clock.t_s[k];
  }

  const LogOptions& options_;
  std::unique_ptr<LogRows> rows_;
  std::vector<LogTime> times_;
  bool other_side_ = false;
  MotionLog log_;
};

}  // namespace

MotionLog read_motion_log(const LogOptions& options) { return LogReader(options).read(); }

}  // namespace haptic::sim
