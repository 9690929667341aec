import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { el } from "../controls/dom";

export interface Series {
  label: string;
  color: string;
}

const KEPT = 400;
const HEIGHT = 120;

/** Numbers per revision. */
export class Plot {
  readonly element: HTMLElement;
  private readonly columns: number[][];
  private plot: uPlot | null = null;

  constructor(
    title: string,
    private readonly series: Series[],
  ) {
    this.columns = Array.from({ length: series.length + 1 }, () => []);
    this.element = el("figure", { class: "plot" }, el("figcaption", {}, title));
  }

  /** A row of a revision; a newer one of the same takes its place. */
  add(revision: number, values: number[]): void {
    const rows = this.columns[0] as number[];
    const isAgain = rows.at(-1) === revision;
    [revision, ...values].forEach((value, i) => {
      const column = this.columns[i] as number[];
      if (isAgain) column.pop();
      column.push(value);
      if (column.length > KEPT) column.shift();
    });
    this.draw();
  }

  private draw(): void {
    const width = Math.max(180, this.element.clientWidth - 4);
    if (!this.plot) {
      this.plot = new uPlot(this.options(width), this.columns as unknown as uPlot.AlignedData, this.element);
      return;
    }
    if (this.plot.width !== width) this.plot.setSize({ width, height: HEIGHT });
    this.plot.setData(this.columns as unknown as uPlot.AlignedData);
  }

  private options(width: number): uPlot.Options {
    const axis = { stroke: "#3c484f", grid: { stroke: "#e2e7ea", width: 1 }, font: "11px system-ui" };
    return {
      width,
      height: HEIGHT,
      legend: { live: false },
      cursor: { show: false },
      scales: { x: { time: false } },
      axes: [
        { ...axis, size: 28 },
        { ...axis, size: 54, values: (_plot, ticks) => ticks.map((tick) => (tick === 0 ? "0" : tick.toPrecision(2))) },
      ],
      series: [
        { label: "revision" },
        ...this.series.map(({ label, color }) => ({
          label,
          stroke: color,
          width: 1.6,
          points: { show: true, size: 4 },
        })),
      ],
    };
  }
}
