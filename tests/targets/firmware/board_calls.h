/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAPTIC_BOARD_CALLS_H
#define HAPTIC_BOARD_CALLS_H
/** The calls of hal/firmware/reference_device.h as records, which a test sends to a board in an
 * emulator, and the board's answers. A call carries the device's whole state, and its answer the
 * state afterwards, so that a test may damage it in between. Both processors are little-endian and
 * lay these structures out alike; the sizes in each record are checked all the same.
 */
#include "hal/firmware/reference_device.h"

/** Larger than every record of the protocol; a longer packet is cut off, its length is not. */
enum { HAPTIC_BOARD_BYTES = 256 };

/** The functions, and the end of the board's program. */
enum {
  HAPTIC_BOARD_BEGIN = 1,
  HAPTIC_BOARD_ANSWER,
  HAPTIC_BOARD_PERIOD,
  HAPTIC_BOARD_COMMAND,
  HAPTIC_BOARD_BUS_EVENT,
  HAPTIC_BOARD_END
};

struct haptic_board_call {
  uint32_t record_bytes, device_bytes; /**< sizeof of this record and of the device's state */
  uint32_t function;
  uint32_t size; /**< of the packet, or of the room for a report or an answer */
  uint64_t now_us;
  uint32_t request_type, request, value, unused;
  struct haptic_facts facts;
  struct haptic_sample sample;
  struct haptic_device device;
  uint8_t bytes[HAPTIC_BOARD_BYTES];
};

struct haptic_board_answer {
  uint32_t record_bytes; /**< sizeof of this record; 0: the call's sizes are others than here */
  int32_t result;        /**< of the function; 0 where it has none */
  uint32_t drive_at;     /**< where haptic_device_drive points, from the device's beginning */
  uint32_t stack_bytes;  /**< that the function used, with all it calls */
  uint32_t clock_units;  /**< that it took, of the processor's clock */
  uint32_t unused;
  struct haptic_device device;
  uint8_t bytes[HAPTIC_BOARD_BYTES];
};

#endif
