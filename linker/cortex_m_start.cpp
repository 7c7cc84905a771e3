// SPDX-License-Identifier: Apache-2.0
// Start of a Cortex-M before C++: vectors at address 0, the floating point unit, if the code is
// compiled for one, switched on and in its default mode, zeroed variables. There is nothing to
// copy: the linker scripts refuse initialised writable data, and who loads the image puts the code
// where it runs. Memory protection and caches are the board's own; an emulator has none.

#include <cstdint>

#include "linker/semihosting.hpp"

extern "C" {
extern std::uint32_t haptic_zero_begin[];  // of the linker script
extern std::uint32_t haptic_zero_end[];

/// The image's own.
[[noreturn]] void image_main() noexcept;

[[noreturn, gnu::used]] void start_image() noexcept {
  for (volatile std::uint32_t* word = haptic_zero_begin; word != haptic_zero_end; ++word) *word = 0;
  image_main();
}

/// Any exception is a defect here: no interrupt is enabled.
[[noreturn, gnu::used]] void report_fault() noexcept {
  haptic::semihosting::print("core image: fault of the processor\n");
  haptic::semihosting::exit(70);
}
}

asm(R"(
    .syntax unified
    .section .vectors,"a",%progbits
    .globl haptic_vectors
    .type haptic_vectors, %object
haptic_vectors:
    .word haptic_stack_end
    .word _start
    .rept 14
    .word haptic_fault
    .endr
    .size haptic_vectors, . - haptic_vectors

    .section .start,"ax",%progbits
    .thumb
    .globl _start
    .type _start, %function
    .thumb_func
_start:
)"
#ifdef __ARM_FP
    R"(
    ldr r0, =0xE000ED88      @ CPACR: full access to the floating point unit
    ldr r1, [r0]
    orr r1, r1, #0x00F00000
    str r1, [r0]
    dsb
    isb
    movs r0, #0              @ round to nearest, subnormals kept, NaN as they come
    vmsr fpscr, r0
)"
#endif
    R"(
    bl start_image
    udf #0
    .ltorg
    .size _start, . - _start

    .globl haptic_fault
    .type haptic_fault, %function
    .thumb_func
haptic_fault:
    ldr r0, =haptic_stack_end  @ the fault may be an overflow of the stack
    mov sp, r0
    bl report_fault
    .ltorg
    .size haptic_fault, . - haptic_fault
    .text
)");
