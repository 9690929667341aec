import { TimeDiscretisation } from "../../gen/limber/v1/scene_pb";

/** How lively or calm a motion is. */
export interface Liveliness {
  discretisation: TimeDiscretisation;
  dampingRatio: number; // of critical
  forceSmoothing: number; // seconds
}

const LIVELIEST: Liveliness = {
  discretisation: TimeDiscretisation.SAMPLED,
  dampingRatio: 0.05,
  forceSmoothing: 0.1,
};
export const DEFAULT: Liveliness = {
  discretisation: TimeDiscretisation.SAMPLED,
  dampingRatio: 0.7,
  forceSmoothing: 0.5,
};
/** The place of DEFAULT. */
const AT_DEFAULT = 0.8;

/** calm: from 0 (lively) to 1 (calm). Both numbers grow by the same factor from place to place. */
export function liveliness(calm: number): Liveliness {
  const share = calm / AT_DEFAULT;
  const between = (from: number, to: number): number => from * (to / from) ** share;
  return {
    discretisation: TimeDiscretisation.SAMPLED,
    dampingRatio: Math.min(0.95, between(LIVELIEST.dampingRatio, DEFAULT.dampingRatio)),
    forceSmoothing: between(LIVELIEST.forceSmoothing, DEFAULT.forceSmoothing),
  };
}

/** The place of these numbers, or of those next to them. */
export function calmness(of: Liveliness): number {
  if (of.discretisation === TimeDiscretisation.DIFFERENCES) return 0;
  const place = (value: number, from: number, to: number): number =>
    (AT_DEFAULT * Math.log(Math.max(value, from) / from)) / Math.log(to / from);
  const mean =
    (place(of.dampingRatio, LIVELIEST.dampingRatio, DEFAULT.dampingRatio) +
      place(of.forceSmoothing, LIVELIEST.forceSmoothing, DEFAULT.forceSmoothing)) /
    2;
  return Math.min(1, mean);
}
