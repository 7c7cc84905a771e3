// SPDX-License-Identifier: Apache-2.0
#include "tools/common/files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "rt_core/scene/scene_view.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::tools {
namespace {

/// Largest scene that is read: beyond the compiler's own limits, so that a wrong file cannot
/// exhaust the memory.
constexpr std::uintmax_t kMaxSceneBytes = std::uintmax_t{1} << 33;

/// Up to this size a damaged scene is read whole: who opens it says where the damage is.
constexpr std::uintmax_t kSmallSceneBytes = std::uintmax_t{1} << 26;

std::uintmax_t checked_size(const std::filesystem::path& path, const std::string& role,
                            std::uintmax_t limit) {
  note_input(path, role);
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
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

/// @throws InputError where header and section table do not make up a scene of `size` bytes.
void check_front(const std::filesystem::path& path, std::uintmax_t size) {
  SceneBytes front(kSceneFrontBytes);
  read_into(path, reinterpret_cast<char*>(front.span().data()), front.span().size());
  const RtStatus status = SceneView::check_front(front.span(), size);
  if (status == RtStatus::kOk) return;
  SceneHeader header;
  std::memcpy(&header, front.span().data(), sizeof header);
  std::string text = path.string() + ": not a usable scene: " + to_text(status);
  if (status == RtStatus::kBlobTooSmall) {
    text = path.string() + ": not a usable scene: the file has " + std::to_string(size) +
           " bytes, its header states " + std::to_string(header.byte_count);
  }
  throw InputError(text + "; a scene is what graph_compiler writes");
}

[[noreturn]] void fail_to_write(const std::filesystem::path& path, int error) {
  throw OsError(path.string() + ": cannot be written: " + std::strerror(error));
}

int write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ::ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

/// The file that a chain of links ends in, which need not exist.
std::filesystem::path end_of_links(std::filesystem::path path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(path, error); ++i) {
    const std::filesystem::path next = std::filesystem::read_symlink(path, error);
    if (error) break;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path;
}

/// A rename would replace a device, a pipe, or what a name such as /dev/stdout stands for.
bool is_written_directly(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status))
    throw OsError(path.string() + ": is a folder; choose another name");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) return true;
  const std::string name = path.string();
  return name.starts_with("/dev/") || name.starts_with("/proc/");
}

/// Standard output is written through its own descriptor, so that its place in a file is kept.
void write_directly(const PendingFile& file) {
  struct stat target {
  }, standard_output{};
  const bool own =
      ::stat(file.path.c_str(), &target) == 0 && ::fstat(STDOUT_FILENO, &standard_output) == 0 &&
      target.st_dev == standard_output.st_dev && target.st_ino == standard_output.st_ino;
  if (own && std::fflush(stdout) != 0) fail_to_write(file.path, errno);
  const int descriptor = own ? STDOUT_FILENO : ::open(file.path.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) fail_to_write(file.path, errno);
  const int error = write_all(descriptor, file.bytes);
  const int close_error = own || ::close(descriptor) == 0 ? 0 : errno;
  if (error != 0 || close_error != 0) fail_to_write(file.path, error != 0 ? error : close_error);
}

/// A temporary beside the target, so that the rename stays within one file system. Removed unless
/// it was renamed.
class Temporary {
 public:
  explicit Temporary(const PendingFile& file) : target_(end_of_links(file.path)) {
    name_ = target_.string() + ".XXXXXX";
    const int descriptor = ::mkstemp(name_.data());
    if (descriptor < 0) fail(errno);
    open_ = true;
    const int error = keep(descriptor, file.bytes);
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
  static int keep(int descriptor, std::span<const std::byte> bytes) {
    const int error = write_all(descriptor, bytes);
    if (error != 0) return error;
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
  [[noreturn]] void fail(int error) const { fail_to_write(target_, error); }

  std::filesystem::path target_;
  std::string name_;
  bool open_ = false;
};

}  // namespace

std::string read_text_file(const std::filesystem::path& path, std::size_t limit,
                           const std::string& role) {
  std::string text(checked_size(path, role, limit), '\0');
  read_into(path, text.data(), text.size());
  return text;
}

SceneBytes read_scene_bytes(const std::filesystem::path& path) {
  const std::uintmax_t size = checked_size(path, "the compiled scene", kMaxSceneBytes);
  if (size > kSmallSceneBytes) check_front(path, size);
  SceneBytes bytes(size);
  read_into(path, reinterpret_cast<char*>(bytes.span().data()), bytes.span().size());
  return bytes;
}

void write_files(const std::vector<PendingFile>& files) {
  for (const PendingFile& file : files) {
    require_no_loss(file.path, {reinterpret_cast<const char*>(file.bytes.data()),
                                std::min(file.bytes.size(), kKindBytes)});
  }
  std::vector<Temporary> temporaries;
  temporaries.reserve(files.size());
  std::vector<const PendingFile*> direct;
  for (const PendingFile& file : files) {
    if (is_written_directly(file.path)) {
      direct.push_back(&file);
    } else {
      temporaries.emplace_back(file);
    }
  }
  for (const PendingFile* file : direct) write_directly(*file);
  for (Temporary& temporary : temporaries) temporary.rename();
}

}  // namespace haptic::tools
