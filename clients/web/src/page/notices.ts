import { button, el } from "../controls/dom";
import type { Tone } from "../session/words";

const KEPT = 4;
const SHOWN_MS = 9000;

/** Short messages that go by themselves, read out by screen readers. What failed stays until it is closed. */
export class Notices {
  readonly element = el("div", { class: "notices", role: "status", "aria-live": "polite" });

  add(tone: Tone, text: string): void {
    const newest = this.element.firstElementChild as HTMLElement | null;
    if (newest?.dataset.text === text) newest.remove();
    const made = el("div", { class: `notice ${tone}`, "data-text": text }, el("span", {}, text));
    made.append(button("×", () => made.remove(), { "aria-label": "Close this message" }));
    this.element.prepend(made);
    while (this.element.children.length > KEPT) this.element.lastElementChild?.remove();
    if (tone !== "bad") window.setTimeout(() => made.remove(), SHOWN_MS);
  }
}
