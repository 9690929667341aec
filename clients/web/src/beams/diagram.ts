import type { Vector3 } from "three";
import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import { doubles } from "../wire/arrays";

export type DiagramOf = "none" | "axial" | "torque" | "shear2" | "shear3" | "moment2" | "moment3";

/** Of a diagram: columns of element_forces at the start and the finish of an element, and the axis that it is drawn along. */
interface Kind {
  title: string;
  unit: string;
  start: number;
  finish: number;
  axis: 2 | 3;
}

/** A moment about axis 2 bends the plane of axes 1 and 3, and is drawn there. */
const KINDS: Record<Exclude<DiagramOf, "none">, Kind> = {
  axial: { title: "Axial force N (pulled: positive)", unit: "N", start: 0, finish: 0, axis: 3 },
  torque: { title: "Torque T", unit: "N m", start: 1, finish: 1, axis: 3 },
  shear2: { title: "Shear force along axis 2", unit: "N", start: 2, finish: 2, axis: 2 },
  shear3: { title: "Shear force along axis 3", unit: "N", start: 3, finish: 3, axis: 3 },
  moment2: { title: "Bending moment about axis 2", unit: "N m", start: 4, finish: 6, axis: 3 },
  moment3: { title: "Bending moment about axis 3", unit: "N m", start: 5, finish: 7, axis: 2 },
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

const COLUMNS = 8;
/** Forces below this share of the largest force or moment (over the structure's size) are rounding of the solver. */
export const NOISE = 1e-7;

export interface Diagram extends Kind {
  /** Of each element at its start and its finish, as the solution has them. */
  values: Float64Array;
  low: number;
  high: number;
  /** The largest size; 0: nothing but rounding. */
  largest: number;
}

/** size: of the structure [m]. */
export function diagramOf(solution: BeamSolution, of: DiagramOf, size: number): Diagram | null {
  if (of === "none") return null;
  const kind = KINDS[of];
  const forces = doubles(solution.elementForces);
  const count = forces.length / COLUMNS;
  const values = new Float64Array(2 * count);
  for (let element = 0; element < count; element++) {
    values[2 * element] = forces[COLUMNS * element + kind.start] ?? 0;
    values[2 * element + 1] = forces[COLUMNS * element + kind.finish] ?? 0;
  }
  const floor = noiseOf(forces, size) * (kind.unit === "N m" ? size : 1);
  const [low, high] = [Math.min(0, ...values), Math.max(0, ...values)];
  const largest = Math.max(-low, high);
  return { ...kind, values, low, high, largest: largest > floor ? largest : 0 };
}

/** Of forces [N]: what is smaller is not told from none. Of moments this times the size. */
export function noiseOf(forces: Float64Array, size: number): number {
  let largest = 0;
  for (let i = 0; i < forces.length; i++) {
    const column = i % COLUMNS;
    const isForce = column === 0 || column === 2 || column === 3;
    largest = Math.max(largest, Math.abs(forces[i] ?? 0) / (isForce ? 1 : size));
  }
  return NOISE * largest;
}

/** One line of a table: what is in an element, at its start and its finish. */
export function forcesOf(solution: BeamSolution, element: number): [string, number, number, string][] {
  const forces = doubles(solution.elementForces).subarray(COLUMNS * element, COLUMNS * (element + 1));
  return Object.values(KINDS).map(({ title, start, finish, unit }) => [
    title,
    forces[start] ?? Number.NaN,
    forces[finish] ?? Number.NaN,
    unit,
  ]);
}

/** A part of a diagram of one sign, between two stations: on the beam, and as far beside it as the value is large. */
export interface Patch {
  base: [Vector3, Vector3];
  tip: [Vector3, Vector3];
  isPositive: boolean;
}

/**
 * The diagram over one element, whose value runs straight from start to finish.
 * stations: points on the beam, equally apart, and the direction of `axis` at each; scale: length per unit of the value.
 */
export function patchesOf(
  stations: readonly { point: Vector3; axis: Vector3 }[],
  start: number,
  finish: number,
  scale: number,
): Patch[] {
  const at = (share: number): { base: Vector3; tip: Vector3 } => {
    const place = share * (stations.length - 1);
    const i = Math.min(Math.floor(place), stations.length - 2);
    const [a, b] = [stations[i], stations[i + 1]];
    if (!a || !b) throw new Error("a beam has two stations at least");
    const base = a.point.clone().lerp(b.point, place - i);
    const axis = a.axis.clone().lerp(b.axis, place - i);
    return { base, tip: base.clone().addScaledVector(axis, scale * (start + share * (finish - start))) };
  };
  const shares = stations.map((_, i) => i / (stations.length - 1));
  if (start * finish < 0) shares.push(start / (start - finish));
  shares.sort((a, b) => a - b);
  return shares.slice(1).map((share, i) => {
    const [from, to] = [shares[i] ?? 0, share];
    const [a, b] = [at(from), at(to)];
    const middle = start + ((from + to) / 2) * (finish - start);
    return { base: [a.base, b.base], tip: [a.tip, b.tip], isPositive: middle >= 0 };
  });
}
