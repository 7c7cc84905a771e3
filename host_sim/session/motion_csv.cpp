// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/motion_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <span>
#include <string_view>
#include <system_error>

#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

constexpr std::string_view kHeader = "t,x,y,z,qw,qx,qy,qz";
constexpr std::array<std::string_view, 8> kColumns = {"t", "x", "y", "z", "qw", "qx", "qy", "qz"};

// A recorder's clock wanders within a period; the rate on the whole is the servo loop's.
constexpr double kTick_s = 1e-3, kLeastStep_s = 0.1e-3, kMostStep_s = 3e-3, kRateTolerance = 0.02;
// Faster than any hand.
constexpr double kFarthestJump_m = 0.5;

std::string shown(double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                          std::chars_format::general, 4);
  return {buffer.data(), error == std::errc() ? end : buffer.data()};
}

[[noreturn]] void refuse(const std::string& path, std::size_t line, const std::string& defect) {
  throw tools::InputError(path + ":" + std::to_string(line) + ": " + defect);
}

std::string read_whole_file(const std::string& path) {
  tools::note_input(path, "the motion");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw tools::InputError(path + ": cannot be opened; check the path and its permissions");
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) throw tools::InputError(path + ": reading failed; check the medium");
  return text;
}

std::string import_fix(const std::string& path) {
  return "'host_sim motion --from " + path + " -o motion.csv'";
}

// Guess what a file with another first line is, and what to do with it.
std::string header_fix(const std::string& path, std::string_view header) {
  if (path.ends_with(".toml"))
    return "this is a script: make the motion from it with 'host_sim motion " + path +
           " --out motion.csv'";
  if (header.substr(0, 7) == "RTSCENE") return "this is a compiled scene: give it as --scene";
  if (header.find('\0') != std::string_view::npos) return "save the file as UTF-8 text";
  for (const std::string_view mesh : {".stl", ".obj", ".off", ".ply", ".step", ".3mf"}) {
    if (path.ends_with(mesh)) return "this is a mesh, no motion";
  }
  if (header.find_first_not_of("0123456789.,;+-eE \t") == std::string_view::npos)
    return "it has no line of names: write that line above the numbers if they are these columns, "
           "or "
           "say which they are with 'host_sim motion --from " +
           path + " --columns ..'";
  const std::string import = "make a motion of other columns with " + import_fix(path);
  if (header.find(';') != std::string_view::npos || header.find('\t') != std::string_view::npos)
    return "separate the columns by commas, and write numbers with a point, or " + import;
  return import;
}

// Cuts the next line off `rest`, without its line end: LF, CR LF, or CR in a file without LF.
std::string_view take_line(std::string_view& rest, char line_end) {
  const std::size_t end = rest.find(line_end);
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::array<double, 8> parse_line(const std::string& path, std::size_t number,
                                 std::string_view line) {
  std::array<double, 8> values{};
  const char* at = line.data();
  const char* const end = line.data() + line.size();
  for (std::size_t column = 0; column < values.size(); ++column) {
    const std::string name(kColumns[column]);
    if (column > 0) {
      if (at == end)
        refuse(path, number, "the line ends before column " + name + "; give 8 numbers");
      if (*at != ',') {
        refuse(path, number,
               "no comma before column " + name + "; separate 8 plain numbers by commas");
      }
      ++at;
    }
    const auto [next, error] = std::from_chars(at, end, values[column]);
    if (error == std::errc::result_out_of_range) {
      refuse(path, number, "column " + name + " is out of range of a double");
    }
    if (error != std::errc()) {
      refuse(path, number, "column " + name + " is not a number; write it as 0.001 or 1e-3");
    }
    if (!std::isfinite(values[column])) {
      refuse(path, number, "column " + name + " is not finite; drop or fix the sample");
    }
    at = next;
  }
  if (at != end)
    refuse(path, number, "text after column qz; give 8 numbers, with a point before the decimals");
  return values;
}

MotionSample make_sample(const std::string& path, std::size_t number,
                         const std::array<double, 8>& values) {
  MotionSample sample;
  sample.t_s = values[0];
  for (std::size_t i = 0; i < 3; ++i) sample.p[i] = values[1 + i];
  double square = 0.0;
  for (std::size_t i = 0; i < 4; ++i) square += values[4 + i] * values[4 + i];
  const double length = std::sqrt(square);
  if (!(std::abs(length - 1.0) <= kMotionQuaternionTolerance)) {
    refuse(path, number,
           "the quaternion has length " + std::to_string(length) +
               ", not 1; normalise it (order: qw,qx,qy,qz)");
  }
  for (std::size_t i = 0; i < 4; ++i) sample.q_wxyz[i] = values[4 + i] / length;
  return sample;
}

/// Times that a sample is written and read until its digits stay.
constexpr int kMostTurns = 16;

void append_fixed(std::string& text, double value, int digits) {
  // Longest: 309 digits before the point.
  std::array<char, 340> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                          std::chars_format::fixed, digits);
  if (error == std::errc()) text += tools::unsigned_zero(std::string(buffer.data(), end));
}

/// A line of the file, without its end.
void append_sample(std::string& text, const MotionSample& sample) {
  append_fixed(text, sample.t_s, 6);
  for (const double component : sample.p) {
    text += ',';
    append_fixed(text, component, 9);
  }
  for (const double component : sample.q_wxyz) {
    text += ',';
    append_fixed(text, component, 12);
  }
}

}  // namespace

std::vector<MotionSample> as_written(const std::vector<MotionSample>& motion) {
  std::vector<MotionSample> written;
  written.reserve(motion.size());
  std::string line;
  const auto read_back = [&](const MotionSample& sample) {
    line.clear();
    append_sample(line, sample);
    return make_sample("the motion", written.size() + 1,
                       parse_line("the motion", written.size() + 1, line));
  };
  for (const MotionSample& sample : motion) {
    MotionSample read = read_back(sample);
    // A quaternion brought to unit length may round to other digits than those that it was read
    // from. Each turn brings its digits nearer to unit length, so few turns suffice.
    for (int turn = 0; turn < kMostTurns; ++turn) {
      const MotionSample again = read_back(read);
      if (std::ranges::equal(again.q_wxyz, read.q_wxyz)) break;
      read = again;
    }
    written.push_back(read);
  }
  return written;
}

std::vector<MotionSample> read_motion_csv(const std::string& path) {
  const std::string text = read_whole_file(path);
  std::string_view rest = text;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    rest.remove_prefix(kByteOrderMark.size());
  }
  // Blank lines at the end are harmless; anywhere else they would hide a cut file.
  const std::size_t last = rest.find_last_not_of("\r\n");
  rest = rest.substr(0, last == std::string_view::npos ? 0 : last + 1);
  if (rest.empty())
    throw tools::InputError(path + ": is empty; the first line must be " + std::string(kHeader));

  const char line_end = rest.find('\n') == std::string_view::npos ? '\r' : '\n';
  std::size_t number = 1;
  if (const std::string_view header = take_line(rest, line_end); header != kHeader) {
    refuse(path, number,
           "the header is not " + std::string(kHeader) + "; " + header_fix(path, header));
  }
  std::vector<MotionSample> motion;
  constexpr std::size_t kTypicalLineBytes = 90;
  motion.reserve(rest.size() / kTypicalLineBytes + 1);
  while (!rest.empty()) {
    ++number;
    const std::string_view line = take_line(rest, line_end);
    if (line.empty()) refuse(path, number, "the line is blank; remove it");
    const MotionSample sample = make_sample(path, number, parse_line(path, number, line));
    if (!motion.empty() && !(sample.t_s > motion.back().t_s)) {
      refuse(path, number, "the time does not increase; sort the samples and drop repeated ones");
    }
    motion.push_back(sample);
  }
  if (motion.empty()) refuse(path, number, "no sample follows the header");
  return motion;
}

std::vector<MotionSample> read_played_motion(const std::string& path) {
  std::vector<MotionSample> motion = read_motion_csv(path);
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const std::size_t line = k + 2;
    const auto& p = motion[k].p;
    if (std::hypot(p[0], p[1], p[2]) > kFarthestMotion_m) {
      refuse(path, line,
             "the part is " + shown(std::hypot(p[0], p[1], p[2])) +
                 " m from the origin; positions are in metres: are these millimetres?");
    }
    if (k == 0) continue;
    const auto& before = motion[k - 1].p;
    const double step_s = motion[k].t_s - motion[k - 1].t_s;
    const double jump_m = std::hypot(p[0] - before[0], p[1] - before[1], p[2] - before[2]);
    if (step_s < kLeastStep_s || step_s > kMostStep_s) {
      refuse(path, line,
             shown(1e3 * step_s) +
                 " ms after the sample before; a motion has one sample in each millisecond, with "
                 "times in seconds" +
                 (std::abs(step_s - 1.0) < 0.01 ? " (are these milliseconds?)" : "") +
                 ": resample it with " + import_fix(path));
    }
    if (jump_m > kFarthestJump_m) {
      refuse(
          path, line,
          "the part jumps by " + shown(jump_m) +
              " m within a millisecond; no hand does: remove the sample, or cut the motion there");
    }
  }
  const double mean_s = motion.size() < 2 ? kTick_s
                                          : (motion.back().t_s - motion.front().t_s) /
                                                static_cast<double>(motion.size() - 1);
  if (std::abs(mean_s - kTick_s) > kRateTolerance * kTick_s) {
    throw tools::InputError(
        path + ": has a sample every " + shown(1e3 * mean_s) +
        " ms; a motion is played at one in each millisecond: resample it with " + import_fix(path));
  }
  return motion;
}

std::string motion_csv(const std::vector<MotionSample>& motion) {
  std::string text(kHeader);
  text += '\n';
  for (const MotionSample& sample : motion) {
    append_sample(text, sample);
    text += '\n';
  }
  return text;
}

void write_motion_csv(const std::string& path, const std::vector<MotionSample>& motion) {
  const std::string text = motion_csv(motion);
  tools::write_files({{path, std::as_bytes(std::span(text))}});
}

}  // namespace haptic::sim
