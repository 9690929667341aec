import type { Values } from "../rods/picture";
import type { RodShape } from "../rods/sweep";
import type { Reals } from "../wire/arrays";
import type { Desk } from "../workspace";
import type { LinkageShapes } from "./shape";
import { stresses } from "./stress";

export type ColorBy = "none" | "bending" | "twist" | "angle" | "stress";

export const COLOR_CHOICES: readonly [ColorBy, string][] = [
  ["none", "nothing"],
  ["bending", "bending: curvature"],
  ["twist", "twist per length"],
  ["angle", "opening angle"],
  ["stress", "stress (von Mises)"],
];

/** Shapes come in single precision: a rod that bends or twists less than so over the whole size is straight. [rad] */
const STRAIGHT = 2e-3;
const LEAST_ANGLE = 0.01;
const LEAST_STRESS = 1;

/** The diagonal of the box around all stations. */
function sizeOf({ line }: RodShape): number {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  line.forEach((value, i) => {
    const axis = i % 4;
    if (axis === 3) return;
    low[axis] = Math.min(low[axis] ?? value, value);
    high[axis] = Math.max(high[axis] ?? value, value);
  });
  return Math.hypot(...high.map((value, axis) => value - (low[axis] ?? value)));
}

/** Values that colour rods. Stresses are the server's, of final shapes; all else is of the shown shape itself. */
export class Coloring {
  by: ColorBy = "bending";
  private stress: { values: Float32Array; sequence: bigint } | null = null;
  /** Sequence of the result for whose stresses was asked last. */
  private asked = 0n;
  private isAsking = false;

  /** changed: stresses have come, or cannot be had. */
  constructor(
    private readonly desk: Desk,
    private readonly changed: () => void,
  ) {}

  values(shapes: LinkageShapes, numbers: Reals, shape: RodShape): Values | null {
    if (this.by === "bending")
      return {
        of: shapes.curvatures(shape),
        title: "Curvature",
        unit: "1/m",
        floor: STRAIGHT / (sizeOf(shape) * shapes.lengthUnit),
      };
    if (this.by === "twist")
      return {
        of: shapes.twists(shape),
        title: "Twist per length",
        unit: "rad/m",
        floor: STRAIGHT / (sizeOf(shape) * shapes.lengthUnit),
      };
    if (this.by === "angle")
      return { of: shapes.anglesAlong(numbers), title: "Opening angle", unit: "°", floor: LEAST_ANGLE };
    if (this.by !== "stress") return null;
    this.ask(shapes);
    const { motion } = this.desk.session;
    const { stress } = this;
    const isShown = stress?.sequence === motion.sequence && this.desk.frame === motion.frames - 1;
    const of = isShown && stress ? stress.values : new Float32Array(shapes.stations).fill(Number.NaN);
    return {
      of,
      title: isShown ? "Stress of the final shape" : "Stress: known of final shapes",
      unit: "Pa",
      floor: LEAST_STRESS,
    };
  }

  /** Stations are others from now on: the linkage was cut anew. */
  forget(): void {
    this.stress = null;
    this.asked = 0n;
  }

  /** For the stresses of the newest final shape, where they are shown and not here yet. */
  ask(shapes: LinkageShapes): void {
    const { session } = this.desk;
    const { result } = session;
    if (this.by !== "stress" || !result?.converged || result.solveFailed) return;
    if (this.isAsking || this.asked === result.sequence) return;
    this.isAsking = true;
    this.asked = result.sequence;
    stresses(session, shapes.edges).then(
      (made) => {
        this.isAsking = false;
        if (made.values.length === shapes.stations && this.asked !== 0n) this.stress = made;
        this.changed();
      },
      (error) => {
        this.isAsking = false;
        this.by = "none";
        this.asked = 0n;
        this.desk.fail(error);
      },
    );
  }
}
