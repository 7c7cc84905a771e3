/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAPTIC_TINYUSB_BOARD_H
#define HAPTIC_TINYUSB_BOARD_H
/** A haptic device of full speed on TinyUSB: the stack's side of reference_device.h. What is particular to a
 * board is behind the four functions at the end, which its author writes. */
#include "hal/firmware/reference_device.h"

/** Powers the device up: call it before tusb_init. `facts` must say is_short and a report period
 * of 1000 us or more. */
void haptic_board_begin(const struct haptic_facts* facts);

/** From the interrupt of a timer, every report period: samples, cuts what the watchdog has to cut,
 * tells the motors. Does not depend on USB. */
void haptic_board_period(void);

/** From the main loop, as often as it goes round: runs TinyUSB and offers the newest report. */
void haptic_board_poll(void);

/* The board's author writes these. */

/** Encoders at one instant, inputs, and the time since power-up. From the timer's interrupt. */
void board_sample(struct haptic_sample* sample);
/** Power stage and motors; is_on 0: the stage off. From the timer's interrupt and, with interrupts
 * held, from the main loop. A watchdog of the hardware must open the stage when this is not
 * called for the time of the facts' watchdog. */
void board_drive(const struct haptic_drive* drive);
/** The clock of board_sample. */
uint64_t board_time_us(void);
/** Holds the timer's interrupt off (1) or lets it come (0); a few microseconds at a time, and up
 * to the time of a call (README.md of reference_device.h). Not nested. */
void board_hold(int hold);

#endif
