// SPDX-License-Identifier: Apache-2.0
// Group core: save and load of all that a core knows. Nothing is allocated here.
//
// The state of a core is one memory with addresses in it: of itself, and of the scene. They are
// saved as distances from the begin of either, word by word. No number of a state looks like one: a
// length or a force would be below 1e-308, and a pair of 32-bit numbers would have to hit both the
// upper half and a window of the lower one.
#include <elf.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <span>
#include <type_traits>

#include "tools/library/call.hpp"
#include "tools/library/core_handle.hpp"
#include "tools/session/session_channel.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

using Hash = std::array<std::uint8_t, 32>;

/// Begin of a state.
struct StateHeader {
  static constexpr std::uint64_t kMagic = 0x3174735f63697068;
  std::uint64_t magic = kMagic;
  std::uint32_t format = 1, real_bytes = sizeof(Real);
  char version[16] = {};    ///< of the library
  Hash build{};             ///< that of its code, by which the members lie where they lie
  Hash scene{};             ///< of the bytes of the scene
  std::uint64_t words = 0;  ///< of the state of the tick
  Hash content{};           ///< of all that follows
};

/// Behind it.
struct StateRest {
  CoreCounts counts;
  SessionJudge judge;
  double wrench[6] = {}, felt_pose[7] = {};  ///< of the last step
};
static_assert(std::is_trivially_copyable_v<StateHeader> && sizeof(StateHeader) % 8 == 0);
static_assert(std::is_trivially_copyable_v<SessionJudge> && sizeof(SessionJudge) % 8 == 0);
static_assert(std::is_trivially_copyable_v<StateRest> && sizeof(StateRest) % 8 == 0);

/// Kind of a saved word; two bits of it, by the number of the word.
enum class Word : std::uint8_t { kNumber = 0, kOfMemory = 1, kOfScene = 2 };

/// Ranges of addresses that a state may hold, the end of each included.
class Ranges {
 public:
  explicit Ranges(const haptic_core& handle) noexcept
      : memory_(reinterpret_cast<std::uintptr_t>(&handle)),
        memory_bytes_(sizeof(haptic_core) + HapticCore::state_bytes(handle.view)),
        scene_(reinterpret_cast<std::uintptr_t>(handle.view.blob().data())),
        scene_bytes_(handle.view.blob().size()) {}

  [[nodiscard]] Word kind_of(std::uint64_t word) const noexcept {
    if (word - memory_ <= memory_bytes_) return Word::kOfMemory;
    return word - scene_ <= scene_bytes_ ? Word::kOfScene : Word::kNumber;
  }
  [[nodiscard]] std::uint64_t begin_of(Word kind) const noexcept {
    return kind == Word::kOfMemory ? memory_ : kind == Word::kOfScene ? scene_ : 0;
  }
  /// A distance that was saved.
  [[nodiscard]] bool holds(Word kind, std::uint64_t distance) const noexcept {
    return kind == Word::kNumber ||
           distance <= (kind == Word::kOfMemory ? memory_bytes_ : scene_bytes_);
  }

 private:
  std::uint64_t memory_, memory_bytes_, scene_, scene_bytes_;
};

std::span<std::byte> state_of(haptic_core& handle) noexcept {
  return {reinterpret_cast<std::byte*>(&handle) + sizeof(haptic_core),
          HapticCore::state_bytes(handle.view)};
}

std::size_t kind_bytes(std::uint64_t words) noexcept {
  return static_cast<std::size_t>((words + 31) / 32 * 8);
}
std::size_t total_bytes(std::uint64_t words) noexcept {
  return sizeof(StateHeader) + sizeof(StateRest) + kind_bytes(words) +
         static_cast<std::size_t>(words) * 8;
}

Hash hash_of(std::span<const std::byte> bytes) noexcept { return hash_of_scene(bytes); }

/// The note by which the linker names the code of this library (ELF, NT_GNU_BUILD_ID).
struct BuildNote {
  Hash hash{};
  bool found = false;
};
int look_at_object(dl_phdr_info* object, std::size_t /*size*/, void* to) {
  const auto self = reinterpret_cast<std::uintptr_t>(&haptic_core_save);
  const std::span<const ElfW(Phdr)> headers(object->dlpi_phdr, object->dlpi_phnum);
  const bool is_own = std::ranges::any_of(headers, [&](const ElfW(Phdr) & h) {
    return h.p_type == PT_LOAD && self - (object->dlpi_addr + h.p_vaddr) < h.p_memsz;
  });
  if (!is_own) return 0;
  for (const ElfW(Phdr) & h : headers) {
    if (h.p_type != PT_NOTE) continue;
    const auto* const notes = reinterpret_cast<const std::byte*>(object->dlpi_addr + h.p_vaddr);
    for (std::size_t at = 0; at + sizeof(ElfW(Nhdr)) <= h.p_memsz;) {
      ElfW(Nhdr) note;
      std::memcpy(&note, notes + at, sizeof note);
      const std::size_t name = at + sizeof note;
      const std::size_t text = name + (note.n_namesz + 3u) / 4 * 4;
      if (text + note.n_descsz > h.p_memsz) break;
      if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 &&
          std::memcmp(notes + name, "GNU", 4) == 0)
        *static_cast<BuildNote*>(to) = {hash_of({notes + text, note.n_descsz}), true};
      at = text + (note.n_descsz + 3u) / 4 * 4;
    }
  }
  return 1;
}

[[nodiscard]] StateHeader header_of(const haptic_core& handle) noexcept {
  StateHeader header;
  BuildNote note;
  (void)dl_iterate_phdr(&look_at_object, &note);
  header.build = note.hash;
  (void)std::snprintf(header.version, sizeof header.version, "%s", haptic_version());
  header.scene = hash_of(handle.view.blob());
  header.words = HapticCore::state_bytes(handle.view) / 8;
  return header;
}

void write_state(haptic_core& handle, std::span<std::byte> to) noexcept {
  StateHeader header = header_of(handle);
  StateRest rest{handle.counts, handle.judge, {}, {}};
  write_numbers(handle.last.wrench_w, rest.wrench);
  write_numbers(handle.last.felt_wa, rest.felt_pose);
  std::byte* at = to.data() + sizeof header;
  std::memcpy(at, &rest, sizeof rest);
  std::byte* const kinds = at + sizeof rest;
  std::byte* const words = kinds + kind_bytes(header.words);
  std::memset(kinds, 0, kind_bytes(header.words));
  const Ranges ranges(handle);
  const std::byte* const from = state_of(handle).data();
  for (std::size_t k = 0; k < header.words; ++k) {
    std::uint64_t word = 0;
    std::memcpy(&word, from + 8 * k, 8);
    const Word kind = ranges.kind_of(word);
    word -= ranges.begin_of(kind);
    kinds[k / 4] |= static_cast<std::byte>(static_cast<unsigned>(kind) << (2 * (k % 4)));
    std::memcpy(words + 8 * k, &word, 8);
  }
  header.content = hash_of(to.subspan(sizeof header));
  std::memcpy(to.data(), &header, sizeof header);
}

Word kind_at(const std::byte* kinds, std::size_t k) noexcept {
  return static_cast<Word>(static_cast<unsigned>(kinds[k / 4]) >> (2 * (k % 4)) & 3u);
}

/// HAPTIC_OK, or why this core cannot go on from `bytes`, in `why`.
int check_state(const haptic_core& handle, std::span<const std::byte> bytes,
                const char*& why) noexcept {
  StateHeader given;
  const auto refuse = [&why](int error, const char* words) {
    why = words;
    return error;
  };
  if (bytes.size() < sizeof given)
    return refuse(HAPTIC_ERROR_INPUT, "the state ends within its header; give all bytes of it");
  std::memcpy(&given, bytes.data(), sizeof given);
  if (given.magic != StateHeader::kMagic)
    return refuse(HAPTIC_ERROR_INPUT, "these bytes are no state of a core");
  const StateHeader own = header_of(handle);
  if (given.format != own.format ||
      std::memcmp(given.version, own.version, sizeof own.version) != 0)
    return refuse(HAPTIC_ERROR_VERSION,
                  "the state is of another version of this library; save it again with this one");
  if (given.real_bytes != own.real_bytes)
    return refuse(HAPTIC_ERROR_VERSION,
                  own.real_bytes == 8
                      ? "the state is of a library in single precision, and this one is in double"
                      : "the state is of a library in double precision, and this one is in single");
  if (given.build != own.build)
    return refuse(HAPTIC_ERROR_VERSION,
                  "the state is of another build of this library; save it again with this one");
  if (given.scene != own.scene || given.words != own.words)
    return refuse(HAPTIC_ERROR_SCENE,
                  "the state is of another scene; load it into a core of the same bytes");
  if (bytes.size() != total_bytes(own.words))
    return refuse(HAPTIC_ERROR_INPUT,
                  bytes.size() < total_bytes(own.words)
                      ? "the state is cut off; give all bytes of it"
                      : "the state is followed by other bytes; give its own alone");
  if (given.content != hash_of(bytes.subspan(sizeof given)))
    return refuse(HAPTIC_ERROR_INPUT, "the state is damaged: its checksum is another one");
  const std::byte* const kinds = bytes.data() + sizeof given + sizeof(StateRest);
  const std::byte* const words = kinds + kind_bytes(own.words);
  const Ranges ranges(handle);
  for (std::size_t k = 0; k < own.words; ++k) {
    std::uint64_t word = 0;
    std::memcpy(&word, words + 8 * k, 8);
    if (kind_at(kinds, k) > Word::kOfScene || !ranges.holds(kind_at(kinds, k), word))
      return refuse(HAPTIC_ERROR_INPUT, "the state has an address outside of its core");
  }
  return HAPTIC_OK;
}

/// The bytes were checked.
void take_state(haptic_core& handle, std::span<const std::byte> bytes) noexcept {
  StateRest rest;
  std::memcpy(&rest, bytes.data() + sizeof(StateHeader), sizeof rest);
  handle.counts = rest.counts;
  handle.judge = rest.judge;
  handle.last.wrench_w = wrench_of_numbers(rest.wrench);
  handle.last.felt_wa = pose_of_numbers(rest.felt_pose);
  const std::span<std::byte> state = state_of(handle);
  const std::byte* const kinds = bytes.data() + sizeof(StateHeader) + sizeof rest;
  const std::byte* const words = kinds + kind_bytes(state.size() / 8);
  const Ranges ranges(handle);
  for (std::size_t k = 0; k < state.size() / 8; ++k) {
    std::uint64_t word = 0;
    std::memcpy(&word, words + 8 * k, 8);
    word += ranges.begin_of(kind_at(kinds, k));
    std::memcpy(state.data() + 8 * k, &word, 8);
  }
}

}  // namespace

int haptic_core_save(haptic_core* core, void* bytes, size_t capacity, size_t* count) {
  if (count == nullptr) return HAPTIC_ERROR_NULL;
  *count = 0;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  if ((*call).parts != nullptr) return HAPTIC_ERROR_PART;
  *count = total_bytes(HapticCore::state_bytes((*call).view) / 8);
  if (bytes == nullptr || capacity < *count) return HAPTIC_ERROR_SIZE;
  write_state(*call, {static_cast<std::byte*>(bytes), *count});
  return HAPTIC_OK;
}

int haptic_core_load(haptic_core* core, const void* bytes, size_t count, char* text,
                     size_t text_bytes) {
  if (text != nullptr && text_bytes == 0) return HAPTIC_ERROR_SIZE;
  if (text != nullptr) text[0] = '\0';
  if (bytes == nullptr) return HAPTIC_ERROR_NULL;
  const CoreCall call(core);
  if (call.error() != HAPTIC_OK) return call.error();
  const char* why = "a scene with parts that the hand holds or that are driven has no such state";
  const std::span<const std::byte> given(static_cast<const std::byte*>(bytes), count);
  const int error = (*call).parts != nullptr ? HAPTIC_ERROR_PART : check_state(*call, given, why);
  if (error == HAPTIC_OK) {
    take_state(*call, given);
  } else if (text != nullptr) {
    (void)std::snprintf(text, text_bytes, "%s", why);
  }
  return error;
}
