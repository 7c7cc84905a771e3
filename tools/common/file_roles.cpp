// SPDX-License-Identifier: Apache-2.0
#include "tools/common/file_roles.hpp"

#include <fnmatch.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <system_error>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

namespace fs = std::filesystem;

/// One file, by any of its names.
bool one_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::exists(a, error) && fs::exists(b, error)) return fs::equivalent(a, b, error) && !error;
  const fs::path left = fs::weakly_canonical(fs::absolute(a), error);
  if (error) return false;
  const fs::path right = fs::weakly_canonical(fs::absolute(b), error);
  return !error && left == right;
}

/// Devices, pipes and sockets hold nothing that could be overwritten.
bool holds_content(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return !fs::exists(status) || fs::is_regular_file(status) || fs::is_directory(status);
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

struct NamedFile {
  fs::path path;
  std::string role;
};

struct NamedFolder {
  fs::path path;
  std::string role;
  std::vector<std::string> names;

  /// The file of this folder that `path` is.
  [[nodiscard]] bool writes(const fs::path& file) const {
    std::error_code error;
    const fs::path place = fs::weakly_canonical(fs::absolute(file), error);
    const bool inside = !error && one_file(place.parent_path(), path);
    return std::ranges::any_of(names, [&](const std::string& name) {
      if (inside && ::fnmatch(name.c_str(), place.filename().c_str(), 0) == 0) return true;
      return name.find('*') == std::string::npos && one_file(path / name, file);
    });
  }
};

/// "m.csv: --out would overwrite the motion; give another name".
[[noreturn]] void refuse(const fs::path& output, const std::string& option, const fs::path& kept,
                         const std::string& role) {
  const std::string alias = output == kept ? "" : " (" + kept.string() + ", the same file)";
  throw UsageError(output.string() + ": " + option + " would overwrite " + role + alias +
                   "; give another name");
}

class FileRoles {
 public:
  void input(const fs::path& path, const std::string& role) {
    if (!holds_content(path)) return;
    for (const NamedFile& out : outputs_)
      if (one_file(path, out.path)) refuse(out.path, out.role, path, role);
    for (const NamedFolder& folder : folders_)
      if (folder.writes(path)) refuse(folder.path / path.filename(), folder.role, path, role);
    inputs_.push_back({path, role});
  }

  void output(const fs::path& path, const std::string& role) {
    if (!holds_content(path)) return;
    for (const NamedFile& in : inputs_)
      if (one_file(path, in.path)) refuse(path, role, in.path, in.role);
    for (const NamedFile& out : outputs_)
      if (one_file(path, out.path)) refuse(path, role, out.path, "the file of " + out.role);
    for (const NamedFolder& folder : folders_)
      if (folder.writes(path)) refuse(path, role, path, "a file of " + folder.role);
    outputs_.push_back({path, role});
  }

  void folder(NamedFolder folder) {
    for (const NamedFile& in : inputs_)
      if (folder.writes(in.path))
        refuse(folder.path / in.path.filename(), folder.role, in.path, in.role);
    for (const NamedFile& out : outputs_)
      if (folder.writes(out.path)) refuse(out.path, folder.role, out.path, "that of " + out.role);
    folders_.push_back(std::move(folder));
  }

  void no_input(const fs::path& path) const {
    if (!holds_content(path)) return;
    for (const NamedFile& in : inputs_)
      if (one_file(path, in.path)) refuse(path, "an output", in.path, in.role);
  }

 private:
  std::vector<NamedFile> inputs_, outputs_;
  std::vector<NamedFolder> folders_;
};

std::mutex roles_mutex;

FileRoles& roles() {
  static FileRoles all;
  return all;
}

void require_writable(const fs::path& folder, const fs::path& named) {
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return;
  throw OsError(named.string() + ": the folder '" + folder.string() +
                "' cannot be written: " + std::strerror(errno));
}

/// "m.csv: --out writes a plan, and the file that is there is a mesh (OBJ); give another name".
[[noreturn]] void refuse_kind(const fs::path& path, const std::string& role,
                              const std::string& written, const FileKind& there) {
  throw UsageError(path.string() + ": " + role + " writes " + written +
                   ", and the file that is there is " + to_text(there) +
                   "; it is kept: give another name, or remove it first");
}

/// The files of a folder by these names: what they are called says what is written.
void require_named_formats(const fs::path& folder, const std::string& role,
                           const std::vector<std::string>& names) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string file = at->path().filename().string();
    const bool ours = std::ranges::any_of(names, [&](const std::string& name) {
      return ::fnmatch(name.c_str(), file.c_str(), 0) == 0;
    });
    const std::optional<FileFormat> format = ours ? format_named(at->path()) : std::nullopt;
    if (!format) continue;
    const std::optional<FileKind> there = kind_of_file(at->path());
    if (there && there->format != *format)
      refuse_kind(at->path(), role, to_text(FileKind{*format, {}}), *there);
  }
}

}  // namespace

void note_input(const fs::path& path, const std::string& role) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (path.empty()) throw InputError("the path of " + role + " is empty; name a file");
  if (!fs::exists(status)) {
    throw InputError(
        path.string() + ": " +
        (status.type() == fs::file_type::not_found ? "no such file" : error.message()) +
        "; check the path");
  }
  if (fs::is_directory(status))
    throw InputError(path.string() + ": is a folder; give the path of a file");
  if (::access(path.c_str(), R_OK) != 0) {
    throw InputError(path.string() + ": cannot be read: " + std::strerror(errno) +
                     "; check its permissions");
  }
  const std::scoped_lock lock(roles_mutex);
  roles().input(path, role);
}

void claim_output(const fs::path& path, const std::string& role, const FileKind& kind) {
  if (path.empty()) return;
  const std::scoped_lock lock(roles_mutex);
  roles().output(path, role);
  const fs::path folder = folder_of(path);
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (!fs::exists(status)) {
    throw OsError(path.string() + ": the folder '" + folder.string() +
                  "' does not exist; make it first");
  }
  if (!fs::is_directory(status)) {
    throw OsError(path.string() + ": '" + folder.string() +
                  "' is a file, not a folder; name another folder");
  }
  if (fs::is_directory(path, error))
    throw OsError(path.string() + ": is a folder; " + role + " names a file");
  if (holds_content(path)) require_writable(folder, path);
  require_replaceable(path, role, kind);
}

void claim_folder(const fs::path& path, const std::string& role,
                  const std::vector<std::string>& names) {
  if (path.empty()) return;
  const std::scoped_lock lock(roles_mutex);
  roles().folder({path, role, names});
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_directory(status))
    throw OsError(path.string() + ": is a file; " + role + " names a folder");
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path)) {
    throw OsError(path.string() + ": the folder cannot be made" +
                  (error ? ": " + error.message() : "") + "; name another");
  }
  require_writable(path, path);
  for (const std::string& name : names) {
    if (fs::is_directory(path / name, error))
      throw OsError((path / name).string() + ": is a folder; " + role + " writes a file there");
  }
  require_named_formats(path, role, names);
}

void require_replaceable(const fs::path& path, const std::string& role, const FileKind& kind) {
  const std::optional<FileKind> there = kind_of_file(path);
  if (!there || *there == kind) return;
  refuse_kind(path, role, to_text(kind), *there);
}

void require_no_loss(const fs::path& path, std::string_view content) {
  {
    const std::scoped_lock lock(roles_mutex);
    roles().no_input(path);
  }
  require_replaceable(path, "an output", kind_of(content).value_or(text_kind({})));
}

void require_svg_name(const std::string& path, const std::string& role) {
  std::string extension = fs::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension.empty() || extension == ".svg") return;
  throw UsageError(path + ": " + role + " writes SVG; name it " +
                   fs::path(path).replace_extension(".svg").string());
}

void forget_file_roles() {
  const std::scoped_lock lock(roles_mutex);
  roles() = FileRoles();
}

}  // namespace haptic::tools
