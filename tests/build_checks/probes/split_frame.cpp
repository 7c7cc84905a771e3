// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: one frame of a little more than the limit, in the rare part of a
// function. g++ inlines the common part where it is called and keeps the rare one by itself, under
// a number.
void fill(int* first);

namespace samples {
namespace {

struct Search {
  int known = 0;
  int search_fully(int value);
};

int Search::search_fully(int value) {
  if (known > value) return known;
  int room[1100];
  fill(room);
  fill(room + value);
  known = room[value] + room[0];
  return known;
}

}  // namespace

int first_of(int value) {
  Search search{value / 2};
  return search.search_fully(value) + search.search_fully(value + 1) +
         search.search_fully(2 * value);
}

}  // namespace samples
