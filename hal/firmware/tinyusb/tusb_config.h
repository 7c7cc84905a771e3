/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAPTIC_TUSB_CONFIG_H
#define HAPTIC_TUSB_CONFIG_H
/* TinyUSB for tinyusb_board.c: a device of full speed without any of the stack's own classes. The
 * build of a board states CFG_TUSB_MCU. */
#ifndef CFG_TUSB_MCU
#error "state the processor: -DCFG_TUSB_MCU=OPT_MCU_.., as in TinyUSB's tusb_option.h"
#endif
#ifndef CFG_TUSB_OS
#define CFG_TUSB_OS OPT_OS_NONE
#endif
#define CFG_TUD_ENABLED 1
#define CFG_TUD_MAX_SPEED OPT_MODE_FULL_SPEED
#define CFG_TUSB_RHPORT0_MODE (OPT_MODE_DEVICE | OPT_MODE_FULL_SPEED)
#define CFG_TUD_ENDPOINT0_SIZE 64
#endif
