import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import type { Values } from "../rods/picture";
import { doubles } from "../wire/arrays";
import { alongElements, noiseOf } from "./diagram";

export type ColorBy = "none" | "utilisation" | "axial" | "bending" | "torque" | "stress";

export const COLOR_CHOICES: readonly [ColorBy, string][] = [
  ["none", "nothing"],
  ["utilisation", "utilisation"],
  ["axial", "axial force"],
  ["bending", "bending moment"],
  ["torque", "torque"],
  ["stress", "equivalent stress"],
];

/** Smaller values are treated as zero: [Pa], [%]. */
const LEAST_STRESS = 1;
const LEAST_PERCENT = 1e-4;

/** size: of the structure [m]. The values that colours show, for each element at its stations. */
export function valuesOf(solution: BeamSolution, by: ColorBy, size: number): Values | null {
  const force = noiseOf(doubles(solution.elementExtremes), size);
  const along = (column: number): Float64Array => joined(alongElements(solution, column));
  const values = (of: Float64Array, title: string, unit: string, floor: number): Values => ({
    of: Float32Array.from(of),
    title,
    unit,
    floor,
  });
  switch (by) {
    case "utilisation":
      return values(
        along(7).map((share) => 100 * share),
        "Utilisation",
        "%",
        LEAST_PERCENT,
      );
    case "stress":
      return values(along(6), "Equivalent stress", "Pa", LEAST_STRESS);
    case "axial":
      return values(along(0), "Axial force (pulled: positive)", "N", force);
    case "torque":
      return values(along(1), "Torque", "N m", force * size);
    case "bending": {
      const about3 = along(5);
      return values(
        along(4).map((about2, i) => Math.hypot(about2, about3[i] ?? 0)),
        "Bending moment",
        "N m",
        force * size,
      );
    }
    default:
      return null;
  }
}

function joined(parts: readonly Float64Array[]): Float64Array {
  const all = new Float64Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}
