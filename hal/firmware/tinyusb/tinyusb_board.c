/* SPDX-License-Identifier: Apache-2.0 */
/* A class driver of TinyUSB for the interface of section 1 of hal/drivers/PROTOCOL.md. Its own
 * vendor class does not do: it takes a stream, and here a transfer is one report or one command. */
#include "hal/firmware/tinyusb/tinyusb_board.h"

#include <device/usbd_pvt.h>
#include <string.h>
#include <tusb.h>

enum { REPORT_ENDPOINT = 0x81, COMMAND_ENDPOINT = 0x01, REPORT_PACKET = 64, NO_INTERFACE = 0xff };

static struct haptic_device device;

/* Of the timer's interrupt: the newest report, and how many there were. */
static uint8_t newest[HAPTIC_SHORT_REPORT_BYTES];
static size_t newest_bytes;
static uint32_t newest_number;

/* Of the main loop. The stack's own buffers must be where its DMA can reach them. */
CFG_TUD_MEM_SECTION CFG_TUD_MEM_ALIGN static uint8_t report_out[REPORT_PACKET];
CFG_TUD_MEM_SECTION CFG_TUD_MEM_ALIGN static uint8_t command_in[HAPTIC_COMMAND_BYTES];
static uint8_t block_out[HAPTIC_BLOCK_BYTES];
static uint32_t offered_number;
static uint8_t is_open, port;

/* Descriptors: section 1, full speed. */

static const uint8_t device_descriptor[] = {0x12, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x40, 0x09,
                                            0x12, 0x01, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01};
static const uint8_t configuration[] = {0x09, 0x02, 0x20, 0x00, 0x01, 0x01, 0x00, 0xc0,
                                        0x00, 0x09, 0x04, 0x00, 0x00, 0x02, 0xff, 0x00,
                                        0x00, 0x00, 0x07, 0x05, 0x81, 0x03, 0x40, 0x00,
                                        0x01, 0x07, 0x05, 0x01, 0x03, 0x38, 0x00, 0x01};

uint8_t const* tud_descriptor_device_cb(void) { return device_descriptor; }
uint8_t const* tud_descriptor_configuration_cb(uint8_t index) {
  return index == 0 ? configuration : NULL;
}
uint16_t const* tud_descriptor_string_cb(uint8_t index, uint16_t language) {
  (void)index;
  (void)language;
  return NULL; /* a stall: there are none */
}

/* The device, which timer and main loop share. */

void haptic_board_begin(const struct haptic_facts* facts) {
  haptic_device_begin(&device, facts);
  board_drive(haptic_device_drive(&device));
}

void haptic_board_period(void) {
  struct haptic_sample sample;
  memset(&sample, 0, sizeof sample);
  board_sample(&sample);
  newest_bytes = haptic_device_period(&device, &sample, newest, sizeof newest);
  ++newest_number;
  board_drive(haptic_device_drive(&device));
}

static void bus_event(void) {
  board_hold(1);
  haptic_device_bus_event(&device);
  board_drive(haptic_device_drive(&device));
  board_hold(0);
}

/* The newest report, once the one before has been fetched: what was handed to the stack cannot be
 * taken back, so the host may find one that is a period old after it was away. */
static void offer_report(void) {
  size_t bytes = 0;
  if (!is_open || !usbd_edpt_claim(port, REPORT_ENDPOINT)) return;
  board_hold(1);
  if (newest_number != offered_number) {
    bytes = newest_bytes;
    memcpy(report_out, newest, bytes);
    offered_number = newest_number;
  }
  board_hold(0);
  if (bytes == 0 ||
      !usbd_edpt_xfer(port, REPORT_ENDPOINT, report_out, (uint16_t)bytes, false))
    usbd_edpt_release(port, REPORT_ENDPOINT);
}

/* The next command. A transfer ends with its 56 bytes, a full packet, or with a shorter one. */
static bool await_command(void) {
  return usbd_edpt_xfer(port, COMMAND_ENDPOINT, command_in, sizeof command_in, false);
}

void haptic_board_poll(void) {
  tud_task_ext(0, false);
  offer_report();
}

/* The class driver. */

static void driver_init(void) { is_open = 0; }
static bool driver_deinit(void) {
  bus_event();
  is_open = 0;
  return true;
}
/* Bus reset, and another configuration. */
static void driver_reset(uint8_t rhport) {
  (void)rhport;
  bus_event();
  is_open = 0;
}

/* @return bytes of the descriptors that are this driver's; 0: the interface is another's. */
static uint16_t driver_open(uint8_t rhport, tusb_desc_interface_t const* interface,
                            uint16_t most_bytes) {
  const uint16_t bytes =
      (uint16_t)(sizeof(tusb_desc_interface_t) + 2 * sizeof(tusb_desc_endpoint_t));
  const uint8_t* at = tu_desc_next(interface);
  int k;
  if (interface->bInterfaceClass != TUSB_CLASS_VENDOR_SPECIFIC || most_bytes < bytes) return 0;
  for (k = 0; k < 2; ++k, at = tu_desc_next(at))
    if (!usbd_edpt_open(rhport, (const tusb_desc_endpoint_t*)at)) return 0;
  bus_event();
  port = rhport;
  is_open = 1;
  return await_command() ? bytes : 0;
}

/* Standard requests to the interface; the stack answers them where this says false. */
static bool driver_control(uint8_t rhport, uint8_t stage, tusb_control_request_t const* request) {
  (void)rhport;
  if (stage == CONTROL_STAGE_SETUP && request->bRequest == TUSB_REQ_SET_INTERFACE) bus_event();
  return false;
}

static bool driver_transferred(uint8_t rhport, uint8_t endpoint, xfer_result_t result,
                               uint32_t bytes) {
  (void)rhport;
  if (endpoint != COMMAND_ENDPOINT) return true;
  if (result == XFER_RESULT_SUCCESS) {
    board_hold(1);
    (void)haptic_device_command(&device, command_in, bytes, board_time_us());
    board_drive(haptic_device_drive(&device));
    board_hold(0);
  }
  return await_command();
}

usbd_class_driver_t const* usbd_app_driver_get_cb(uint8_t* count) {
  static const usbd_class_driver_t driver = {.name = "haptic",
                                             .init = driver_init,
                                             .deinit = driver_deinit,
                                             .reset = driver_reset,
                                             .open = driver_open,
                                             .control_xfer_cb = driver_control,
                                             .xfer_cb = driver_transferred,
                                             .xfer_isr = NULL,
                                             .sof = NULL};
  *count = 1;
  return &driver;
}

/* The capability block; every other vendor request stalls. */
bool tud_vendor_control_xfer_cb(uint8_t rhport, uint8_t stage,
                                tusb_control_request_t const* request) {
  int32_t bytes;
  if (stage != CONTROL_STAGE_SETUP) return true;
  board_hold(1);
  bytes = request->wIndex == 0
              ? haptic_device_answer(&device, request->bmRequestType, request->bRequest,
                                     request->wValue, block_out, sizeof block_out)
              : -1;
  board_hold(0);
  return bytes >= 0 && tud_control_xfer(rhport, request, block_out, (uint16_t)bytes);
}

/* A cable that is pulled, a host that sleeps. */
void tud_umount_cb(void) { bus_event(); }
void tud_suspend_cb(bool may_wake) {
  (void)may_wake;
  bus_event();
}
