/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAPTIC_REFERENCE_DEVICE_H
#define HAPTIC_REFERENCE_DEVICE_H
/** The device's side of the protocol of the reference device (hal/drivers/PROTOCOL.md), for the
 * firmware of a board and for programs that stand for a device. C99, freestanding: no heap, no
 * floating point, no library, no loop without a bound. Six functions; numbers in the units of the
 * protocol, in the byte order of the processor.
 *
 * Owner: one context at a time. Where the bus interrupts the period, one of them runs above the
 * other, or both mask interrupts for the call: README.md says how long each takes.
 */
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  HAPTIC_REPORT_BYTES = 96,        /**< of high speed: 8 kHz, one packet */
  HAPTIC_SHORT_REPORT_BYTES = 60,  /**< of full speed: 1 kHz, one packet of 64 bytes */
  HAPTIC_SHORT_GRIPPER_BYTES = 62, /**< the same with a gripper, for a host of 1.1 */
  HAPTIC_COMMAND_BYTES = 56,
  HAPTIC_BLOCK_BYTES = 64,       /**< of version 1.0 */
  HAPTIC_LONG_BLOCK_BYTES = 128, /**< of version 1.1 */
  HAPTIC_MOST_LETTERS = 23       /**< of a name */
};

/** Bits of a report's status: section 3. */
enum {
  HAPTIC_CALIBRATED = 1 << 0,
  HAPTIC_DRIVES_ON = 1 << 1,
  HAPTIC_TWIST_VALID = 1 << 2,
  HAPTIC_WATCHDOG_CUT = 1 << 3,
  HAPTIC_EMERGENCY_STOP = 1 << 4,
  HAPTIC_SLEWING = 1 << 5
};

/** Bits of a report's faults: section 3. */
enum {
  HAPTIC_FAULT_STOP = 1 << 0,
  HAPTIC_FAULT_CUT = 1 << 1,
  HAPTIC_FAULT_HOT = 1 << 2,
  HAPTIC_FAULT_DRIVE = 1 << 3,
  HAPTIC_FAULT_NOT_HOMED = 1 << 4
};

/** Statement of the device about itself: section 5, in its units. */
struct haptic_facts {
  uint8_t twist_sensed, sensed_dof, driven_dof;
  uint8_t is_short; /**< not 0: reports of 60 bytes */
  uint16_t report_period_us, watchdog_ms;
  uint32_t max_force, max_torque; /**< 10 uN; 0.1 uN m */
  uint32_t max_force_rate_mn_per_s, max_torque_rate_mnm_per_s;
  uint32_t max_stiffness_mn_per_m, max_damping_mns_per_m;
  uint32_t mass_mg, damping_uns_per_m, friction; /**< friction: 10 uN */
  uint32_t encoder_step_nm, encoder_step_nrad, workspace_radius_um;
  /* Added by version 1.1. */
  uint8_t is_displacement;   /**< the pose is what the board integrates of a displacement */
  uint32_t latency_us;       /**< of its own, from a sample to the begin of its wrench */
  uint32_t largest_gap_um;   /**< of the gripper; 0: none is measured */
  char name[24], serial[24]; /**< printable ASCII, zeros behind it; empty: not stated */
};

/** Sample of the board, all at one instant. */
struct haptic_sample {
  uint64_t time_us;
  int32_t position_nm[3]; /**< of the handle point, in D */
  int32_t orientation[4]; /**< x y z w, handle to D, unit 2^-30 */
  int32_t velocity_um_per_s[3], angular_velocity_urad_per_s[3];
  uint32_t switches;
  uint32_t faults;          /**< HAPTIC_FAULT_HOT, _DRIVE: what the board knows itself */
  uint32_t gap_um;          /**< of the gripper, where gap_is_measured */
  uint8_t gap_is_measured;  /**< in this sample */
  uint8_t twist_is_missing; /**< in this sample, of a device that senses it otherwise */
  uint8_t is_calibrated;    /**< position and orientation are absolute and true */
  uint8_t stop_is_pressed;  /**< the emergency stop's input */
  uint8_t is_fatal;         /**< drives must be off: poses or currents cannot be trusted */
};

/** Task of the motors until the next call. */
struct haptic_drive {
  uint8_t is_on;     /**< 0: power stage off */
  int32_t force[3];  /**< at the handle point, D axes, as it acts on the hand [10 uN] */
  int32_t torque[3]; /**< about the handle point [0.1 uN m] */
};

/** Memory of the six functions; nothing in it is for others. */
struct haptic_device {
  struct haptic_facts facts;
  struct haptic_drive drive;
  int32_t asked_force[3], asked_torque[3];
  uint32_t slewed_us; /**< since the drives went on */
  uint64_t fed_us;
  uint32_t sequence, accepted, tick, rejected, faults;
  uint8_t is_fresh, is_cut, is_stopped, stop_is_pressed, is_calibrated, was_calibrated, is_fatal,
      twist_is_valid, minor; /**< of the version that the host speaks */
};

/** Power-up: drives off, counters 0, no force before a command without the drives' bit. */
void haptic_device_begin(struct haptic_device* device, const struct haptic_facts* facts);

/** Answers a control request (section 5), whose wLength is `size`: from 128 on the host speaks 1.1,
 * and reports have what that adds. @return bytes of the answer in `room`; negative: stall */
int32_t haptic_device_answer(struct haptic_device* device, uint8_t request_type, uint8_t request,
                             uint16_t value, uint8_t* room, size_t size);

/** Every period, from the timer: takes the sample, cuts the drives that no command has fed for the
 * watchdog's time, writes the report. @return its bytes, 0: `size` is too small for it, all else is
 * done. Without this call nothing cuts: an independent watchdog of the board opens the power stage
 * when the timer stops. */
size_t haptic_device_period(struct haptic_device* device, const struct haptic_sample* sample,
                            uint8_t* report, size_t size);

/** A packet at the command's endpoint, at `now_us` of the sample's clock. Force and torque are each
 * shortened as a whole to the facts' limits, rounded towards zero, within 2 units of the exact
 * component; axes that are not driven get 0. When the drives go on the limits are zero, and grow
 * with each period at the facts' rates (0: to all of it in half of the watchdog's time): no command
 * is a step of force, however late it comes. @return 1: accepted, 0: it is counted as rejected and
 * changes nothing else. */
int32_t haptic_device_command(struct haptic_device* device, const uint8_t* bytes, size_t size,
                              uint64_t now_us);

/** Task of the motors now: read it after each of the calls above and below. Never beyond facts'
 * limits. */
const struct haptic_drive* haptic_device_drive(const struct haptic_device* device);

/** Reset, suspend, SET_CONFIGURATION, SET_INTERFACE, the host has gone: drives off. */
void haptic_device_bus_event(struct haptic_device* device);

#ifdef __cplusplus
}
#endif
#endif
