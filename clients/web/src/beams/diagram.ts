import type { Vector3 } from "three";
import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import { doubles } from "../wire/arrays";

export type DiagramOf = "none" | "axial" | "torque" | "shear2" | "shear3" | "moment2" | "moment3";

/** A kind of diagram: its column of stations and row of element_extremes, and the axis that it is drawn along. */
interface Kind {
  title: string;
  unit: string;
  column: number;
  axis: 2 | 3;
}

/** A moment about axis 2 bends the plane of axes 1 and 3, and is drawn there. */
const KINDS: Record<Exclude<DiagramOf, "none">, Kind> = {
  axial: { title: "Axial force N (pulled: positive)", unit: "N", column: 0, axis: 3 },
  torque: { title: "Torque T", unit: "N m", column: 1, axis: 3 },
  shear2: { title: "Shear force along axis 2", unit: "N", column: 2, axis: 2 },
  shear3: { title: "Shear force along axis 3", unit: "N", column: 3, axis: 3 },
  moment2: { title: "Bending moment about axis 2", unit: "N m", column: 4, axis: 3 },
  moment3: { title: "Bending moment about axis 3", unit: "N m", column: 5, axis: 2 },
};

export const DIAGRAM_CHOICES: readonly [DiagramOf, string][] = [
  ["none", "none"],
  ["axial", "axial force N"],
  ["moment2", "bending moment about axis 2"],
  ["moment3", "bending moment about axis 3"],
  ["torque", "torque T"],
  ["shear2", "shear force along axis 2"],
  ["shear3", "shear force along axis 3"],
];

/** Stations along an element that the page asks for. */
export const STATIONS = 21;
/** Columns of a station: six forces and moments, the equivalent stress, the utilisation. */
export const STATION_COLUMNS = 8;
/** Columns of element_extremes: six rows of the smallest value, its place, the largest, its place. */
const EXTREMES = 4;
const KIND_COUNT = 6;
/** Forces below this share of the largest force or moment (over the structure's size) are rounding of the solver. */
export const NOISE = 1e-7;

export interface Diagram extends Kind {
  /** Values of each element at its stations, from start to finish. */
  values: Float64Array[];
  low: number;
  high: number;
  /** The largest size; 0: nothing but rounding. */
  largest: number;
}

/** The smallest and the largest value of a force or moment along an element; not a number where the solution has none. */
function extremesOf(extremes: Float64Array, element: number, kind: Kind): [number, number] {
  const at = EXTREMES * (KIND_COUNT * element + kind.column);
  return [extremes[at] ?? Number.NaN, extremes[at + 2] ?? Number.NaN];
}

/** One column of each element at its stations. */
export function alongElements(solution: BeamSolution, column: number): Float64Array[] {
  const stations = solution.stations ? doubles(solution.stations) : new Float64Array(0);
  const count = Number(solution.stations?.shape[1] ?? 0);
  const elements = count > 0 ? stations.length / (STATION_COLUMNS * count) : 0;
  return Array.from({ length: elements }, (_, element) =>
    Float64Array.from({ length: count }, (_, i) => stations[STATION_COLUMNS * (count * element + i) + column] ?? 0),
  );
}

/** size: of the structure [m]. */
export function diagramOf(solution: BeamSolution, of: DiagramOf, size: number): Diagram | null {
  if (of === "none") return null;
  const kind = KINDS[of];
  const extremes = doubles(solution.elementExtremes);
  const values = alongElements(solution, kind.column);
  let [low, high] = [0, 0];
  for (let element = 0; element < values.length; element++) {
    const [least, largest] = extremesOf(extremes, element, kind);
    [low, high] = [Math.min(low, least), Math.max(high, largest)];
  }
  const floor = noiseOf(extremes, size) * (kind.unit === "N m" ? size : 1);
  const largest = Math.max(-low, high);
  return { ...kind, values, low, high, largest: largest > floor ? largest : 0 };
}

/** Forces [N] below this are treated as zero. For moments it is multiplied by the size. extremes: of all elements. */
export function noiseOf(extremes: Float64Array, size: number): number {
  const kinds = Object.values(KINDS);
  let largest = 0;
  for (let element = 0; EXTREMES * KIND_COUNT * element < extremes.length; element++)
    for (const kind of kinds) {
      const [least, most] = extremesOf(extremes, element, kind);
      largest = Math.max(largest, Math.max(-least, most) / (kind.unit === "N" ? 1 : size));
    }
  return NOISE * largest;
}

/** One line of a table: the smallest and the largest value along an element. */
export function forcesOf(solution: BeamSolution, element: number): [string, number, number, string][] {
  const extremes = doubles(solution.elementExtremes);
  return Object.values(KINDS).map((kind) => [kind.title, ...extremesOf(extremes, element, kind), kind.unit]);
}

/** A part of a diagram of one sign, between two stations: on the beam, and at the distance of the value from it. */
export interface Patch {
  base: [Vector3, Vector3];
  tip: [Vector3, Vector3];
  isPositive: boolean;
}

/**
 * The diagram over one element, straight from one value to the next. `points`: on the beam, equally spaced, and the
 * direction of `axis` at each. `values`: equally spaced, too, two at least; scale: length per unit of the value.
 */
export function patchesOf(
  points: readonly { point: Vector3; axis: Vector3 }[],
  values: ArrayLike<number>,
  scale: number,
): Patch[] {
  const valueAt = (share: number): number => {
    const place = share * (values.length - 1);
    const i = Math.min(Math.floor(place), values.length - 2);
    return (values[i] ?? 0) + (place - i) * ((values[i + 1] ?? 0) - (values[i] ?? 0));
  };
  const at = (share: number): { base: Vector3; tip: Vector3 } => {
    const place = share * (points.length - 1);
    const i = Math.min(Math.floor(place), points.length - 2);
    const [a, b] = [points[i], points[i + 1]];
    if (!a || !b) throw new Error("a beam has two stations at least");
    const base = a.point.clone().lerp(b.point, place - i);
    const axis = a.axis.clone().lerp(b.axis, place - i);
    return { base, tip: base.clone().addScaledVector(axis, scale * valueAt(share)) };
  };
  const shares = sharesOf(points.length, values);
  return shares.slice(1).map((share, i) => {
    const [from, to] = [shares[i] ?? 0, share];
    const [a, b] = [at(from), at(to)];
    return { base: [a.base, b.base], tip: [a.tip, b.tip], isPositive: valueAt((from + to) / 2) >= 0 };
  });
}

/** Ends of patches: at points, at values, and at places where the value changes its sign. */
function sharesOf(points: number, values: ArrayLike<number>): number[] {
  const shares = new Set<number>();
  for (let i = 0; i < points; i++) shares.add(i / (points - 1));
  for (let i = 0; i < values.length; i++) {
    shares.add(i / (values.length - 1));
    const [before, after] = [values[i - 1] ?? 0, values[i] ?? 0];
    if (before * after < 0) shares.add((i - 1 + before / (before - after)) / (values.length - 1));
  }
  return [...shares].sort((a, b) => a - b);
}
