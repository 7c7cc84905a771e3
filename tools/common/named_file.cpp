// SPDX-License-Identifier: Apache-2.0
#include "tools/common/named_file.hpp"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <vector>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

/// No file has a longer path.
constexpr std::size_t kMostBytes = 4096;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_but_case(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](char x, char y) { return lower(x) == lower(y); });
}

bool is_file(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// Entries of `folder` that differ from `name` in case at most, in the order of their names.
std::vector<std::filesystem::path> entries_like(const std::filesystem::path& folder,
                                                const std::string& name) {
  std::vector<std::filesystem::path> found;
  std::error_code error;
  const std::filesystem::path read = folder.empty() ? "." : folder;
  for (std::filesystem::directory_iterator it(read, error), end; !error && it != end;
       it.increment(error)) {
    const std::filesystem::path entry = it->path().filename();
    if (same_but_case(entry.string(), name)) found.push_back(folder / entry);
  }
  std::ranges::sort(found);
  return found;
}

/// Files at `rest` below `folder` in any case, at most two.
void collect(const std::filesystem::path& folder, std::filesystem::path::iterator rest,
             std::filesystem::path::iterator end, std::vector<std::filesystem::path>& found) {
  const std::string name = rest->string();
  const bool is_last = std::next(rest) == end;
  for (const std::filesystem::path& entry : name == "."    ? std::vector{folder}
                                            : name == ".." ? std::vector{folder / name}
                                                           : entries_like(folder, name)) {
    if (found.size() > 1) return;
    if (is_last) {
      if (is_file(entry)) found.push_back(entry);
    } else {
      collect(entry, std::next(rest), end, found);
    }
  }
}

}  // namespace

bool is_windows_path(const std::string& name) {
  const auto letter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); };
  const bool drive =
      name.size() > 2 && letter(name[0]) && name[1] == ':' && (name[2] == '\\' || name[2] == '/');
  return drive || name.starts_with("\\\\");
}

std::string without_blanks(const std::string& name) {
  constexpr const char* kSpaces = " \t\r\n\v\f";
  const std::size_t first = name.find_first_not_of(kSpaces);
  if (first == std::string::npos) return {};
  return name.substr(first, name.find_last_not_of(kSpaces) - first + 1);
}

std::string plain_name(const std::string& name) {
  std::string plain = without_blanks(name);
  std::ranges::replace(plain, '\\', '/');
  return plain;
}

std::optional<std::filesystem::path> file_as_named(const std::filesystem::path& folder,
                                                   const std::string& name) {
  if (name.size() > kMostBytes) return std::nullopt;
  for (const std::string& written : {name, plain_name(name)}) {
    if (!written.empty() && is_file(folder / written)) return folder / written;
  }
  return std::nullopt;
}

std::optional<FoundFile> named_file(const std::filesystem::path& folder, const std::string& name) {
  if (const auto path = file_as_named(folder, name)) return FoundFile{*path, {}};
  const std::filesystem::path plain = plain_name(name);
  if (plain.empty() || name.size() > kMostBytes) return std::nullopt;
  const std::filesystem::path steps = plain.relative_path();
  if (steps.empty()) return std::nullopt;
  std::vector<std::filesystem::path> found;
  const std::filesystem::path start = plain.is_absolute() ? plain.root_path() : folder;
  collect(start, steps.begin(), steps.end(), found);
  if (found.empty()) return std::nullopt;
  if (found.size() > 1) {
    throw InputError("no file '" + name + "', but '" + found[0].string() + "' and '" +
                     found[1].string() + "'; give the name with the letters of one of them");
  }
  return FoundFile{found[0], "'" + name + "' was found as '" + found[0].string() +
                                 "', with letters of another case"};
}

}  // namespace haptic::tools
