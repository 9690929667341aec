import type { Scene } from "../../gen/limber/v1/scene_pb";
import { button, el } from "../controls/dom";
import { kindInWords } from "../session/listed";
import type { EditInit, LiveSession } from "../session/live";
import { describeResult, describeState, type Tone } from "../session/words";
import { PointerControl } from "../view/pointer";
import { Stage } from "../view/stage";
import { inWords } from "../wire/errors";
import type { DesignStart, Desk, Workspace } from "../workspace";
import { exportPanel } from "./export_panel";
import { makeWorkspace } from "./kinds";
import type { Notices } from "./notices";
import { PeoplePanel } from "./people_panel";
import { explainPanel, ResultsPanel } from "./results_panel";
import { Timeline } from "./timeline";

/** Frames of an arrow key with Shift. */
const LONG_STEP = 10;

/** A session on the page: its picture, timeline and panels. */
export class SessionPage implements Desk {
  readonly element: HTMLElement;
  readonly stage: Stage;
  readonly timeline: Timeline;
  workspace: Workspace | null = null;
  private readonly sidebar = el("aside", { class: "sidebar", "aria-label": "Panels" });
  private readonly overlay = el("p", { class: "overlay", role: "status" });
  private people: PeoplePanel | null = null;
  private results: ResultsPanel | null = null;
  private isFramed = false;
  private isScheduled = false;

  /** Throws where the browser has no WebGL 2. */
  constructor(
    readonly session: LiveSession,
    private readonly notices: Notices,
    private readonly reopen: (change: (scene: Scene) => void) => void,
    readonly designStart: DesignStart | null,
  ) {
    const canvas = el("canvas", {
      class: "view",
      tabIndex: 0,
      "aria-label": "The scene: drag points of it to edit, the background to turn it",
      role: "application",
    });
    this.timeline = new Timeline(
      (frame) => this.showFrame(frame),
      (mark) => {
        this.timeline.goTo(mark.frame);
        this.workspace?.select(mark.key);
      },
    );
    this.element = el(
      "main",
      { class: "session" },
      el("div", { class: "stage" }, canvas, this.overlay),
      this.sidebar,
      this.timeline.element,
    );
    document.body.append(this.element);
    this.stage = new Stage(canvas);
    canvas.addEventListener("webglcontextrestored", () => this.workspace?.show(this.frame));
    session.on("status", () => this.statusChanged());
    session.on("result", () => this.resultChanged());
    session.on("geometry", () => this.geometryChanged());
    session.on("motion", () => this.schedule());
    session.on("scene", () => this.sceneChanged());
    session.on("people", () => this.people?.update());
    session.on("others", ({ from, to, changes, authors }) => this.tellOthers(from, to, changes, authors));
    session.on("trouble", (error) => this.fail(error));
  }

  get frame(): number {
    return this.timeline.frame;
  }

  goTo(frame: number): void {
    this.timeline.goTo(frame);
  }

  refresh(): void {
    this.timeline.setMarks(this.workspace?.marks() ?? []);
  }

  notify(tone: Tone, text: string): void {
    this.notices.add(tone, text);
  }

  follow(key: string, tone: Tone, text: string | null): void {
    this.notices.follow(key, tone, text);
  }

  send(edits: EditInit[]): void {
    this.session.edit(edits).then(({ issues }) => {
      for (const issue of issues) this.notices.add("warning", issue.message);
    }, this.fail);
  }

  openChanged(change: (scene: Scene) => void): void {
    this.reopen(change);
  }

  readonly fail = (error: unknown): void => {
    this.notices.add("bad", inWords(error));
  };

  /** True if the key was meant for the session: a control with the focus handles its own keys first. */
  key(event: KeyboardEvent): boolean {
    const { target } = event;
    const control = target instanceof HTMLElement ? target.closest("input, select, button, summary") : null;
    const isTyping =
      control instanceof HTMLSelectElement || control?.matches('input:not([type="checkbox"], [type="range"])');
    if (isTyping || document.querySelector("dialog[open]")) return false;
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) {
      if (key === "y" || (key === "z" && event.shiftKey)) this.redo();
      else if (key === "z") this.undo();
      else return false;
      return true;
    }
    if (event.altKey) return false;
    if (event.key === "Delete" || event.key === "Backspace") this.workspace?.removeSelected();
    else if (event.key === "Escape") this.workspace?.select(null);
    else return control === null && this.timelineKey(event);
    return true;
  }

  private timelineKey(event: KeyboardEvent): boolean {
    const step = event.shiftKey ? LONG_STEP : 1;
    if (event.key === " ") this.timeline.toggle();
    else if (event.key === "ArrowLeft") this.timeline.step(-step);
    else if (event.key === "ArrowRight") this.timeline.step(step);
    else if (event.key === "Home") this.timeline.goTo(0);
    else if (event.key === "End") this.timeline.goTo(Number.MAX_SAFE_INTEGER);
    else return false;
    return true;
  }

  undo(): void {
    this.session.undo().catch(this.fail);
  }

  redo(): void {
    this.session.redo().catch(this.fail);
  }

  close(): void {
    this.timeline.pause();
    this.notices.endStanding();
    this.session.close();
    this.stage.dispose();
    this.element.remove();
  }

  private makePanels(): void {
    const { kind } = this.session;
    this.workspace = makeWorkspace(kind, this);
    if (!this.workspace) {
      this.notices.add("bad", `This page does not know sessions of the kind ${kind || "(none)"}.`);
      return;
    }
    new PointerControl(this.stage, this.workspace);
    this.results = new ResultsPanel(this.session, kind, this.fail);
    const help = el("p", { class: "hint" }, this.workspace.hint);
    this.people = new PeoplePanel(this.session, this.fail);
    const look = el(
      "div",
      { class: "row look" },
      button("Reset the view", () => this.look()),
    );
    this.sidebar.replaceChildren(
      help,
      ...this.workspace.panels,
      this.results.element,
      explainPanel(this.session),
      exportPanel(this.session, kind, this.fail),
      this.people.element,
      look,
    );
    this.sceneChanged();
    this.geometryChanged();
  }

  private look(): void {
    this.isFramed = false;
    this.geometryChanged();
  }

  private statusChanged(): void {
    if (!this.workspace && this.session.kind) this.makePanels();
    const { status } = this.session;
    if (status) {
      const line = describeState(status);
      const isPictured = this.session.motion.frames > 0;
      this.overlay.textContent = line.tone === "good" || isPictured ? "" : `${kindInWords(status.kind)}: ${line.text}`;
    }
    this.schedule();
    this.element.dataset.state = status ? describeState(status).text : "";
  }

  private resultChanged(): void {
    this.workspace?.resultChanged();
    this.schedule();
    const { result } = this.session;
    if (result) this.element.dataset.result = describeResult(result).text;
  }

  private geometryChanged(): void {
    const box = this.workspace?.setGeometry();
    if (!box || !this.workspace || this.isFramed) return;
    this.isFramed = true;
    this.stage.frame(box[0], box[1], this.workspace.up);
  }

  /** Once a picture, however many results come meanwhile. */
  private schedule(): void {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame(() => {
      this.isScheduled = false;
      if (!this.stage.closed.aborted) this.showNewest();
    });
  }

  private showNewest(): void {
    const { workspace, session } = this;
    this.results?.update();
    if (!workspace || session.motion.frames === 0) return;
    this.setTimeline();
    if (!this.isFramed) this.geometryChanged();
    workspace.show(this.frame);
    this.overlay.textContent = "";
    this.element.dataset.shown = String(session.motion.sequence);
    this.refresh();
  }

  private sceneChanged(): void {
    this.workspace?.sceneChanged();
    this.setTimeline();
    this.refresh();
  }

  /** The scene may come before the first frames are shown, or after: paths open at their end either way. */
  private setTimeline(): void {
    const { session, workspace } = this;
    const isPath = session.kind !== "bodies";
    this.timeline.set(session.motion.frames, workspace?.rate ?? 30, workspace?.frameName ?? "Frame", isPath);
  }

  private showFrame(frame: number): void {
    this.workspace?.show(frame);
  }

  private tellOthers(from: bigint, to: bigint, changes: string[], authors: string[]): void {
    const revisions = from === to ? `revision ${to}` : `revisions ${from} to ${to}`;
    const what = changes.length ? `${revisions}: ${changes.join(", ")}` : revisions;
    this.notices.add("busy", `${authors.length ? authors.join(" and ") : "Somebody else"} edited, ${what}.`);
  }
}
