// SPDX-License-Identifier: Apache-2.0
/// Runs a fuzz target without libFuzzer: the seeds, the inputs that once broke it, then seeded
/// random mutations of both. The same inputs with every compiler.
///
/// fuzz_NAME_replay [--mutations N] [--seed S] [--write FOLDER] [FILE-OR-FOLDER...]
/// Exit code 1 (or a signal) on a finding; the input is left in finding_NAME.bin in the current
/// folder. Under the address sanitizer that needs ASAN_OPTIONS=abort_on_error=1.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/split_mix.hpp"

namespace haptic::fuzz {
namespace {

/// The same numbers on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : words_(seed) {}
  std::size_t below(std::size_t limit) { return static_cast<std::size_t>(words_.next() % limit); }

 private:
  tools::SplitMix64 words_;
};

constexpr std::string_view kWords[] = {"0",
                                       "-1",
                                       "1e400",
                                       "1e-400",
                                       "nan",
                                       "inf",
                                       "4294967296",
                                       "18446744073709551616",
                                       "-0.0",
                                       "1e308",
                                       "f 1 2 3\n",
                                       "v 0 0 0\n",
                                       "\\\n",
                                       "#",
                                       "\r",
                                       "\n",
                                       " ",
                                       "\"",
                                       "[",
                                       "]",
                                       "{",
                                       "=",
                                       "/",
                                       "solid",
                                       "endsolid\n",
                                       std::string_view("\0\0\0\0", 4),
                                       "\xFF\xFF\xFF\xFF",
                                       "\x00\x00\x80\x7F"};

/// One to six edits: bits, bytes, words put in or over, ranges cut, doubled, or taken from another.
std::string mutated(std::string text, const std::string& other, Random& random) {
  constexpr std::size_t kLongest = 1U << 17;
  for (std::size_t edits = 1 + random.below(6); edits > 0; --edits) {
    const std::size_t at = random.below(text.size() + 1);
    const std::size_t length = 1 + random.below(random.below(4) == 0 ? 200 : 8);
    const std::string_view word = kWords[random.below(std::size(kWords))];
    switch (random.below(7)) {
      case 0:
        if (at < text.size()) text[at] ^= static_cast<char>(1U << random.below(8));
        break;
      case 1:
        if (at < text.size()) text[at] = static_cast<char>(random.below(256));
        break;
      case 2:
        text.insert(at, word);
        break;
      case 3:
        text.replace(at, word.size(), word);
        break;
      case 4:
        text.erase(at, length);
        break;
      case 5:
        text.insert(at, text.substr(random.below(text.size() + 1), length));
        break;
      default:
        text.replace(at, length, other.substr(random.below(other.size() + 1), length));
        break;
    }
  }
  text.resize(std::min(text.size(), kLongest));
  return text;
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct Options {
  std::size_t mutations = 0;
  std::uint64_t seed = 1;
  std::string write_to;
  std::vector<std::filesystem::path> files;  ///< sorted, so that runs are alike
};

Options parse_options(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool has_value = i + 1 < argc;
    if (word == "--mutations" && has_value) {
      options.mutations = std::strtoull(argv[++i], nullptr, 10);
    } else if (word == "--seed" && has_value) {
      options.seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (word == "--write" && has_value) {
      options.write_to = argv[++i];
    } else if (std::filesystem::is_directory(word)) {
      for (const auto& entry : std::filesystem::directory_iterator(word)) {
        options.files.push_back(entry.path());
      }
    } else if (std::filesystem::is_regular_file(word)) {
      options.files.emplace_back(word);
    }
  }
  std::sort(options.files.begin(), options.files.end());
  return options;
}

/// The input that is being run, for the handler of fatal signals.
const std::string* current_input = nullptr;
std::string finding_file;

extern "C" void keep_input(int signal_number) {
  const int file = ::open(finding_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0 && current_input != nullptr) {
    const ssize_t written = ::write(file, current_input->data(), current_input->size());
    static_cast<void>(written);  // nothing is left to be done about it
    ::close(file);
  }
  std::signal(signal_number, SIG_DFL);
  std::raise(signal_number);
}

class Replay {
 public:
  explicit Replay(const std::filesystem::path& program) {
    finding_file = "finding_" + program.filename().string() + ".bin";
    for (const int signal_number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) {
      std::signal(signal_number, keep_input);
    }
  }

  bool run(const std::string& name, const std::string& bytes) {
    current_input = &bytes;
    const auto begin = std::chrono::steady_clock::now();
    try {
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    } catch (const std::exception& error) {
      write_bytes(finding_file, bytes);
      std::fprintf(stderr, "%s: %s\n  input kept in %s\n", name.c_str(), error.what(),
                   finding_file.c_str());
      return false;
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    slowest_ = std::max(slowest_, seconds.count());
    ++runs_;
    return true;
  }

  int finish(bool good) const {
    const std::chrono::duration<double> all = std::chrono::steady_clock::now() - begin_;
    std::printf("%zu inputs in %.1f s, slowest %.3f s\n", runs_, all.count(), slowest_);
    constexpr double kSlowest_s = 20.0;
    return good && slowest_ < kSlowest_s ? 0 : 1;
  }

 private:
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::size_t runs_ = 0;
  double slowest_ = 0.0;
};

int replay(int argc, char** argv) {
  const Options options = parse_options(argc, argv);
  std::vector<Seed> inputs = seeds();
  if (!options.write_to.empty()) {
    std::filesystem::create_directories(options.write_to);
    for (const Seed& seed : inputs) {
      write_bytes(std::filesystem::path(options.write_to) / seed.name, seed.bytes);
    }
    return 0;
  }
  for (const std::filesystem::path& file : options.files) {
    inputs.push_back({file.string(), read_bytes(file)});
  }
  Replay runner(argv[0]);
  bool good = runner.run("empty input", "");
  for (std::size_t i = 0; good && i < inputs.size(); ++i) {
    good = runner.run(inputs[i].name, inputs[i].bytes);
  }
  Random random(options.seed);
  for (std::size_t i = 0; good && i < options.mutations; ++i) {
    const Seed& base = inputs[random.below(inputs.size())];
    const Seed& other = inputs[random.below(inputs.size())];
    good = runner.run("mutation " + std::to_string(i) + " of " + base.name,
                      mutated(base.bytes, other.bytes, random));
  }
  return runner.finish(good);
}

}  // namespace
}  // namespace haptic::fuzz

int main(int argc, char** argv) { return haptic::fuzz::replay(argc, argv); }
