// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/teller.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <span>
#include <string_view>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::tools {
namespace {

/// @return 0, or the errno of what nobody will ever read.
int write_text(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // somebody else has made it non-blocking
      pollfd watched{descriptor, POLLOUT, 0};
      (void)::poll(&watched, 1, -1);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

/// @return what went wrong; empty: nothing.
std::string write_one_file(const std::filesystem::path& path, const std::string& content) {
  try {
    write_files({{path, std::as_bytes(std::span(content))}});
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace

Teller::Teller() : shared_(std::make_shared<Shared>()) {
  journal_ = std::getenv("JOURNAL_STREAM") != nullptr;
  // A signal for a reader that has gone would be for the whole process.
  (void)std::signal(SIGPIPE, SIG_IGN);
  for (std::size_t k = 0; k < kStreams; ++k)
    threads_[k] = std::thread(write_items, shared_, static_cast<Stream>(k));
}

Teller::~Teller() { (void)finish(); }

void Teller::write_items(const std::shared_ptr<Shared>& shared, Stream stream) {
  Queue& queue = shared->queues[static_cast<std::size_t>(stream)];
  std::unique_lock lock(shared->mutex);
  for (;;) {
    queue.idle = queue.items.empty();
    if (queue.idle) {
      shared->written.notify_all();
      if (shared->ending) return;
      shared->changed.wait(lock);
      continue;
    }
    Item item = std::move(queue.items.front());
    queue.items.pop_front();
    if (queue.dropped > 0 && stream == Stream::kError)
      item.text = "(" + std::to_string(std::exchange(queue.dropped, 0)) +
                  " lines dropped: nobody read them)\n" + item.text;
    if (queue.error != 0) continue;
    lock.unlock();
    int error = 0;
    std::string trouble;
    if (stream == Stream::kFiles) {
      trouble = write_one_file(item.path, item.text);
    } else {
      error = write_text(stream == Stream::kOut ? STDOUT_FILENO : STDERR_FILENO, item.text);
    }
    lock.lock();
    queue.error = error;
    if (!trouble.empty()) add(*shared, Stream::kError, {trouble + "\n", {}});
  }
}

// With the lock held.
void Teller::add(Shared& shared, Stream stream, Item item) {
  Queue& queue = shared.queues[static_cast<std::size_t>(stream)];
  if (queue.items.size() >= kMostLines) {
    queue.items.pop_front();
    ++queue.dropped;
  }
  queue.items.push_back(std::move(item));
  shared.changed.notify_all();
}

void Teller::say(Stream stream, const std::string& text, LineLevel level) {
  std::string lines;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    if (journal_ && stream == Stream::kError && level != LineLevel::kPlain)
      lines += "<" + std::to_string(static_cast<int>(level)) + ">";
    lines += std::string(rest.substr(0, end)) + "\n";
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  const std::lock_guard lock(shared_->mutex);
  add(*shared_, stream, {std::move(lines), {}});
}

void Teller::write_file(const std::filesystem::path& path, const std::string& content) {
  const std::lock_guard lock(shared_->mutex);
  add(*shared_, Stream::kFiles, {content, path});
}

bool Teller::finish() {
  std::unique_lock lock(shared_->mutex);
  if (shared_->ending) return true;
  const auto all_idle = [this] {
    return std::all_of(shared_->queues.begin(), shared_->queues.end(),
                       [](const Queue& q) { return q.idle && q.items.empty(); });
  };
  (void)shared_->written.wait_for(lock, std::chrono::milliseconds(kLongestFinish_ms), all_idle);
  shared_->ending = true;
  shared_->changed.notify_all();
  const Queue& out = shared_->queues[static_cast<std::size_t>(Stream::kOut)];
  const bool whole =
      out.idle && out.dropped == 0 && (out.error == 0 || out.error == EPIPE || out.error == EIO);
  std::array<bool, kStreams> idle{};
  for (std::size_t k = 0; k < kStreams; ++k) idle[k] = shared_->queues[k].idle;
  lock.unlock();
  for (std::size_t k = 0; k < kStreams; ++k) {
    if (idle[k]) {
      threads_[k].join();
    } else {
      threads_[k].detach();  // it waits for a reader
    }
  }
  return whole;
}

}  // namespace haptic::tools
