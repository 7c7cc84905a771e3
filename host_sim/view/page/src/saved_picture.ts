// SPDX-License-Identifier: Apache-2.0
// Both spaces as they are drawn, side by side under a line of words, as a PNG file that the browser saves.

const kHead_px = 34, kMargin_px = 10;

/** `panes` were drawn in this very task: WebGL keeps nothing longer. */
export function savePicture(panes: HTMLCanvasElement[], words: string, colours: { ground: string; ink: string }, name: string): void {
  const ratio = panes[0].width / Math.max(1, panes[0].clientWidth);
  const sheet = document.createElement("canvas");
  sheet.width = panes.reduce((sum, pane) => sum + pane.width, 0);
  sheet.height = kHead_px * ratio + Math.max(...panes.map((pane) => pane.height));
  const flat = sheet.getContext("2d");
  if (!flat) return;
  flat.fillStyle = colours.ground;
  flat.fillRect(0, 0, sheet.width, sheet.height);
  flat.fillStyle = colours.ink;
  flat.font = `${15 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
  flat.textBaseline = "middle";
  flat.fillText(words, kMargin_px * ratio, (kHead_px * ratio) / 2);
  let x = 0;
  for (const pane of panes) {
    flat.drawImage(pane, x, kHead_px * ratio);
    x += pane.width;
  }
  sheet.toBlob((blob) => {
    if (!blob) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }, "image/png");
}
