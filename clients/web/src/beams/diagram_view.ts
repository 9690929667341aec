import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import { el, number } from "../controls/dom";
import type { RodShape } from "../rods/sweep";
import { FilledStrips } from "../view/filled_strips";
import type { Stage } from "../view/stage";
import { type Diagram, type DiagramOf, diagramOf, forcesOf, patchesOf } from "./diagram";
import type { BeamShapes } from "./shape";

const POSITIVE = 0x1f5fbf;
const NEGATIVE = 0xb3401e;
/** How far from its beam the largest value is drawn, of the structure's size. */
const SHARE = 0.12;

const css = (color: number): string => `#${color.toString(16).padStart(6, "0")}`;

/** A diagram of forces along the beams, and its meaning. */
export class DiagramView {
  of: DiagramOf = "none";
  /** As it is drawn. */
  drawn: Diagram | null = null;
  readonly legend = el("div", { class: "legend diagram", hidden: true, "data-test": "diagram" });
  private readonly strips: FilledStrips;

  constructor(stage: Stage) {
    this.strips = new FilledStrips(stage);
  }

  /** solution: of this shape; null: not known. */
  show(shapes: BeamShapes, shape: RodShape, solution: BeamSolution | null): void {
    const diagram = solution ? diagramOf(solution, this.of, shapes.size) : null;
    this.drawn = diagram;
    this.explain();
    if (!diagram || diagram.largest === 0) {
      this.strips.set([]);
      return;
    }
    const scale = (SHARE * shapes.size) / diagram.largest;
    const patches = Array.from({ length: shapes.count }, (_, element) =>
      patchesOf(shapes.stations(shape, element, diagram.axis), diagram.values[element] ?? [0, 0], scale),
    );
    this.strips.set(
      patches.flatMap((parts) =>
        parts.map(({ base, tip, isPositive }, i) => ({
          base,
          tip,
          color: isPositive ? POSITIVE : NEGATIVE,
          hasEdge: i === 0,
        })),
      ),
    );
  }

  private explain(): void {
    const { drawn, legend } = this;
    legend.hidden = this.of === "none";
    if (!drawn) legend.replaceChildren("Diagram: known of the final shape");
    else if (drawn.largest === 0) legend.replaceChildren(`${drawn.title}: none`);
    else {
      const ends = [end(NEGATIVE, "least", drawn.low, drawn.unit), end(POSITIVE, "largest", drawn.high, drawn.unit)];
      legend.replaceChildren(drawn.title, el("div", { class: "ends" }, ...ends));
    }
  }
}

function end(color: number, word: string, value: number, unit: string): HTMLElement {
  const swatch = el("span", { class: "swatch", "aria-hidden": "true" });
  swatch.style.background = css(color);
  return el("span", {}, swatch, ` ${word} ${number(value)} ${unit}`);
}

/** Forces in a beam of the newest final shape: smallest and largest values along it; null: not known yet. */
export function forcesTable(solution: BeamSolution | null, element: number): HTMLElement {
  if (!solution) return el("p", { class: "quiet" }, "Its forces are known of the final shape.");
  const rows = forcesOf(solution, element).map(([title, least, largest, unit]) => {
    const [low, high] = [number(least), number(largest)];
    const text = low === high ? low : `${low} to ${high}`;
    return el("tr", {}, el("th", { scope: "row" }, title), el("td", {}, `${text} ${unit}`));
  });
  return el("table", { "data-test": "forces" }, el("tbody", {}, ...rows));
}
