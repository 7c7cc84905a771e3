// SPDX-License-Identifier: Apache-2.0
#include "tools/common/files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

/// Largest scene that is read: beyond the compiler's own limits, so that a wrong file cannot
/// exhaust the memory.
constexpr std::uintmax_t kMaxSceneBytes = std::uintmax_t{1} << 33;

std::uintmax_t checked_size(const std::filesystem::path& path, std::uintmax_t limit) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw InputError(path.string() + ": no such file; check the path");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(path.string() + ": not a file; give the path of a file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw InputError(path.string() + ": " + error.message());
  if (size > limit) {
    throw InputError(path.string() + ": " + std::to_string(size) + " bytes, the limit is " +
                     std::to_string(limit) + "; is it the right file?");
  }
  return size;
}

void read_into(const std::filesystem::path& path, char* to, std::uintmax_t size) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw InputError(path.string() + ": " + std::strerror(errno) + "; check its permissions");
  if (!in.read(to, static_cast<std::streamsize>(size)) && size > 0) {
    throw InputError(path.string() + ": cannot be read to its end");
  }
}

/// A temporary beside the target, so that the rename stays within one file system. Removed unless
/// it was renamed.
class Temporary {
 public:
  explicit Temporary(const PendingFile& file) : target_(file.path) {
    name_ = target_.string() + ".XXXXXX";
    const int descriptor = ::mkstemp(name_.data());
    if (descriptor < 0) fail(errno);
    open_ = true;
    const int error = write_all(descriptor, file.bytes);
    const int close_error = ::close(descriptor) == 0 ? 0 : errno;
    if (error != 0 || close_error != 0) {
      remove();
      fail(error != 0 ? error : close_error);
    }
  }
  Temporary(Temporary&& other) noexcept
      : target_(std::move(other.target_)), name_(std::move(other.name_)), open_(other.open_) {
    other.open_ = false;
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  Temporary& operator=(Temporary&&) = delete;
  ~Temporary() { remove(); }

  void rename() {
    if (::rename(name_.c_str(), target_.c_str()) != 0) fail(errno);
    open_ = false;
  }

 private:
  static int write_all(int descriptor, std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ::ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return errno;
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    // mkstemp makes the file private; an output gets what a plain open would give it.
    const ::mode_t mask = ::umask(0);
    ::umask(mask);
    if (::fchmod(descriptor, 0666 & ~mask) != 0) return errno;
    return ::fsync(descriptor) == 0 ? 0 : errno;
  }
  void remove() noexcept {
    if (open_) ::unlink(name_.c_str());
    open_ = false;
  }
  [[noreturn]] void fail(int error) const {
    throw OsError(target_.string() + ": cannot be written: " + std::strerror(error));
  }

  std::filesystem::path target_;
  std::string name_;
  bool open_ = false;
};

}  // namespace

std::string read_text_file(const std::filesystem::path& path, std::size_t limit) {
  std::string text(checked_size(path, limit), '\0');
  read_into(path, text.data(), text.size());
  return text;
}

SceneBytes read_scene_bytes(const std::filesystem::path& path) {
  SceneBytes bytes(checked_size(path, kMaxSceneBytes));
  read_into(path, reinterpret_cast<char*>(bytes.span().data()), bytes.span().size());
  return bytes;
}

void write_files(const std::vector<PendingFile>& files) {
  std::vector<Temporary> temporaries;
  temporaries.reserve(files.size());
  for (const PendingFile& file : files) {
    // A rename would replace a device such as /dev/null, and a folder would fail only after all was
    // written.
    std::error_code error;
    const auto status = std::filesystem::status(file.path, error);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
      throw OsError(file.path.string() + ": exists and is not a regular file; choose another name");
    }
    temporaries.emplace_back(file);
  }
  for (Temporary& temporary : temporaries) temporary.rename();
}

}  // namespace haptic::tools
