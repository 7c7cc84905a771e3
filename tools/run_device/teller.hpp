// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Lines for people and programs, and files, written by threads of their own: who does not read, or
/// has gone, holds up nobody. A queue that is full drops its oldest line and says how many.

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace haptic::tools {

enum class Stream : std::uint8_t { kOut = 0, kError, kFiles, kCount };

/// How much a line matters to the journal: as in sd-daemon(3).
enum class LineLevel : std::uint8_t { kError = 3, kWarning = 4, kNotice = 5, kPlain = 8 };

/// Owner: any one thread; makes its own, so not before the last fork. A stream whose reader has
/// gone (EPIPE) or that cannot be written to is left alone from then on.
class Teller {
 public:
  static constexpr std::size_t kMostLines = 256;
  static constexpr int kLongestFinish_ms = 2000;

  Teller();
  ~Teller();  ///< as `finish`
  Teller(const Teller&) = delete;
  Teller& operator=(const Teller&) = delete;

  /// One line or several, without the last line's end, to kOut or kError. Never waits for a reader.
  /// On a journal's standard error (JOURNAL_STREAM) each line begins with its level, "<4>".
  void say(Stream stream, const std::string& text, LineLevel level = LineLevel::kPlain);
  /// A file, whole or not at all; what refuses it is said on standard error.
  void write_file(const std::filesystem::path& path, const std::string& content);

  /// Writes what is still unwritten, as far as the readers take it within kLongestFinish_ms; a
  /// reader that does not read misses the rest. @return true if all of standard output was written,
  /// or its reader has gone.
  bool finish();

 private:
  static constexpr std::size_t kStreams = static_cast<std::size_t>(Stream::kCount);
  struct Item {
    std::string text;
    std::filesystem::path path;  ///< kFiles
  };
  struct Queue {
    std::deque<Item> items;
    std::uint64_t dropped = 0;
    bool idle = false;
    int error = 0;  ///< errno of the write that failed
  };
  /// Shared with the threads, one of which may outlive this object in a write that nobody takes.
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;  ///< more to write, or the end
    std::condition_variable written;  ///< a queue is empty
    std::array<Queue, kStreams> queues;
    bool ending = false;
  };
  static void write_items(const std::shared_ptr<Shared>& shared, Stream stream);
  static void add(Shared& shared, Stream stream, Item item);

  std::shared_ptr<Shared> shared_;
  std::array<std::thread, kStreams> threads_;
  bool journal_ = false;
};

}  // namespace haptic::tools
