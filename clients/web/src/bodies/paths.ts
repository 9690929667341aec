import type { Constraint } from "../../gen/limber/v1/scene_pb";
import { describePlace, placeOf } from "./places";

/** A key of a path; of a constraint in a single frame there is one. */
export interface Key {
  frame: number;
  target: [number, number, number];
}

export function keysOf(constraint: Constraint): Key[] {
  const { value } = constraint.target;
  const keys: Key[] = [{ frame: constraint.frame, target: value ? [value.x, value.y, value.z] : [0, 0, 0] }];
  for (const { frame, target } of constraint.path) {
    const before = keys[keys.length - 1] as Key;
    keys.push({ frame, target: target ? [target.x, target.y, target.z] : before.target });
  }
  return keys;
}

export function lastFrame(constraint: Constraint): number {
  return constraint.path[constraint.path.length - 1]?.frame ?? constraint.frame;
}

export function covers(constraint: Constraint, frame: number): boolean {
  return frame >= constraint.frame && frame <= lastFrame(constraint);
}

/** A line of a list. */
export function describeConstraint(constraint: Constraint): string {
  const until = constraint.path.length ? ` to ${lastFrame(constraint)}` : "";
  const exact = constraint.enforcement.case === "exact" ? ", exact" : "";
  const velocity = constraint.target.case === "velocity" ? ", velocity" : "";
  return `frame ${constraint.frame}${until}: ${describePlace(placeOf(constraint))}${exact}${velocity}`;
}

/** The path with other keys, as a constraint has it. */
export function pathOf(keys: Key[]): { frame: number; target: { x: number; y: number; z: number } }[] {
  return keys.slice(1).map(({ frame, target: [x, y, z] }) => ({ frame, target: { x, y, z } }));
}

/**
 * Position of a path in a frame, in the kind and unit of its target: the server's value there (Constraint.path),
 * monotone between keys on each axis.
 */
export function targetIn(constraint: Constraint, frame: number): [number, number, number] {
  const keys = keysOf(constraint);
  const first = keys[0] as Key;
  const last = keys[keys.length - 1] as Key;
  if (frame <= first.frame) return first.target;
  if (frame >= last.frame) return last.target;
  const piece = keys.findIndex((key) => key.frame > frame) - 1;
  const from = keys[piece] as Key;
  const to = keys[piece + 1] as Key;
  const length = to.frame - from.frame;
  const s = (frame - from.frame) / length;
  const rest = 1 - s;
  const at = (axis: 0 | 1 | 2): number =>
    from.target[axis] +
    s * s * (1 + 2 * rest) * (to.target[axis] - from.target[axis]) +
    length *
      (s * rest * rest * slope(constraint, keys, piece, axis) -
        s * s * rest * slope(constraint, keys, piece + 1, axis));
  return [at(0), at(1), at(2)];
}

function slope(constraint: Constraint, keys: Key[], number: number, axis: 0 | 1 | 2): number {
  const frames = (piece: number): number => (keys[piece + 1] as Key).frame - (keys[piece] as Key).frame;
  const speed = (piece: number): number =>
    ((keys[piece + 1] as Key).target[axis] - (keys[piece] as Key).target[axis]) / frames(piece);
  if (number === 0) return (1 - (constraint.easeIn ?? 1)) * speed(0);
  if (number === keys.length - 1) return (1 - (constraint.easeOut ?? 1)) * speed(number - 1);
  const before = speed(number - 1);
  const after = speed(number);
  if (!(before * after > 0)) return 0;
  const share = (1 + frames(number) / (frames(number - 1) + frames(number))) / 3;
  return (before * after) / (share * after + (1 - share) * before);
}
