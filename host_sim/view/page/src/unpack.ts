// SPDX-License-Identifier: Apache-2.0
// The one script of the page that is not zipped: unzips the program and starts it.
import { bytesOf, unzipped } from "./recording";

function say(text: string): void {
  const box = document.getElementById("trouble")!;
  box.textContent = text;
  box.hidden = false;
  document.body.dataset.state = "refused";
}

async function unpack(): Promise<void> {
  if (!("DecompressionStream" in window)) {
    say("This browser is too old to unpack this page: open it in Chromium or Chrome from 80, Firefox from 113 or Safari from 16.4 on.");
    return;
  }
  try {
    const program = await unzipped(bytesOf(document.getElementById("haptic-program")?.textContent ?? ""));
    const script = document.createElement("script");
    script.src = URL.createObjectURL(new Blob([program as BlobPart], { type: "text/javascript" }));
    script.onerror = () => say("This page cannot be shown: its program could not be started; make the page again.");
    document.body.append(script);
  } catch {
    say("This page cannot be shown: the program in this file is damaged; make the page again.");
  }
}
void unpack();
