// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Rows of a table that takes long, kept in a file as each is done: a run that is interrupted goes
/// on where it ended.
///
/// The file: a line with what decides the rows, then a line per row: its key, and its numbers.

#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace haptic::sim {

class KeptRows {
 public:
  /// `about`: all options that decide a number, on one line. An empty path keeps nothing. `resume`:
  /// the rows of a file that is there count as done. @throws InputError the file is of other
  /// options, or is none of this form.
  KeptRows(std::string path, std::string about, bool resume);

  /// The numbers of a row that is done; null: it is not.
  [[nodiscard]] const std::vector<double>* find(const std::string& key) const;
  /// Adds a row and replaces the file by one that has it, at once. Any thread. The key has no comma
  /// and no end of a line. @throws OsError it cannot be written.
  void keep(const std::string& key, const std::vector<double>& numbers);

 private:
  std::string path_, text_;
  std::map<std::string, std::vector<double>> done_;  ///< rows of the file as it was read
  std::mutex mutex_;
};

}  // namespace haptic::sim
