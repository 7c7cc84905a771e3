// SPDX-License-Identifier: Apache-2.0
/// Any bytes as the file of a recorded session: read to their end or refused with a place in them;
/// what was read is written to the same bytes again. First as they are, then with the check sums
/// put right, or no mutation would get beyond the first record.
#include <algorithm>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "hal/usb/bus_record.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using fuzz::require;
using Bytes = std::vector<std::uint8_t>;

std::size_t length_at(const Bytes& file, std::size_t at) {
  std::size_t length = 0;
  for (std::size_t k = 0; k < 4; ++k) length |= std::size_t{file[at + k]} << (8 * k);
  return length;
}

void seal(Bytes& file, std::size_t begin, std::size_t end) {
  const std::uint32_t check = crc32(std::span(file).subspan(begin, end - begin));
  for (std::size_t k = 0; k < 4; ++k) file[end + k] = static_cast<std::uint8_t>(check >> (8 * k));
}

/// Check sums of the header and of every record whose length lies within the file.
Bytes sealed(Bytes file) {
  std::size_t at = file.size() < 16 ? file.size() : length_at(file, 12);
  if (at < 20 || at > file.size()) return file;
  seal(file, 0, at - 4);
  while (file.size() - at >= 12) {
    const std::size_t payload = length_at(file, at);
    if (payload > file.size() - at - 12) break;
    seal(file, at, at + 8 + payload);
    at += 12 + payload;
  }
  return file;
}

/// A record written from what was read of it; empty where the kind keeps bytes that mean nothing.
Bytes again(const BusRecord& record) {
  Bytes bytes;
  if (record.kind == kTickRecord) {
    append_tick(bytes, tick_of(record));
  } else if (record.is_given()) {
    append_given(bytes, given_of(record));
  } else if (record.kind == kEndRecord) {
    append_end(bytes, end_of(record));
  } else if (record.kind == static_cast<std::uint8_t>(LinkEventKind::kClock)) {
    std::vector<std::int64_t> stamps;
    for (std::size_t k = 0; k < clock_count(record); ++k) stamps.push_back(clock_of(record, k));
    append_clocks(bytes, stamps);
  } else {
    append_event(bytes, event_of(record));
  }
  return bytes;
}

void read_all(const Bytes& file) {
  BusSession session;
  std::size_t first = 0;
  const RecordDefect header = read_header(file, session, first);
  if (!header.text.empty()) return require(header.record == 0, "the header has no number");
  require(first <= file.size(), "records begin within the file");
  require(session.driver.size() <= kMostDriverName, "names are short");
  Bytes written;
  append_header(written, session);
  BusSession same;
  std::size_t after = 0;
  require(read_header(written, same, after).text.empty() && same.driver == session.driver &&
              same.scene_hash == session.scene_hash && same.period_ns == session.period_ns,
          "what was read of a header reads back");

  BusRecordReader reader(file, first);
  BusRecord record;
  std::uint64_t count = 0;
  std::size_t at = first;
  while (reader.next(record)) {
    require(record.number == ++count && record.offset == at, "records follow each other");
    const Bytes bytes = again(record);
    require(bytes.size() == record.payload.size() + 12, "a record keeps its length");
    at += bytes.size();
    if (record.kind != kEndRecord && record.kind != kTickRecord && record.payload.size() >= 4 &&
        record.kind != static_cast<std::uint8_t>(LinkEventKind::kClock) &&
        (record.payload[2] != 0 || record.payload[3] != 0))
      continue;  // reserved
    Bytes rewritten;
    BusRecord twin;
    append_header(rewritten, session);
    const std::size_t begin = rewritten.size();
    rewritten.insert(rewritten.end(), bytes.begin(), bytes.end());
    require(BusRecordReader(rewritten, begin).next(twin) && twin.kind == record.kind,
            "what was read of a record reads back");
  }
  const RecordDefect& defect = reader.defect();
  require(defect.text.empty() ? at == file.size() : at < file.size(), "read to the end, or not");
  if (!defect.text.empty())
    require(defect.record == count + 1 && defect.offset == at, "the defect is where reading ended");
  require(!reader.next(record), "the end stays the end");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // A copy of its own, so that the sanitizer sees the first access beyond it.
  const Bytes file(data, data + size);
  read_all(file);
  read_all(sealed(file));
  return 0;
}
