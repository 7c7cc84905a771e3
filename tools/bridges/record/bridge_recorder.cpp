// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/record/bridge_recorder.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

constexpr std::int64_t kLook_ns = 5'000'000;
constexpr std::size_t kBlock_bytes = 256 * 1024;

std::string text_of(int error) { return std::generic_category().message(error); }

/// A recording, or a file without content.
bool may_be_replaced(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return true;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::ifstream stream(path, std::ios::binary);
  std::array<char, kRecordingMagic.size()> magic{};
  stream.read(magic.data(), magic.size());
  const std::string_view found(magic.data(), static_cast<std::size_t>(stream.gcount()));
  return found.empty() || found == kRecordingMagic;
}

/// A bridge that has ended is started again, and its recording is the one that is wanted most.
void keep_the_one_before(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return;
  std::filesystem::path kept = path;
  kept += ".1";
  for (const auto& each : {path, kept}) {
    if (!may_be_replaced(each))
      throw UsageError(each.string() +
                       ": --record would overwrite a file that is no recording; give another name");
  }
  std::filesystem::rename(path, kept, error);
  if (error) throw OsError(path.string() + ": cannot be kept as FILE.1: " + error.message());
}

int open_file(const std::filesystem::path& path) {
  keep_the_one_before(path);
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0600);
  if (fd < 0) throw OsError(path.string() + ": cannot be written: " + text_of(errno));
  return fd;
}

}  // namespace

BridgeRecorder::BridgeRecorder(RecorderSettings settings)
    : settings_(std::move(settings)), fd_(open_file(settings_.path)) {
  ring_.resize(std::bit_ceil(settings_.waiting_bytes) / sizeof(std::uint64_t));
  const auto magic = std::as_bytes(std::span(kRecordingMagic));
  out_.reserve(kBlock_bytes + kMostEntry_bytes);
  out_.assign(magic.begin(), magic.end());
  // Signals are the program's own. A file that may not grow sends one too, to this thread.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

BridgeRecorder::~BridgeRecorder() {
  is_over_.store(true);
  thread_.join();
  ::close(fd_);
}

void BridgeRecorder::stop_at(RecordingEnd why) noexcept {
  if (keeps_.exchange(false)) end_.store(why);
}

void BridgeRecorder::copy_in(std::uint64_t& at, std::span<const std::byte> bytes) noexcept {
  auto* const ring = reinterpret_cast<std::byte*>(ring_.data());
  const std::size_t size = ring_.size() * sizeof(std::uint64_t);
  const std::size_t begin = at & (size - 1), first = std::min(bytes.size(), size - begin);
  if (first > 0) std::memcpy(ring + begin, bytes.data(), first);
  if (bytes.size() > first) std::memcpy(ring, bytes.data() + first, bytes.size() - first);
  at += bytes.size();
}

void BridgeRecorder::note(hal::TapKind kind, std::int64_t result, std::span<const std::byte> sent,
                          std::span<const std::byte> received) noexcept {
  if (!keeps_.load(std::memory_order_relaxed)) return;
  if (kLeastEntry_bytes + sent.size() + received.size() > kMostEntry_bytes)
    return stop_at(RecordingEnd::kTooLong);
  const std::size_t bytes = kEntryHead_bytes + sent.size() + received.size();
  const std::uint64_t words = 1 + (bytes + 7) / 8;
  std::uint64_t from = head_.load(std::memory_order_relaxed);
  do {
    if (from + words - tail_.load(std::memory_order_acquire) > ring_.size())
      return stop_at(RecordingEnd::kSlow);
  } while (!head_.compare_exchange_weak(from, from + words, std::memory_order_relaxed));
  std::array<std::byte, kEntryHead_bytes> head;
  put_entry_head(kind, hal::monotonic_ns(), result, sent.size(), received.size(), head);
  std::uint64_t at = (from + 1) * sizeof(std::uint64_t);
  copy_in(at, head);
  copy_in(at, sent);
  copy_in(at, received);
  // Release: who sees the word sees the rest.
  std::atomic_ref(ring_[from & (ring_.size() - 1)]).store(bytes, std::memory_order_release);
}

/// False: nothing more is there, or nothing more may be written.
bool BridgeRecorder::take_entries() {
  const std::size_t mask = ring_.size() - 1;
  for (std::uint64_t from = tail_.load(std::memory_order_relaxed);;) {
    std::atomic_ref begin(ring_[from & mask]);
    const std::uint64_t bytes = begin.load(std::memory_order_acquire);
    if (bytes == 0) return false;
    const std::uint64_t words = 1 + (bytes + 7) / 8;
    // Room for the end is kept.
    if (written_ + out_.size() + bytes + 4 + kLeastEntry_bytes > settings_.most_bytes) {
      stop_at(RecordingEnd::kFull);
      end_.store(RecordingEnd::kFull);
      return false;
    }
    const std::size_t at = out_.size();
    out_.resize(at + words * sizeof(std::uint64_t));
    for (std::uint64_t k = 1; k < words; ++k)
      std::memcpy(out_.data() + at + (k - 1) * 8, &ring_[(from + k) & mask], 8);
    out_.resize(at + bytes);
    add(bytes);
    for (std::uint64_t k = 1; k < words; ++k) ring_[(from + k) & mask] = 0;
    begin.store(0, std::memory_order_relaxed);
    from += words;
    tail_.store(from, std::memory_order_release);
    if (out_.size() >= kBlock_bytes) return true;
  }
}

/// The check sum of the last `bytes` of what goes out.
void BridgeRecorder::add(std::size_t bytes) {
  const auto entry = std::span(out_).last(bytes);
  const std::uint32_t sum =
      hal::crc32({reinterpret_cast<const std::uint8_t*>(entry.data()), entry.size()});
  std::array<std::byte, 4> last;
  std::memcpy(last.data(), &sum, sizeof sum);
  out_.insert(out_.end(), last.begin(), last.end());
}

void BridgeRecorder::flush() {
  std::size_t done = 0;
  while (done < out_.size()) {
    const ssize_t count = ::write(fd_, out_.data() + done, out_.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return give_up(count < 0 ? text_of(errno) : "nothing more is taken");
    done += static_cast<std::size_t>(count);
  }
  written_ += out_.size();
  out_.clear();
}

/// A part of the last block may lie in the file: it goes, and whole entries stay.
void BridgeRecorder::give_up(const std::string& why) {
  keeps_.store(false);
  has_failed_ = true;
  out_.clear();
  [[maybe_unused]] const int cut = ftruncate(fd_, static_cast<off_t>(written_));
  if (settings_.say)
    settings_.say("the recording " + settings_.path.string() + " ends after " +
                  std::to_string(written_) + " bytes: " + why +
                  "; make room or name another file, and record again; the device is not affected");
}

void BridgeRecorder::finish(RecordingEnd why) {
  const std::size_t at = out_.size();
  out_.resize(at + kEntryHead_bytes);
  put_entry_head(hal::TapKind::kEnd, hal::monotonic_ns(), static_cast<std::int64_t>(why), 0, 0,
                 std::span(out_).subspan(at));
  add(kEntryHead_bytes);
  flush();
  if (why == RecordingEnd::kDone || has_failed_ || !settings_.say) return;
  const std::string size = std::to_string(written_) + " bytes";
  settings_.say("the recording " + settings_.path.string() + " ends after " + size + ": " +
                (why == RecordingEnd::kFull   ? "that is all that record_mb allows"
                 : why == RecordingEnd::kSlow ? "the disk is too slow for it; name a file on a "
                                                "faster one"
                                              : "a message is too long to be kept") +
                "; the device is not affected");
}

void BridgeRecorder::run() noexcept {
  flush();  // the magic alone: the file is a recording from now on
  for (bool is_last = false; !is_last;) {
    is_last = is_over_.load() || !keeps_.load();
    while (!has_failed_ && take_entries()) flush();
    if (!has_failed_) flush();
    if (has_failed_) return;
    if (!is_last) (void)hal::sleep_until(hal::monotonic_ns() + kLook_ns);
  }
  finish(end_.load());
}

}  // namespace haptic::tools
