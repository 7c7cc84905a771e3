// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "hal/drivers/hid_descriptor.hpp"
#include "tests/support/spacemouse_counterpart.hpp"

using namespace haptic::hal;
using haptic::test::spacemouse_descriptor;

namespace {

using Bytes = std::vector<std::uint8_t>;

HidVerdict verdict_of(const Bytes& bytes) {
  HidAxes axes;
  return find_hid_axes(bytes, axes);
}

HidAxes axes_of(const Bytes& bytes) {
  HidAxes axes;
  REQUIRE(find_hid_axes(bytes, axes) == HidVerdict::kOk);
  return axes;
}

}  // namespace

TEST_SUITE("hal.hid_descriptor") {
  TEST_CASE("find_hid_axes: six axes in one report or in two, with their ranges and places") {
    for (const bool joined : {false, true}) {
      for (const std::int16_t range : {std::int16_t{350}, std::int16_t{500}, std::int16_t{32767}}) {
        const HidAxes found = axes_of(spacemouse_descriptor(range, joined));
        for (std::size_t i = 0; i < kHidAxes; ++i) {
          const HidAxis& axis = found.axes[i];
          CAPTURE(i);
          CHECK(axis.found);
          CHECK(axis.logical_min == -range);
          CHECK(axis.logical_max == range);
          CHECK(axis.bit_size == 16);
          CHECK(axis.report_id == (joined || i < 3 ? 1 : 2));
          CHECK(axis.bit_offset == 16 * (joined ? i : i % 3));
          CHECK(full_scale(axis) == range);
        }
      }
    }
  }

  TEST_CASE("find_hid_axes: a mouse has X and Y behind its buttons, no further axis") {
    // The boot mouse of the class definition, appendix B.2, without report numbers.
    const Bytes mouse{0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0x09, 0x01, 0xa1, 0x00, 0x05, 0x09, 0x19,
                      0x01, 0x29, 0x03, 0x15, 0x00, 0x25, 0x01, 0x95, 0x03, 0x75, 0x01, 0x81, 0x02,
                      0x95, 0x01, 0x75, 0x05, 0x81, 0x01, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x15,
                      0x81, 0x25, 0x7f, 0x75, 0x08, 0x95, 0x02, 0x81, 0x06, 0xc0, 0xc0};
    const HidAxes found = axes_of(mouse);
    CHECK(found.axes[0].bit_offset == 8);
    CHECK(found.axes[1].bit_offset == 16);
    CHECK(found.axes[1].logical_min == -127);
    CHECK(found.axes[1].logical_max == 127);
    CHECK(found.axes[1].report_id == 0);
    for (std::size_t i = 2; i < kHidAxes; ++i) CHECK(!found.axes[i].found);
    CHECK(full_scale(found.axes[2]) == 0.0);
  }

  TEST_CASE("find_hid_axes: usage ranges, full usages, pushes, long items, unsigned ranges") {
    // Usage minimum X to maximum Rz; the largest value 255 is unsigned, as the least is not below
    // 0.
    CHECK(full_scale(axes_of({0x05, 0x01, 0x19, 0x30, 0x29, 0x35, 0x15, 0x00, 0x25, 0xff, 0x75,
                              0x08, 0x95, 0x06, 0x81, 0x02})
                         .axes[5]) == 255.0);
    // Z by a usage that carries its page, while another page is set.
    CHECK(axes_of({0x05, 0x09, 0x0b, 0x32, 0x00, 0x01, 0x00, 0x15, 0x80, 0x25, 0x7f, 0x75, 0x08,
                   0x95, 0x01, 0x81, 0x02})
              .axes[2]
              .found);
    // A push keeps the range, the pop brings it back; a long item lies between.
    const HidAxes pushed = axes_of({0x05, 0x01, 0x15, 0x9c, 0x25, 0x64, 0x75, 0x08, 0x95, 0x01,
                                    0xa4, 0x15, 0x00, 0x25, 0x01, 0x09, 0x30, 0x81, 0x02, 0xfe,
                                    0x03, 0x00, 0xaa, 0xbb, 0xcc, 0xb4, 0x09, 0x31, 0x81, 0x02});
    CHECK(full_scale(pushed.axes[0]) == 1.0);
    CHECK(full_scale(pushed.axes[1]) == 100.0);
    CHECK(pushed.axes[1].bit_offset == 8);
  }

  TEST_CASE("find_hid_axes: constants, arrays, outputs and empty ranges are no axes") {
    const auto with_main = [](std::uint8_t main, std::uint8_t flags, std::uint8_t most) {
      return axes_of(
          {0x05, 0x01, 0x15, 0x00, 0x25, most, 0x75, 0x08, 0x95, 0x01, 0x09, 0x30, main, flags});
    };
    CHECK(with_main(0x81, 0x02, 0x7f).axes[0].found);
    CHECK(!with_main(0x81, 0x03, 0x7f).axes[0].found);  // constant
    CHECK(!with_main(0x81, 0x00, 0x7f).axes[0].found);  // array
    CHECK(!with_main(0x91, 0x02, 0x7f).axes[0].found);  // output
    CHECK(!with_main(0xb1, 0x02, 0x7f).axes[0].found);  // feature
    CHECK(!with_main(0x81, 0x02, 0x00).axes[0].found);  // nothing between least and most
  }

  TEST_CASE("find_hid_axes: damage is reported, and what was found before it stays") {
    const Bytes good = spacemouse_descriptor(350, false);
    CHECK(verdict_of(good) == HidVerdict::kOk);
    CHECK(verdict_of({}) == HidVerdict::kOk);
    CHECK(verdict_of({0xc0}) == HidVerdict::kBadNesting);
    CHECK(verdict_of({0xb4}) == HidVerdict::kBadNesting);
    CHECK(verdict_of({0xa1, 0x01}) == HidVerdict::kBadNesting);
    CHECK(verdict_of(Bytes(9, 0xa4)) == HidVerdict::kBadNesting);
    CHECK(verdict_of({0x26, 0x01}) == HidVerdict::kTruncated);
    CHECK(verdict_of({0xfe}) == HidVerdict::kTruncated);
    CHECK(verdict_of({0xfe, 0x02, 0x00, 0x01}) == HidVerdict::kTruncated);
    CHECK(verdict_of(Bytes(kMaxHidDescriptorBytes + 1, 0)) == HidVerdict::kTooLong);
    int cut_short = 0;
    for (std::size_t length = 0; length < good.size(); ++length) {
      HidAxes axes;
      const Bytes part(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length));
      const HidVerdict verdict = find_hid_axes(part, axes);
      if (length > 4) CHECK(verdict != HidVerdict::kOk);  // a collection stays open
      cut_short += axes.axes[0].found && !axes.axes[5].found ? 1 : 0;
    }
    CHECK(cut_short > 5);
  }

  TEST_CASE("find_hid_axes: sizes and counts that overflow a report end it, nothing else") {
    // 2^31 fields of 2^31 bits, then X: where it lies cannot be said.
    const HidAxes axes =
        axes_of({0x05, 0x01, 0x15, 0x00, 0x25, 0x7f, 0x77, 0x00, 0x00, 0x00, 0x80, 0x97,
                 0x00, 0x00, 0x00, 0x80, 0x81, 0x02, 0x75, 0x14, 0x96, 0xff, 0xff, 0x81,
                 0x02, 0x81, 0x02, 0x75, 0x08, 0x95, 0x01, 0x09, 0x30, 0x81, 0x02});
    CHECK(!axes.axes[0].found);
  }
}
