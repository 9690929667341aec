import { button, el } from "../controls/dom";
import type { Tone } from "../session/words";

const KEPT = 4;
const SHOWN_MS = 9000;
/** Number of past messages. */
const LISTED = 100;

const WORDS: Record<Tone, string> = { good: "", busy: "", warning: "warning: ", bad: "problem: " };
const BADNESS: Record<Tone, number> = { good: 0, busy: 1, warning: 2, bad: 3 };

/** A message that is shown while it applies. */
interface Standing {
  text: string;
  tone: Tone;
  /** null: its reader has closed it. */
  shown: HTMLElement | null;
  /** How bad it was then. */
  closed: Tone;
  listed: HTMLElement;
}

function clock(): string {
  return new Date().toLocaleTimeString([], { hour12: false });
}

/**
 * Short messages, read out by screen readers. Those of add() disappear by themselves, failures stay until they are
 * closed; those of follow() stay while they apply. All can be read again in `past`.
 */
export class Notices {
  readonly element = el("div", { class: "notices", role: "status", "aria-live": "polite" });
  private readonly list = el("ol", { class: "log", tabIndex: 0, "aria-label": "Past messages, the newest first" });
  private readonly summary = el("summary", {}, "Messages");
  readonly past = el("details", { class: "messages", "data-test": "messages" }, this.summary, this.list);
  private readonly standing = new Map<string, Standing>();

  add(tone: Tone, text: string): void {
    const newest = this.element.firstElementChild as HTMLElement | null;
    if (newest?.dataset.text === text) newest.remove();
    const made = this.show(tone, text, () => made.remove());
    if (tone !== "bad") window.setTimeout(() => made.remove(), SHOWN_MS);
    this.note(tone, text);
  }

  /**
   * Replaces the message of this key. text null: it does not apply (any more). A message that its reader has closed is
   * shown again when it gets worse.
   */
  follow(key: string, tone: Tone, text: string | null): void {
    const before = this.standing.get(key);
    if (before?.text === text && before?.tone === tone) return;
    if (text === null) {
      if (!before) return;
      before.shown?.remove();
      before.listed.append(` (until ${clock()})`);
      this.standing.delete(key);
    } else if (before) {
      before.text = text;
      before.tone = tone;
      before.listed.setAttribute("class", tone);
      before.listed.textContent = `${clock()} ${WORDS[tone]}${text}`;
      if (before.shown) {
        before.shown.setAttribute("class", `notice ${tone}`);
        before.shown.setAttribute("data-text", text);
        before.shown.querySelector("span")?.replaceChildren(text);
      } else if (BADNESS[tone] > BADNESS[before.closed]) {
        this.stand(key, before);
      }
    } else {
      const made: Standing = { text, tone, shown: null, closed: tone, listed: this.note(tone, text) };
      this.standing.set(key, made);
      this.stand(key, made);
    }
  }

  /** Removes the messages of a session that is left. */
  endStanding(): void {
    for (const key of [...this.standing.keys()]) this.follow(key, "good", null);
  }

  private stand(key: string, standing: Standing): void {
    const shown = this.show(standing.tone, standing.text, () => {
      shown.remove();
      standing.shown = null;
      standing.closed = standing.tone;
    });
    shown.dataset.key = key;
    standing.shown = shown;
  }

  private show(tone: Tone, text: string, closed: () => void): HTMLElement {
    const made = el("div", { class: `notice ${tone}`, "data-text": text }, el("span", {}, text));
    made.append(button("×", closed, { "aria-label": "Close this message" }));
    this.element.prepend(made);
    const passing = [...this.element.querySelectorAll(".notice:not([data-key])")];
    for (const old of passing.slice(KEPT)) old.remove();
    return made;
  }

  private note(tone: Tone, text: string): HTMLElement {
    const listed = el("li", { class: tone }, `${clock()} ${WORDS[tone]}${text}`);
    this.list.prepend(listed);
    while (this.list.children.length > LISTED) this.list.lastElementChild?.remove();
    this.summary.textContent = `Messages (${this.list.children.length})`;
    return listed;
  }
}
