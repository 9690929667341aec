import type { Vector3 } from "three";
import { NewestWins } from "../session/newest";
import { type Marker, Markers, Segments } from "../view/markers";
import type { Grab, PointerAt } from "../view/pointer";
import type { Stage } from "../view/stage";
import { Legend, normalize } from "./colors";
import { SweptRods } from "./sweep";

/** After a drag its target is drawn until the answer to its last edit is, too. [ms] */
const LINGER_MS = 400;

/** A line of the picture: a pull, a load, a beam that is selected. */
export interface Line {
  from: Vector3;
  to: Vector3;
  color: number;
}

/** Values that colour rods. floor: smaller values are 0 but for rounding. */
export interface Values {
  of: Float32Array;
  title: string;
  unit: string;
  floor: number;
}

/** Actions of a drag besides moving its target. */
export interface DragActions {
  /** One edit at a time; null: nothing is sent before the end. */
  send: ((point: Vector3) => Promise<void>) | null;
  /** The pointer was released; target: where, if it has moved. */
  released?(target: Vector3 | null): void;
  /** All is sent, and the target is no longer drawn. */
  settled?(): void;
}

/** The picture of a linkage or a structure of beams: rods, markers of joints or nodes, lines, legend, dragged target. */
export class RodPicture {
  readonly rods: SweptRods;
  readonly legend = new Legend();
  /** The joint or node that is dragged, and where to. */
  dragged: { index: number; target: Vector3 } | null = null;
  private readonly markers: Markers;
  private readonly lines: Segments;

  /** redraw: of markers and lines, by mark(). */
  constructor(
    stage: Stage,
    private readonly redraw: () => void,
    private readonly fail: (error: unknown) => void,
  ) {
    this.rods = new SweptRods(stage);
    this.markers = new Markers(stage);
    this.lines = new Segments(stage);
    stage.canvas.after(this.legend.element);
  }

  /** Shares of the values' range, which the legend shows; without values the legend shows `otherwise`. */
  colour(values: Values | null, otherwise = ""): Float32Array | null {
    if (!values) {
      this.legend.show(otherwise);
      return null;
    }
    const { shares, low, high } = normalize(values.of, values.floor);
    this.legend.show(values.title, low, high, values.unit);
    return shares;
  }

  mark(markers: Marker[], lines: Line[]): void {
    this.markers.set(markers);
    this.lines.set(lines);
  }

  /** The number in the key of the marker within reach. */
  pick(at: PointerAt): number | null {
    const marker = this.markers.pick(at.x, at.y, at.reach);
    return marker ? Number(marker.key.slice(1)) : null;
  }

  drag(index: number, anchor: Vector3, { send, released, settled }: DragActions): Grab {
    const pump = send && new NewestWins(send, this.fail);
    return {
      anchor,
      move: (point) => {
        this.dragged = { index, target: point.clone() };
        pump?.put(point.clone());
        this.redraw();
      },
      end: async (isMoved) => {
        released?.(isMoved ? (this.dragged?.target ?? null) : null);
        await pump?.idle();
        window.setTimeout(() => {
          this.dragged = null;
          this.redraw();
          settled?.();
        }, LINGER_MS);
      },
    };
  }
}
