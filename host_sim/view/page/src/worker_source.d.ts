// SPDX-License-Identifier: Apache-2.0
/** The worker, bundled, as text (build.mjs). */
declare module "worker-source" {
  const text: string;
  export default text;
}
