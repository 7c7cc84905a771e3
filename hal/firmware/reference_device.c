/* SPDX-License-Identifier: Apache-2.0 */
/* Sections 3 to 10 of hal/drivers/PROTOCOL.md. Bytes are written by shifts, so that processors of
 * either byte order and without unaligned access give the same report. */
#include "hal/firmware/reference_device.h"

enum {
  REPORT_MAGIC = 0x4852,
  SHORT_REPORT_MAGIC = 0x4853,
  COMMAND_MAGIC = 0x4843,
  BLOCK_MAGIC = 0x4842,
  VERSION = 1,
  MINOR_VERSION = 1,
  BLOCK_REQUEST_TYPE = 0xc1, /* device to host, vendor, interface */
  BLOCK_REQUEST = 0x01
};

/* Faults that a board may state itself; the others follow from what happens here. */
#define STATED_FAULTS ((uint32_t)HAPTIC_FAULT_HOT | (uint32_t)HAPTIC_FAULT_DRIVE)

/* Bytes. */

static uint32_t crc32(const uint8_t* bytes, size_t size) {
  static const uint32_t of_nibble[16] = {0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu,
                                         0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
                                         0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu,
                                         0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu};
  uint32_t rest = 0xffffffffu;
  size_t k;
  for (k = 0; k < size; ++k) {
    rest = of_nibble[(rest ^ bytes[k]) & 15u] ^ rest >> 4;
    rest = of_nibble[(rest ^ (uint32_t)bytes[k] >> 4) & 15u] ^ rest >> 4;
  }
  return ~rest;
}

/* Each returns the place behind what it wrote. */
static uint8_t* put8(uint8_t* at, uint32_t value) {
  at[0] = (uint8_t)(value & 0xffu);
  return at + 1;
}
static uint8_t* put16(uint8_t* at, uint32_t value) { return put8(put8(at, value), value >> 8); }
static uint8_t* put32(uint8_t* at, uint32_t value) { return put16(put16(at, value), value >> 16); }
static uint8_t* put_vector(uint8_t* at, const int32_t* v, int count) {
  int k;
  for (k = 0; k < count; ++k) at = put32(at, (uint32_t)v[k]);
  return at;
}
/* The record from `begin` to `at` is complete but for its check sum. @return its length. */
static size_t closed(uint8_t* begin, uint8_t* at) {
  const size_t size = (size_t)(at - begin);
  return (size_t)(put32(at, crc32(begin, size)) - begin);
}

static uint32_t get16(const uint8_t* at) { return (uint32_t)at[0] | (uint32_t)at[1] << 8; }
static uint32_t get32(const uint8_t* at) { return get16(at) | get16(at + 2) << 16; }
/* C99 leaves the conversion of a large unsigned number to the compiler. */
static int32_t signed_of(uint32_t bits) {
  return bits <= 0x7fffffffu ? (int32_t)bits : -(int32_t)(~bits) - 1;
}

/* Numbers. */

static uint64_t magnitude(int32_t value) {
  return value < 0 ? (uint64_t)(-(int64_t)value) : (uint64_t)value;
}
static int32_t with_sign_of(int32_t sign, uint64_t size) {
  return sign < 0 ? (int32_t)(-(int64_t)size) : (int32_t)size;
}

/* Largest whole number whose square is not above `square`: one bit a turn, 32 turns. */
static uint32_t root_of(uint64_t square) {
  uint64_t root = 0;
  int bit;
  for (bit = 31; bit >= 0; --bit) {
    const uint64_t next = root | (uint64_t)1 << bit;
    if (next * next <= square) root = next;
  }
  return (uint32_t)root;
}

static int is_newer(uint32_t sequence, uint32_t last) {
  const uint32_t ahead = sequence - last;
  return ahead != 0 && ahead < 0x80000000u;
}

/* `v` shortened as a whole to `limit`. Each component is rounded towards zero, after the norm was
 * rounded up: the result is never beyond the limit, and within 2 units of the exact one on each
 * axis. 3 * 2^62 is the largest square: 64 bits hold it. */
static void shorten(int32_t out[3], const int32_t v[3], uint32_t limit) {
  uint64_t square = 0;
  int k;
  for (k = 0; k < 3; ++k) {
    out[k] = v[k];
    square += magnitude(v[k]) * magnitude(v[k]);
  }
  if (square > (uint64_t)limit * limit) {
    const uint64_t norm = (uint64_t)root_of(square) + 1;
    for (k = 0; k < 3; ++k) out[k] = with_sign_of(v[k], magnitude(v[k]) * limit / norm);
  }
}

/* Three numbers of a command, without the axes that are not driven. */
static void get_driven(int32_t out[3], const uint8_t* bytes, uint32_t driven) {
  int k;
  for (k = 0; k < 3; ++k) out[k] = (driven >> k & 1u) != 0 ? signed_of(get32(bytes + 4 * k)) : 0;
}

/* State. */

static void drives_off(struct haptic_device* device) {
  int k;
  device->drive.is_on = 0;
  device->slewed_us = 0;
  for (k = 0; k < 3; ++k) {
    device->drive.force[k] = device->drive.torque[k] = 0;
    device->asked_force[k] = device->asked_torque[k] = 0;
  }
}

/* Largest force or torque that the motors may have by now: from zero when the drives go on it grows
 * at the stated rate, or to all of it in half of the watchdog's time where none is stated. `units`:
 * microseconds in which a rate of 1 is 1 unit. */
static uint32_t slewed_limit(const struct haptic_device* device, uint32_t limit, uint32_t rate,
                             uint32_t units) {
  const uint32_t watchdog_ms = device->facts.watchdog_ms;
  const uint64_t grown = rate != 0 ? (uint64_t)rate * device->slewed_us / units
                                   : (uint64_t)limit * device->slewed_us /
                                         (watchdog_ms != 0 ? 500u * watchdog_ms : 1u);
  return grown < limit ? (uint32_t)grown : limit;
}
static uint32_t force_limit(const struct haptic_device* device) {
  const struct haptic_facts* facts = &device->facts;
  return slewed_limit(device, facts->max_force, facts->max_force_rate_mn_per_s, 10000u);
}
static uint32_t torque_limit(const struct haptic_device* device) {
  const struct haptic_facts* facts = &device->facts;
  return slewed_limit(device, facts->max_torque, facts->max_torque_rate_mnm_per_s, 100u);
}

static int is_slewing(const struct haptic_device* device) {
  const struct haptic_facts* facts = &device->facts;
  return device->drive.is_on &&
         (force_limit(device) < facts->max_force || torque_limit(device) < facts->max_torque);
}

/* The motors get what was asked for, within what they may have by now. */
static void exert(struct haptic_device* device) {
  shorten(device->drive.force, device->asked_force, force_limit(device));
  shorten(device->drive.torque, device->asked_torque, torque_limit(device));
}

/* A period has passed with the drives on. */
static void slew(struct haptic_device* device) {
  if (!device->drive.is_on) return;
  if (device->slewed_us < 0x80000000u) device->slewed_us += device->facts.report_period_us;
  exert(device);
}

void haptic_device_begin(struct haptic_device* device, const struct haptic_facts* facts) {
  device->facts = *facts;
  drives_off(device);
  device->fed_us = 0;
  device->sequence = device->accepted = device->tick = device->rejected = 0;
  device->faults = 0;
  device->is_fresh = 1;
  device->is_cut = device->is_stopped = device->stop_is_pressed = 0;
  device->is_calibrated = device->was_calibrated = device->is_fatal = 0;
  device->twist_is_valid = device->minor = 0;
}

const struct haptic_drive* haptic_device_drive(const struct haptic_device* device) {
  return &device->drive;
}

/* Who comes next has not asked yet. */
void haptic_device_bus_event(struct haptic_device* device) {
  drives_off(device);
  device->minor = 0;
}

/* A command may be stamped later than the sample of the period that it interrupts, by a little: the
 * distance counts, not its sign, so that a clock that jumps back cuts instead of waiting. */
static int is_starved(const struct haptic_device* device, uint64_t now_us) {
  const uint64_t apart =
      now_us >= device->fed_us ? now_us - device->fed_us : device->fed_us - now_us;
  return apart >= (uint64_t)device->facts.watchdog_ms * 1000u;
}

static void take(struct haptic_device* device, const struct haptic_sample* sample) {
  device->stop_is_pressed = sample->stop_is_pressed != 0;
  device->is_calibrated = sample->is_calibrated != 0;
  device->is_fatal = sample->is_fatal != 0;
  device->twist_is_valid = device->facts.twist_sensed && !sample->twist_is_missing;
  if (device->is_calibrated) device->was_calibrated = 1;
  if (device->stop_is_pressed) device->is_stopped = 1;
  if (device->is_stopped || !device->is_calibrated || device->is_fatal) drives_off(device);
  if (device->drive.is_on && is_starved(device, sample->time_us)) {
    device->is_cut = 1;
    drives_off(device);
  }
  device->faults = sample->faults & STATED_FAULTS;
  if (device->is_fatal) device->faults |= HAPTIC_FAULT_DRIVE;
  if (device->is_stopped) device->faults |= HAPTIC_FAULT_STOP;
  if (device->is_cut) device->faults |= HAPTIC_FAULT_CUT;
  if (device->was_calibrated && !device->is_calibrated) device->faults |= HAPTIC_FAULT_NOT_HOMED;
}

static uint32_t status_of(const struct haptic_device* device) {
  uint32_t status = 0;
  if (device->is_calibrated) status |= HAPTIC_CALIBRATED;
  if (device->drive.is_on) status |= HAPTIC_DRIVES_ON;
  if (device->twist_is_valid) status |= HAPTIC_TWIST_VALID;
  if (device->is_cut) status |= HAPTIC_WATCHDOG_CUT;
  if (device->is_stopped) status |= HAPTIC_EMERGENCY_STOP;
  if (device->minor != 0 && is_slewing(device)) status |= HAPTIC_SLEWING;
  return status;
}

/* Field of the gripper in steps of so many um: one more than the gap, so that 0 is left for none.
 */
static uint32_t gripper_of(const struct haptic_device* device, const struct haptic_sample* sample,
                           uint32_t step) {
  const uint32_t largest = device->facts.largest_gap_um;
  if (device->minor == 0 || largest == 0 || !sample->gap_is_measured) return 0;
  return 1u + (sample->gap_um < largest ? sample->gap_um : largest) / step;
}

/* Reports. */

static uint8_t* put_head(uint8_t* at, const struct haptic_device* device, uint32_t magic) {
  at = put8(put16(at, magic), VERSION);
  return put32(put8(at, status_of(device)), device->sequence);
}

static size_t put_report(const struct haptic_device* device, const struct haptic_sample* sample,
                         uint8_t* report) {
  static const int32_t at_rest[3] = {0, 0, 0};
  const int senses = device->twist_is_valid;
  uint8_t* at = put_head(report, device, REPORT_MAGIC);
  at = put32(at, (uint32_t)(sample->time_us & 0xffffffffu));
  at = put32(at, (uint32_t)(sample->time_us >> 32));
  at = put_vector(at, sample->position_nm, 3);
  at = put_vector(at, sample->orientation, 4);
  at = put_vector(at, senses ? sample->velocity_um_per_s : at_rest, 3);
  at = put_vector(at, senses ? sample->angular_velocity_urad_per_s : at_rest, 3);
  at = put32(at, sample->switches);
  at = put32(at, device->faults);
  at = put32(at, device->tick);
  at = put32(at, device->rejected);
  at = put32(at, device->accepted);
  return closed(report, put32(at, gripper_of(device, sample, 1u)));
}

/* x y z of the unit quaternion with w >= 0 that turns as `q` does. The host computes w from them,
 * so a length that is off by the 1e-3 of section 2 is taken away here. Off by more, it is no
 * orientation: three numbers that the host refuses. */
static void shorten_orientation(int32_t out[3], const int32_t q[4]) {
  const uint64_t unit = (uint64_t)1 << 30, slack = unit / 1000;
  uint64_t square = 0, norm;
  int k;
  for (k = 0; k < 4; ++k) {
    const uint64_t size = magnitude(q[k]);
    if (size <= unit + slack)
      square += size * size;
    else
      square = (uint64_t)1 << 62;
  }
  norm = root_of(square);
  if (square - norm * norm > norm) ++norm; /* the nearest one */
  for (k = 0; k < 3; ++k) {
    const int32_t sign = (q[k] < 0) != (q[3] < 0) ? -1 : 1;
    out[k] = norm >= unit - slack && norm <= unit + slack
                 ? with_sign_of(sign, (magnitude(q[k]) * unit + norm / 2) / norm)
                 : 0x7fffffff;
  }
}

/* Nearest multiple of `step`, counted in steps, at the end of the range where it goes beyond. */
static uint32_t steps_of(int32_t value, uint32_t step) {
  const uint64_t steps = (magnitude(value) + step / 2) / step;
  return (uint32_t)with_sign_of(value, steps < 32767u ? steps : 32767u);
}

static int has_gripper(const struct haptic_device* device) {
  return device->minor != 0 && device->facts.largest_gap_um != 0;
}

static size_t put_short_report(const struct haptic_device* device,
                               const struct haptic_sample* sample, uint8_t* report) {
  const int senses = device->twist_is_valid;
  int32_t orientation[3];
  uint8_t* at = put_head(report, device, SHORT_REPORT_MAGIC);
  int k;
  shorten_orientation(orientation, sample->orientation);
  at = put32(at, (uint32_t)(sample->time_us & 0xffffffffu));
  at = put_vector(at, sample->position_nm, 3);
  at = put_vector(at, orientation, 3);
  for (k = 0; k < 3; ++k) at = put16(at, senses ? steps_of(sample->velocity_um_per_s[k], 100) : 0);
  for (k = 0; k < 3; ++k)
    at = put16(at, senses ? steps_of(sample->angular_velocity_urad_per_s[k], 1000) : 0);
  at = put16(at, sample->switches);
  at = put8(put8(at, device->faults), device->rejected);
  at = put32(at, device->accepted);
  if (has_gripper(device)) {
    const uint32_t gripper = gripper_of(device, sample, 10u);
    at = put16(at, gripper < 0xffffu ? gripper : 0xffffu);
  }
  return closed(report, at);
}

static size_t report_bytes(const struct haptic_device* device) {
  if (!device->facts.is_short) return HAPTIC_REPORT_BYTES;
  return has_gripper(device) ? HAPTIC_SHORT_GRIPPER_BYTES : HAPTIC_SHORT_REPORT_BYTES;
}

size_t haptic_device_period(struct haptic_device* device, const struct haptic_sample* sample,
                            uint8_t* report, size_t size) {
  const size_t needed = report_bytes(device);
  size_t written = 0;
  take(device, sample);
  slew(device);
  if (size >= needed) {
    written = device->facts.is_short ? put_short_report(device, sample, report)
                                     : put_report(device, sample, report);
  }
  ++device->sequence;
  return written;
}

/* Commands. */

/* Length, magic, version, check sum, reserved bytes and bits: section 7. */
static int is_command(const uint8_t* bytes, size_t size) {
  uint32_t reserved;
  int k;
  if (size != HAPTIC_COMMAND_BYTES) return 0;
  reserved = bytes[3] & 0xfeu;
  for (k = 36; k < 52; ++k) reserved |= bytes[k];
  return get16(bytes) == COMMAND_MAGIC && bytes[2] == VERSION && reserved == 0 &&
         get32(bytes + 52) == crc32(bytes, 52);
}

static int may_drive(const struct haptic_device* device) {
  return device->is_calibrated && !device->is_fresh && !device->is_cut && !device->is_stopped &&
         !device->is_fatal;
}

int32_t haptic_device_command(struct haptic_device* device, const uint8_t* bytes, size_t size,
                              uint64_t now_us) {
  if (!is_command(bytes, size) || !is_newer(get32(bytes + 4), device->accepted)) {
    ++device->rejected;
    return 0;
  }
  device->accepted = get32(bytes + 4);
  device->tick = get32(bytes + 8);
  device->fed_us = now_us;
  if ((bytes[3] & 1u) == 0) {
    drives_off(device);
    device->is_fresh = device->is_cut = 0;
    device->is_stopped = device->stop_is_pressed;
  } else if (may_drive(device)) {
    get_driven(device->asked_force, bytes + 12, device->facts.driven_dof);
    get_driven(device->asked_torque, bytes + 24, (uint32_t)device->facts.driven_dof >> 3);
    device->drive.is_on = 1;
    exert(device);
  }
  return 1;
}

/* Capability block. */

/* 24 bytes, the last of them 0 in any case. */
static uint8_t* put_name(uint8_t* at, const char* name) {
  int k, ended = 0;
  for (k = 0; k < HAPTIC_MOST_LETTERS; ++k) {
    ended = ended || name[k] == 0;
    at = put8(at, ended ? 0u : name[k] >= 0x20 && name[k] <= 0x7e ? (uint32_t)name[k] : 0x3fu);
  }
  return put8(at, 0u);
}

static uint8_t* put_long_part(uint8_t* at, const struct haptic_facts* facts) {
  at = put16(put8(put8(at, MINOR_VERSION), facts->is_displacement != 0), 0);
  at = put32(put32(at, facts->latency_us), facts->largest_gap_um);
  return put_name(put_name(put32(at, 0), facts->name), facts->serial);
}

int32_t haptic_device_answer(struct haptic_device* device, uint8_t request_type, uint8_t request,
                             uint16_t value, uint8_t* room, size_t size) {
  const struct haptic_facts* facts = &device->facts;
  uint8_t* at = room;
  if (request_type != BLOCK_REQUEST_TYPE || request != BLOCK_REQUEST || value != VERSION ||
      size < HAPTIC_BLOCK_BYTES)
    return -1;
  at = put8(put16(at, BLOCK_MAGIC), VERSION);
  at = put8(at, facts->twist_sensed != 0);
  at = put8(put8(at, facts->sensed_dof), facts->driven_dof);
  at = put16(put16(at, facts->report_period_us), facts->watchdog_ms);
  at = put16(at, 0);
  at = put32(put32(at, facts->max_force), facts->max_torque);
  at = put32(put32(at, facts->max_force_rate_mn_per_s), facts->max_torque_rate_mnm_per_s);
  at = put32(put32(at, facts->max_stiffness_mn_per_m), facts->max_damping_mns_per_m);
  at = put32(put32(at, facts->mass_mg), facts->damping_uns_per_m);
  at = put32(at, facts->friction);
  at = put32(put32(at, facts->encoder_step_nm), facts->encoder_step_nrad);
  at = put32(at, facts->workspace_radius_um);
  device->minor = size >= HAPTIC_LONG_BLOCK_BYTES ? MINOR_VERSION : 0;
  return (int32_t)closed(room, device->minor != 0 ? put_long_part(at, facts) : at);
}
