import type { Scene } from "../../gen/limber/v1/scene_pb";
import {
  BranchEvent,
  type ResultInfo,
  SessionState,
  type SessionStatus,
  SolveStatus,
} from "../../gen/limber/v1/service_pb";
import { number } from "../controls/dom";

/** Unit of a scene's lengths, after a number. */
export function lengthUnit(scene: Pick<Scene, "lengthUnitInMetres"> | null): string {
  return (scene?.lengthUnitInMetres || 1) === 1 ? "m" : "units";
}

/** How sure a line is: the page shows each in its colour and with its sign. */
export type Tone = "good" | "busy" | "warning" | "bad";

export interface Line {
  tone: Tone;
  text: string;
}

const STATUS: Record<number, string> = {
  [SolveStatus.UNSPECIFIED]: "solved",
  [SolveStatus.CONVERGED]: "converged",
  [SolveStatus.IMPROVED]: "improving",
  [SolveStatus.ITERATION_LIMIT]: "stopped at the limit of iterations, not converged",
  [SolveStatus.STALLED]: "stalled before it converged",
  [SolveStatus.CANCELLED]: "cancelled",
  [SolveStatus.SADDLE]: "balanced, but not stable",
  [SolveStatus.UNBALANCED]: "not in balance: nothing holds what is pushed",
};

/** The state of a session in one line. */
export function describeState(status: SessionStatus): Line {
  const progress = status.progress;
  switch (status.state) {
    case SessionState.BUILDING: {
      const share = progress ? ` ${Math.round(100 * progress.fraction)} %` : "";
      return { tone: "busy", text: `building the model: ${progress?.stage || "starting"}${share}` };
    }
    case SessionState.READY:
      return { tone: "good", text: "ready" };
    case SessionState.FAILED:
      return { tone: "bad", text: `no model: ${status.message}` };
    case SessionState.CLOSED:
      return { tone: "bad", text: "closed" };
    default:
      return { tone: "busy", text: "waiting" };
  }
}

/** How the newest result stands, in one line. */
export function describeResult(result: ResultInfo): Line {
  const revision = `revision ${result.revision}`;
  if (result.solveFailed) return { tone: "bad", text: `${revision}: no solution, the motion before is shown` };
  if (result.firstPicture) return { tone: "busy", text: `${revision}: first picture, the model is still being built` };
  if (result.design) return { tone: "busy", text: `step ${result.design.iteration} of a design` };
  const status = STATUS[result.status] ?? "solved";
  if (!result.converged) return { tone: "busy", text: `${revision}: ${status === "converged" ? "improving" : status}` };
  const tone: Tone = result.status === SolveStatus.CONVERGED ? "good" : "warning";
  return { tone, text: `${revision}: final, ${status}` };
}

/** Warning if the material does not bear the shape. */
export function describeStrength(result: ResultInfo): Line | null {
  const utilisation = result.beams?.largestUtilisation ?? 0;
  if (utilisation <= 1 || result.solveFailed) return null;
  const text = `overloaded: the largest stress is ${number(utilisation)} times the yield stress, and limber computes on as if nothing yielded`;
  return { tone: "bad", text };
}

/** Places on the path to the result where its shape jumped to another. */
export function describeSnaps(result: ResultInfo): Line | null {
  const ofBeams = (result.beams?.snaps ?? []).map(
    ({ progress, node }) => `${number(100 * progress, 2)} % of the path, near node ${node}`,
  );
  const isSnap = (event: BranchEvent): boolean => event === BranchEvent.LIMIT_POINT || event === BranchEvent.JUMP;
  const ofLinkage = (result.linkage?.path ?? [])
    .filter(({ event }) => isSnap(event))
    .map(
      ({ progress, meanAngleDegrees }) => `${number(100 * progress, 2)} % of the path, at ${number(meanAngleDegrees)}°`,
    );
  const places = [...ofBeams, ...ofLinkage];
  if (!places.length) return null;
  const more = places.length > 3 ? `, and ${places.length - 3} more times` : "";
  return { tone: "warning", text: `The structure snapped at ${places.slice(0, 3).join("; ")}${more}.` };
}

const LISTED = 3;

/** Targets of a body that the motion does not reach. unit: of the scene's lengths. */
export function describeReach(result: ResultInfo, unit: string): Line | null {
  const missed = result.outOfReach;
  if (!missed.length || result.solveFailed) return null;
  const places = missed
    .slice(0, LISTED)
    .map(({ constraint, distance }) => `constraint ${constraint} (${number(distance)} ${unit} left)`);
  const rest = missed.length - LISTED;
  const more = rest > 0 ? `; and ${rest} more` : "";
  return { tone: "warning", text: `out of reach: ${places.join("; ")}${more}` };
}

/** For a body: the starts that were compared for the shown motion. unit: of the scene's lengths. */
export function describeStarts(result: ResultInfo, unit: string): Line | null {
  const { starts } = result;
  if (!starts || result.solveFailed) return null;
  const { compared, optima, unconverged, largestDistance } = starts;
  const found = optima === 0 ? "none converged" : optima === 1 ? "one optimum" : `${optima} optima`;
  const others = optima > 0 && unconverged > 0 ? `, ${unconverged} not converged` : "";
  const text = `${compared} starts compared: ${found}${others}, up to ${number(largestDistance)} ${unit} apart`;
  return { tone: optima === 1 && !others ? "good" : "warning", text };
}

/** How near the shown result is to the exact one, as far as it was checked. */
export function describeAccuracy(result: ResultInfo): Line | null {
  const motion = result.motionError;
  if (motion) {
    const share = `${number(100 * motion.shapeError, 2)} %`;
    const worst = `${number(100 * motion.worstFrameError, 2)} % in frame ${motion.worstFrame}`;
    return motion.withinTolerance
      ? { tone: "good", text: `checked: off by ${share} in the mean, ${worst} at worst; within the tolerance` }
      : {
          tone: "warning",
          text: `checked: off by ${share} in the mean, ${worst} at worst; beyond the tolerance of ${number(100 * motion.tolerance, 2)} %`,
        };
  }
  const elements = result.discretisationError;
  if (elements) {
    if (!elements.comparedElements) return { tone: "warning", text: `not checked: ${elements.message}` };
    const others = [
      elements.momentError === undefined ? "" : `, bending moments by ${number(100 * elements.momentError, 2)} %`,
      elements.utilisationError === undefined
        ? ""
        : `, utilisations by ${number(100 * elements.utilisationError, 2)} %`,
      elements.stressError === undefined
        ? ""
        : `, stresses by ${number(100 * elements.stressError, 2)} % (${number(elements.maxStressError)} Pa in segment ${elements.worstStressSegment})`,
    ];
    const text = `checked: positions are off by ${number(100 * (elements.positionError ?? 0), 2)} % of the size (${number(elements.maxDistance ?? 0)} m)${others.join("")} by the discretisation`;
    return { tone: elements.withinTolerance ? "good" : "warning", text };
  }
  if (!result.converged || result.solveFailed) return null;
  return { tone: "busy", text: "not checked yet" };
}
