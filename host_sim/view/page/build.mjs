// SPDX-License-Identifier: Apache-2.0
// build.mjs MODULE OUT: the page without a scene, in one file: script, style, licences, and the core from MODULE
// (view_core.wasm). host_sim puts a scene and a recording into it.
import { build } from "esbuild";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url));
const [modulePath, out] = process.argv.slice(2);
if (!out) {
  console.error("usage: build.mjs MODULE OUT");
  process.exit(2);
}

const common = { bundle: true, minify: true, write: false, target: "es2022", absWorkingDir: here, legalComments: "none" };
const worker = await build({ ...common, entryPoints: ["src/worker.ts"], format: "iife" });
const workerSource = {
  name: "worker-source",
  setup(b) {
    b.onResolve({ filter: /^worker-source$/ }, () => ({ path: "worker", namespace: "worker-source" }));
    b.onLoad({ filter: /.*/, namespace: "worker-source" }, () => ({ contents: worker.outputFiles[0].text, loader: "text" }));
  },
};
const main = await build({ ...common, entryPoints: ["src/main.ts"], format: "iife", plugins: [workerSource] });
const unpack = await build({ ...common, entryPoints: ["src/unpack.ts"], format: "iife" });
const style = await build({ ...common, entryPoints: ["src/style.css"], loader: { ".css": "css" } });
const uplot = readFileSync(join(here, "node_modules/uplot/dist/uPlot.min.css"), "utf8");

const escaped = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
const licence = (name) => {
  const { version } = JSON.parse(readFileSync(join(here, "node_modules", name, "package.json"), "utf8"));
  return `${name} ${version}\n${readFileSync(join(here, "node_modules", name, "LICENSE"), "utf8").trim()}`;
};
const parts = {
  STYLE: uplot + style.outputFiles[0].text,
  LICENCES: escaped(
    ["This page and the core: Apache-2.0. It contains also:", licence("three"), licence("uplot"),
      "Parts of libc++ 16 (Apache-2.0 with LLVM exceptions), wasi-libc (MIT, Apache-2.0 with LLVM exceptions) and Eigen 3.4 (MPL-2.0, https://eigen.tuxfamily.org)."].join("\n\n"),
  ),
  MODULE: gzipSync(readFileSync(modulePath), { level: 9 }).toString("base64"),
  PROGRAM: gzipSync(main.outputFiles[0].text, { level: 9 }).toString("base64"),
  // The end of a script inside a script would end it.
  SCRIPT: unpack.outputFiles[0].text.replaceAll("</script", "<\\/script"),
};
let page = readFileSync(join(here, "page.html"), "utf8");
for (const [name, text] of Object.entries(parts)) page = page.replace(`@${name}@`, () => text);
mkdirSync(dirname(out), { recursive: true });
writeFileSync(out, page);
console.log(`${out}: ${(page.length / 1024).toFixed(0)} kB`);
