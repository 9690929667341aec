import type { Object3D, Vector3 } from "three";

/**
 * Puts an object at the first of some points, and makes the numbers of its buffer, relative to it. The GPU has single
 * precision, which is not sufficient far from the scene's origin.
 */
export function placed(object: Object3D, points: readonly Vector3[]): Float32Array {
  const [first] = points;
  if (first) object.position.copy(first);
  const made = new Float32Array(3 * points.length);
  points.forEach((point, i) => {
    point
      .clone()
      .sub(object.position)
      .toArray(made, 3 * i);
  });
  return made;
}
