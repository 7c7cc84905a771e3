# SPDX-License-Identifier: Apache-2.0
# awk -F, -v output=OUTPUT -v slew=N_PER_S -f judge_wire.awk WIRE.csv
# Judges what a device was handed (host_sim usb-device --wire): from the first period with a mark on, which is the fault.
#   goes-on   at the end four fifths of the force before, and no period without drives
#   ramps     to zero: no step beyond the slew limit, never a rise, within 150 ms
#   zero      as ramps, but for one command that is zero; it is not the watchdog's, and comes within 15 ms
#   cut       the same by the device's watchdog, within 25 ms
# A command may step by what the slew limit allows in two periods, a period by as much and that of the periods without a
# command before it. Prints "holds" and the figures, or what
# fails; then exits with 1.
function larger(a, b) { return a > b ? a : b }
function fail(text) { failures = failures "; " text }
$1 !~ /^[0-9.]+$/ || NF < 10 { next }
{
  norm = sqrt($2 * $2 + $3 * $3 + $4 * $4)
  if ($8 == 0) {
    before = norm
    cuts = $7
  } else {
    if (!after++) {
      fault_s = $1
      least = before
    }
    if (norm == 0 && last > 0 && (output == "zero" || output == "cut") && !zeros++) {
      zero_at = last
    } else {
      largest_step = larger(largest_step, $10)
      excess = larger(excess, sqrt(($2 - x) ^ 2 + ($3 - y) ^ 2 + ($4 - z) ^ 2) - 0.001 * slew * (2 + silent))
    }
    silent = $9 > 0 ? 0 : silent + 1
    rise = larger(rise, norm - least)
    if (norm < least) least = norm
    if ($6 > 0.01) acting_ms = 1000 * ($1 - fault_s)
    if ($5 == 0) without_drives++
    # Without a force it takes nothing away: it only notices that nobody is there any more.
    if ($7 > cuts && last > 0) forces_cut++
    cuts = $7
    end = norm
  }
  rows++
  x = $2; y = $3; z = $4; last = norm
}
END {
  allowed = 2 * 0.001 * slew + 0.01
  if (!(slew > 0)) fail("no slew limit is stated")
  if (after < 450 || rows == after) fail("only " rows " periods, " after + 0 " of them after the fault")
  # A force that one step may take away proves nothing.
  if (before < 2 * allowed) fail(sprintf("%.2f N before the fault", before))
  if (largest_step > allowed) fail(sprintf("a step of %.2f N, %.2f N allowed", largest_step, allowed))
  if (excess > 0.01) fail(sprintf("a period that changes by %.2f N too much", excess))
  if (output == "goes-on") {
    if (end < 0.8 * before) fail(sprintf("%.2f N at the end, of %.2f N", end, before))
    if (without_drives) fail(without_drives " periods without drives")
  } else {
    within_ms = output == "ramps" ? 150 : output == "zero" ? 15 : 25
    if (acting_ms > within_ms) fail(sprintf("a force for %.0f ms", acting_ms))
    if (rise > 0.05) fail(sprintf("a rise of %.2f N", rise))
    if (end > 0) fail(sprintf("%.2f N at the end", end))
  }
  if (forces_cut != (output == "cut")) fail(forces_cut + 0 " cuts by the watchdog")
  figures = sprintf("%.2f N before; largest step %.2f N of %.2f, to zero at once %.2f N; force for %.0f ms, rise %.2f N; cut %d", \
    before, largest_step, allowed, zero_at, acting_ms, rise, forces_cut)
  print failures == "" ? "holds: " figures : "FAILED: " substr(failures, 3) ": " figures
  exit failures != ""
}
