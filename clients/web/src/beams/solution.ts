import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import { doubles } from "../wire/arrays";

export type ColorBy = "none" | "utilisation" | "axial" | "bending" | "torque" | "stress";

export const COLOR_CHOICES: readonly [ColorBy, string][] = [
  ["none", "nothing"],
  ["utilisation", "utilisation"],
  ["axial", "axial force"],
  ["bending", "bending moment"],
  ["torque", "torque"],
  ["stress", "equivalent stress"],
];

/** Of each element at its start and finish, what is asked for. */
export function valuesOf(
  solution: BeamSolution,
  by: ColorBy,
): { of: Float32Array; title: string; unit: string } | null {
  const forces = doubles(solution.elementForces);
  const stresses = doubles(solution.elementStresses);
  const count = stresses.length / 5;
  const both = (value: (element: number, end: number) => number): Float32Array =>
    Float32Array.from({ length: 2 * count }, (_, i) => value(Math.floor(i / 2), i % 2));
  switch (by) {
    case "utilisation":
      return {
        of: both((element) => 100 * (stresses[5 * element + 4] ?? Number.NaN)),
        title: "Utilisation",
        unit: "%",
      };
    case "stress":
      return { of: both((element) => stresses[5 * element + 3] ?? Number.NaN), title: "Equivalent stress", unit: "Pa" };
    case "axial":
      return {
        of: both((element) => forces[8 * element] ?? Number.NaN),
        title: "Axial force (pulled: positive)",
        unit: "N",
      };
    case "torque":
      return { of: both((element) => forces[8 * element + 1] ?? Number.NaN), title: "Torque", unit: "N m" };
    case "bending":
      return {
        of: both((element, end) =>
          Math.hypot(forces[8 * element + 4 + 2 * end] ?? 0, forces[8 * element + 5 + 2 * end] ?? 0),
        ),
        title: "Bending moment",
        unit: "N m",
      };
    default:
      return null;
  }
}
