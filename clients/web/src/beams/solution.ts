import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import type { Values } from "../rods/picture";
import { doubles } from "../wire/arrays";
import { noiseOf } from "./diagram";

export type ColorBy = "none" | "utilisation" | "axial" | "bending" | "torque" | "stress";

export const COLOR_CHOICES: readonly [ColorBy, string][] = [
  ["none", "nothing"],
  ["utilisation", "utilisation"],
  ["axial", "axial force"],
  ["bending", "bending moment"],
  ["torque", "torque"],
  ["stress", "equivalent stress"],
];

/** What is smaller is not told from none: [Pa], [%]. */
const LEAST_STRESS = 1;
const LEAST_PERCENT = 1e-4;

/** size: of the structure [m]. Of each element at its start and finish, what is asked for. */
export function valuesOf(solution: BeamSolution, by: ColorBy, size: number): Values | null {
  const forces = doubles(solution.elementForces);
  const stresses = doubles(solution.elementStresses);
  const force = noiseOf(forces, size);
  const count = stresses.length / 5;
  const both = (value: (element: number, end: number) => number): Float32Array =>
    Float32Array.from({ length: 2 * count }, (_, i) => value(Math.floor(i / 2), i % 2));
  switch (by) {
    case "utilisation":
      return {
        of: both((element) => 100 * (stresses[5 * element + 4] ?? Number.NaN)),
        title: "Utilisation",
        unit: "%",
        floor: LEAST_PERCENT,
      };
    case "stress":
      return {
        of: both((element) => stresses[5 * element + 3] ?? Number.NaN),
        title: "Equivalent stress",
        unit: "Pa",
        floor: LEAST_STRESS,
      };
    case "axial":
      return {
        of: both((element) => forces[8 * element] ?? Number.NaN),
        title: "Axial force (pulled: positive)",
        unit: "N",
        floor: force,
      };
    case "torque":
      return {
        of: both((element) => forces[8 * element + 1] ?? Number.NaN),
        title: "Torque",
        unit: "N m",
        floor: force * size,
      };
    case "bending":
      return {
        of: both((element, end) =>
          Math.hypot(forces[8 * element + 4 + 2 * end] ?? 0, forces[8 * element + 5 + 2 * end] ?? 0),
        ),
        title: "Bending moment",
        unit: "N m",
        floor: force * size,
      };
    default:
      return null;
  }
}
