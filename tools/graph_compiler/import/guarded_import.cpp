// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/guarded_import.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

constexpr rlim_t kMostSeconds = 120, kMostMemory = rlim_t{4} << 30;
constexpr char kMesh = 'm', kRefusal = 'r';

void append_bytes(std::string& to, const void* from, std::size_t size) {
  to.append(static_cast<const char*>(from), size);
}
template <typename T>
void append_number(std::string& to, T value) {
  append_bytes(to, &value, sizeof value);
}

/// Reads the message of a child that may have written anything.
class Message {
 public:
  Message(const std::string& text, const std::string& file) : text_(text), file_(file) {}

  template <typename T>
  T number() {
    T value{};
    take(&value, sizeof value);
    return value;
  }
  void take(void* to, std::size_t size) {
    if (size > text_.size() - at_) refuse();
    std::memcpy(to, text_.data() + at_, size);
    at_ += size;
  }
  /// A count of items of at least `least` bytes each that are still to come.
  std::size_t count(std::uint64_t announced, std::size_t least) const {
    if (announced > (text_.size() - at_) / least) refuse();
    return static_cast<std::size_t>(announced);
  }
  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }
  [[noreturn]] void refuse() const {
    refuse_file(file_, "the importer gave no mesh", "export the part again, or as STL");
  }

 private:
  const std::string& text_;
  const std::string& file_;
  std::size_t at_ = 0;
};

void write_all(int to, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(to, text.data() + done, text.size() - done);
    if (n < 0 && errno != EINTR) return;
    if (n > 0) done += static_cast<std::size_t>(n);
  }
}

/// Of this process at present [bytes].
rlim_t address_space() {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

[[noreturn]] void run_child(int to, const std::function<ImportedMesh()>& work) {
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(number, SIG_DFL);
  const rlimit time{kMostSeconds, kMostSeconds};
  const rlim_t memory = address_space() + kMostMemory;
  const rlimit space{memory, memory}, no_core{0, 0};
  std::string text;
  if (::setrlimit(RLIMIT_CPU, &time) == 0 && ::setrlimit(RLIMIT_AS, &space) == 0 &&
      ::setrlimit(RLIMIT_CORE, &no_core) == 0) {
    try {
      text = message_of(work());
    } catch (const InputError& error) {
      text = kRefusal + std::string(error.what());
    } catch (...) {
      text.clear();  // out of memory, or an exception of the library's own
    }
  }
  write_all(to, text);
  ::_exit(0);
}

std::string read_all(int from) {
  std::string text;
  std::vector<char> buffer(std::size_t{1} << 16);
  for (;;) {
    const ssize_t n = ::read(from, buffer.data(), buffer.size());
    if (n == 0 || (n < 0 && errno != EINTR)) return text;
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace

std::string message_of(const ImportedMesh& imported) {
  std::string text(1, kMesh);
  append_number(text, imported.unit_m);
  const Deflection deflection = imported.deflection.value_or(Deflection{});
  append_number(text, deflection.asked_m);  // 0: none
  append_number(text, deflection.found_m);
  append_number(text, std::uint64_t{imported.mesh.vertices.size()});
  append_number(text, std::uint64_t{imported.mesh.faces.size()});
  append_bytes(text, imported.mesh.vertices.data(), imported.mesh.vertices.size() * sizeof(Point3));
  for (const RawFace& face : imported.mesh.faces) {
    append_number(text, face.group);
    append_number(text, static_cast<std::uint32_t>(face.vertices.size()));
    append_bytes(text, face.vertices.data(), face.vertices.size() * sizeof(std::uint32_t));
  }
  return text;
}

ImportedMesh mesh_of_message(const std::string& text, const std::string& file) {
  Message message(text, file);
  if (message.number<char>() != kMesh) message.refuse();
  ImportedMesh imported;
  imported.unit_m = message.number<double>();
  if (!(std::isfinite(imported.unit_m) && imported.unit_m > 0.0)) message.refuse();
  const auto asked_m = message.number<double>(), found_m = message.number<double>();
  if (!(std::isfinite(asked_m) && asked_m >= 0.0 && std::isfinite(found_m) && found_m >= 0.0)) {
    message.refuse();
  }
  if (asked_m > 0.0) imported.deflection = Deflection{asked_m, found_m};
  RawMesh& mesh = imported.mesh;
  mesh.file = file;
  mesh.indexed = true;
  mesh.places_are_lines = false;
  const auto vertices = message.number<std::uint64_t>(), faces = message.number<std::uint64_t>();
  mesh.vertices.resize(message.count(vertices, sizeof(Point3)));
  mesh.vertex_places.resize(mesh.vertices.size(), 0);
  message.take(mesh.vertices.data(), mesh.vertices.size() * sizeof(Point3));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!std::ranges::all_of(mesh.vertices[v], [](double x) { return std::isfinite(x); })) {
      refuse_file(file, "vertex " + std::to_string(v + 1) + " is not finite",
                  "export the part again");
    }
  }
  mesh.faces.resize(message.count(faces, 5 * sizeof(std::uint32_t)));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    RawFace& face = mesh.faces[f];
    face.group = message.number<std::uint32_t>();
    face.vertices.resize(message.count(message.number<std::uint32_t>(), sizeof(std::uint32_t)));
    message.take(face.vertices.data(), face.vertices.size() * sizeof(std::uint32_t));
    for (const std::uint32_t v : face.vertices) {
      if (v >= mesh.vertices.size()) {
        refuse_file(file,
                    "face " + std::to_string(f + 1) + " uses vertex " + std::to_string(v) + " of " +
                        std::to_string(mesh.vertices.size()),
                    "correct the index");
      }
    }
    if (face.vertices.size() < 3) message.refuse();
  }
  if (!message.at_end()) message.refuse();
  if (mesh.faces.empty()) {
    refuse_file(file, "the file holds no face", "export the part as a polygon mesh");
  }
  return imported;
}

ImportedMesh guarded(const std::string& file, const std::function<ImportedMesh()>& work) {
  int ends[2];
  if (::pipe(ends) != 0) throw OsError(file + ": no pipe (" + std::strerror(errno) + ")");
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) {
    const int reason = errno;
    ::close(ends[0]);
    ::close(ends[1]);
    throw OsError(file + ": no process for the importer (" + std::strerror(reason) + ")");
  }
  if (child == 0) {
    ::close(ends[0]);
    run_child(ends[1], work);
  }
  ::close(ends[1]);
  const std::string text = read_all(ends[0]);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) {
    refuse_file(file,
                std::string("the importer crashed on it (") + ::strsignal(WTERMSIG(status)) + ")",
                "export the part again, or as STL");
  }
  if (text.empty()) {
    refuse_file(file, "the importer failed on it", "export the part again, or as STL");
  }
  if (text[0] == kRefusal) throw InputError(text.substr(1));
  return mesh_of_message(text, file);
}

}  // namespace haptic::tools
