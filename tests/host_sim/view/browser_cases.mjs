// SPDX-License-Identifier: Apache-2.0
/** Runs named cases one after the other and says how each ended. @returns the exit code. */
export async function runCases(cases) {
  let failed = 0;
  for (const [name, run] of Object.entries(cases)) {
    try {
      await run();
      console.log(`passed: ${name}`);
    } catch (error) {
      failed += 1;
      console.log(`FAILED: ${name}\n${error.stack}`);
    }
  }
  return failed > 0 ? 1 : 0;
}
