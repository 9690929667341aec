import { Vector3 } from "three";
import type { MotionBuffer } from "../session/motion";
import { isSamePlace, type Place, positionOf } from "./places";
import type { BodySurface } from "./surface";

export interface Line {
  from: Vector3;
  to: Vector3;
  color: number;
}

const MAX_FRAMES = 4000;
const MAX_TRACES = 12;
/** At most this many nodes of a group stand for all. */
const MAX_NODES = 20;

/** Trajectories of held places, frame by frame. */
export function tracesOf(places: Place[], surface: BodySurface, motion: MotionBuffer, color: number): Line[] {
  const { basis } = surface;
  if (!basis || motion.frames > MAX_FRAMES) return [];
  const traced = places.filter((place, i) => places.findIndex((one) => isSamePlace(one, place)) === i);
  const lines: Line[] = [];
  for (const place of traced.slice(0, MAX_TRACES)) {
    const { nodes } = place;
    const step = Math.ceil(nodes.length / MAX_NODES);
    const some = nodes.length > MAX_NODES ? nodes.filter((_, i) => i % step === 0) : nodes;
    const held = surface.held({ ...place, nodes: some });
    let before = new Vector3(...positionOf(held, basis, motion.frame(0)));
    for (let frame = 1; frame < motion.frames; frame++) {
      const next = new Vector3(...positionOf(held, basis, motion.frame(frame)));
      lines.push({ from: before, to: next, color });
      before = next;
    }
  }
  return lines;
}
