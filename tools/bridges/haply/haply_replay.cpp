// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/haply/haply_replay.hpp"

#include <array>
#include <string>
#include <string_view>

#include "tools/bridges/haply/haply_messages.hpp"
#include "tools/bridges/haply/haply_session.hpp"

namespace haptic::tools {
namespace {

using hal::TapKind;

constexpr std::array kMessageKinds = {TapKind::kMessage, TapKind::kChosen, TapKind::kParsed};

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Three lines.
HaplyChoice choice_of(const std::string& text) {
  const std::size_t first = text.find('\n');
  const std::size_t second = first == std::string::npos ? first : text.find('\n', first + 1);
  if (second == std::string::npos) return {text, "", ""};
  return {text.substr(0, first), text.substr(first + 1, second - first - 1),
          text.substr(second + 1)};
}

}  // namespace

ReplayResult replay_haply(Recording& recording) {
  ReplayTap tap(recording, kMessageKinds);
  HaplyChoice choice;
  HaplyState state;
  HaplyReport report;
  std::string message;
  while (const RecordEntry* const entry = tap.next()) {
    if (entry->kind == TapKind::kMessage) {
      if (!entry->received.empty()) message = text_of(entry->received);
    } else if (entry->kind == TapKind::kChosen) {
      choice = choice_of(text_of(entry->received));
      state = {};
      report = {};
      HaplyInventory inventory;
      if (read_haply_inventory(message, inventory) != HaplyVerdict::kOk)
        tap.diverge("the first message is read as no inventory");
    } else {
      const HaplyVerdict verdict = read_haply_state(message, choice, state);
      if (verdict == HaplyVerdict::kOk) put_state(state, report);
      if (static_cast<std::int64_t>(verdict) != entry->result)
        tap.diverge(std::string("the message before: ") + to_text(verdict));
      tap.compare(parsed_bytes(report), entry->received);
    }
  }
  return tap.result();
}

}  // namespace haptic::tools
