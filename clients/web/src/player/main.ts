import "../style.css";
import "./player.css";
import { Vector3 } from "three";
import { el } from "../controls/dom";
import { Timeline } from "../page/timeline";
import { Stage } from "../view/stage";
import type { StoredMotion } from "./data";
import { figureOf, type Show } from "./figures";

const VERSION = 1;

/** The contents of the page, for tests and for programs that make pictures of it. */
export class Player {
  readonly stage: Stage;
  readonly timeline: Timeline;
  private readonly show: Show;

  constructor(readonly stored: StoredMotion) {
    if (stored.version !== VERSION) throw new Error("the motion in this file is of another version of limber");
    const canvas = el("canvas", {
      class: "view",
      role: "img",
      "aria-label": `${stored.title}: drag to turn it, scroll to come nearer`,
    });
    this.timeline = new Timeline(
      (frame) => this.show(frame),
      () => undefined,
    );
    document.title = stored.title;
    document.body.append(el("main", { class: "player" }, el("div", { class: "stage" }, canvas), this.timeline.element));
    this.stage = new Stage(canvas);
    this.show = figureOf(this.stage, stored);
    this.timeline.set(this.frames, stored.rate, stored.frameName, false);
    this.frameAll();
    this.show(0);
    canvas.addEventListener("webglcontextrestored", () => this.show(this.timeline.frame));
    window.addEventListener("keydown", (event) => this.key(event));
  }

  get frames(): number {
    return this.stored.frames.rows;
  }

  /** Without the timeline, for pictures. */
  bare(): void {
    document.body.classList.add("bare");
  }

  /** All of the motion in the picture; of an azimuth and an elevation [degree], else as the page looks at it. */
  frameAll(azimuth?: number, elevation?: number): void {
    const { stage, stored } = this;
    stage.frame(new Vector3(...stored.low), new Vector3(...stored.high), stored.up);
    if (azimuth === undefined || elevation === undefined) return;
    const [a, e] = [(azimuth * Math.PI) / 180, (Math.min(Math.max(elevation, -89.9), 89.9) * Math.PI) / 180];
    const [x, y, z] = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const { target } = stage.controls;
    const distance = stage.camera.position.distanceTo(target);
    const eye = stored.up === "z" ? new Vector3(x, y, z) : new Vector3(x, z, -y);
    stage.camera.position.copy(target).addScaledVector(eye, distance);
    stage.controls.update();
  }

  /** A frame as the data URL of a picture of this size, made when it is drawn: later the canvas is empty. */
  picture(frame: number, type: string, width: number, height: number): Promise<string> {
    const made = el("canvas", { width, height });
    const context = made.getContext("2d") as CanvasRenderingContext2D;
    context.imageSmoothingQuality = "high";
    this.show(frame);
    this.stage.invalidate();
    return new Promise((resolve) =>
      requestAnimationFrame(() => {
        context.drawImage(this.stage.canvas, 0, 0, width, height);
        resolve(made.toDataURL(type, 0.95));
      }),
    );
  }

  private key(event: KeyboardEvent): void {
    if (event.target instanceof HTMLInputElement || event.target instanceof HTMLButtonElement) return;
    if (event.key === " ") this.timeline.toggle();
    else if (event.key === "ArrowLeft") this.timeline.step(-1);
    else if (event.key === "ArrowRight") this.timeline.step(1);
    else return;
    event.preventDefault();
  }
}

declare global {
  interface Window {
    player?: Player;
  }
}

try {
  window.player = new Player(JSON.parse(document.getElementById("motion")?.textContent ?? ""));
} catch (error) {
  document.body.append(
    el("p", { class: "failed", role: "alert" }, `This motion cannot be shown: ${(error as Error).message}`),
  );
}
