import { el } from "../controls/dom";
import type { Stage } from "../view/stage";

/** A rectangle that is drawn over the canvas between two of its pixels. */
export class Rectangle {
  private readonly element = el("div", { class: "rectangle" });
  private readonly corners: [number, number, number, number];

  constructor(
    private readonly stage: Stage,
    x: number,
    y: number,
  ) {
    this.corners = [x, y, x, y];
    (stage.canvas.parentElement ?? document.body).append(this.element);
    this.element.dataset.test = "rectangle";
  }

  /** Moves the corner opposite to where it began. */
  extend(x: number, y: number): void {
    this.corners[2] = x;
    this.corners[3] = y;
    const [left, top, right, bottom] = this.sides;
    const { canvas } = this.stage;
    Object.assign(this.element.style, {
      left: `${canvas.offsetLeft + left}px`,
      top: `${canvas.offsetTop + top}px`,
      width: `${right - left}px`,
      height: `${bottom - top}px`,
    });
  }

  contains(x: number, y: number): boolean {
    const [left, top, right, bottom] = this.sides;
    return x >= left && x <= right && y >= top && y <= bottom;
  }

  remove(): void {
    this.element.remove();
  }

  private get sides(): [number, number, number, number] {
    const [a, b, c, d] = this.corners;
    return [Math.min(a, c), Math.min(b, d), Math.max(a, c), Math.max(b, d)];
  }
}
