import { button, el } from "../controls/dom";
import type { Mark } from "../workspace";

/** Scrubs and plays. Arrow keys move by a frame where the slider has the focus, and anywhere else by the page's keys. */
export class Timeline {
  readonly element: HTMLElement;
  frame = 0;
  private frames = 1;
  private isFirst = true;
  private rate = 30;
  private started = 0;
  private startFrame = 0;
  private animation = 0;
  private readonly play: HTMLButtonElement;
  private readonly slider: HTMLInputElement;
  private readonly entry: HTMLInputElement;
  private readonly total = el("span", { class: "unit" });
  private readonly track = el("div", { class: "marks" });

  constructor(
    private readonly shown: (frame: number) => void,
    private readonly picked: (mark: Mark) => void,
  ) {
    this.play = button("Play", () => this.toggle(), { class: "play", title: "Space" });
    this.slider = el("input", { type: "range", min: "0", max: "0", step: "1", "aria-label": "Frame", class: "scrub" });
    this.slider.oninput = () => this.goTo(Number(this.slider.value));
    this.entry = el("input", {
      type: "number",
      min: "0",
      step: "1",
      "aria-label": "Frame number",
      class: "frame-number",
    });
    this.entry.onchange = () => this.goTo(Number(this.entry.value));
    this.element = el(
      "section",
      { class: "timeline", "aria-label": "Timeline" },
      this.play,
      el("div", { class: "track" }, this.track, this.slider),
      el("div", { class: "frame-entry" }, this.entry, this.total),
    );
  }

  get isPlaying(): boolean {
    return this.animation !== 0;
  }

  /** isAtEnd: the last frame is shown again where it was shown before. */
  set(frames: number, rate: number, name: string, isAtEnd: boolean): void {
    const wasLast = this.frame >= this.frames - 1;
    this.frames = Math.max(1, frames);
    this.rate = rate;
    this.slider.max = String(this.frames - 1);
    this.entry.max = String(this.frames - 1);
    this.total.textContent = this.frames > 1 ? `of ${this.frames - 1}` : "one shape";
    this.entry.hidden = this.frames < 2;
    this.slider.setAttribute("aria-label", name);
    this.play.disabled = this.frames < 2;
    if (isAtEnd && wasLast && !this.isPlaying) this.goTo(this.frames - 1);
    // Motions open in the middle: their ends are mostly held, and nothing can be dragged there.
    else if (!isAtEnd && this.isFirst && this.frames > 1) this.goTo(Math.floor(this.frames / 2));
    else if (this.frame > this.frames - 1) this.goTo(this.frames - 1);
    this.isFirst = this.isFirst && this.frames < 2;
    this.write();
  }

  goTo(frame: number): void {
    this.pause();
    this.put(frame);
  }

  step(by: number): void {
    this.goTo(this.frame + by);
  }

  toggle(): void {
    if (this.isPlaying) this.pause();
    else this.start();
  }

  pause(): void {
    if (this.animation) cancelAnimationFrame(this.animation);
    this.animation = 0;
    this.play.textContent = "Play";
  }

  setMarks(marks: Mark[]): void {
    this.track.replaceChildren(
      ...marks.map((mark) => {
        const made = button("", () => this.picked(mark), {
          class: mark.isSelected ? "mark selected" : "mark",
          title: mark.label,
          "aria-label": mark.label,
          tabIndex: -1,
        });
        made.style.left = `${(100 * mark.frame) / Math.max(1, this.frames - 1)}%`;
        made.style.backgroundColor = mark.color;
        return made;
      }),
    );
  }

  private start(): void {
    if (this.frames < 2) return;
    this.started = performance.now();
    this.startFrame = this.frame >= this.frames - 1 ? 0 : this.frame;
    this.play.textContent = "Pause";
    const next = (now: number): void => {
      const passed = ((now - this.started) / 1000) * this.rate;
      this.put(Math.floor(this.startFrame + Math.max(0, passed)) % this.frames);
      this.animation = requestAnimationFrame(next);
    };
    this.animation = requestAnimationFrame(next);
  }

  private put(frame: number): void {
    const wanted = Math.min(Math.max(0, Math.round(Number.isFinite(frame) ? frame : 0)), this.frames - 1);
    if (wanted !== this.frame) {
      this.frame = wanted;
      this.shown(wanted);
    }
    this.write();
  }

  private write(): void {
    this.slider.value = String(this.frame);
    if (document.activeElement !== this.entry || this.isPlaying) this.entry.value = String(this.frame);
  }
}
