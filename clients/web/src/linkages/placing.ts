import { create } from "@bufbuild/protobuf";
import { Quaternion, Vector3 } from "three";
import { type SurfacePlacement, SurfacePlacementSchema } from "../../gen/limber/v1/design_pb";

const ITERATIONS = 2000;

/**
 * The turn and the move that bring points nearest to others, as a design does with its surface. (Horn 1987: the
 * quaternion is the eigenvector of the largest eigenvalue.) Returns null for fewer than three points, or if there are
 * not as many others.
 */
export function nearest(points: readonly Vector3[], onto: readonly Vector3[]): SurfacePlacement | null {
  if (points.length < 3 || points.length !== onto.length) return null;
  if ([...points, ...onto].some((point) => !Number.isFinite(point.x + point.y + point.z))) return null;
  const [from, to] = [mean(points), mean(onto)];
  // s[i][j]: sum of coordinate i of a point times coordinate j of the other, about their means.
  const s = [0, 1, 2].map((i) =>
    [0, 1, 2].map((j) =>
      points.reduce((sum, point, k) => {
        const other = onto[k] ?? to;
        return sum + (point.getComponent(i) - from.getComponent(i)) * (other.getComponent(j) - to.getComponent(j));
      }, 0),
    ),
  ) as [Row, Row, Row];
  const turn = largest(s);
  const move = to.clone().sub(from.clone().applyQuaternion(turn));
  const angle = 2 * Math.acos(Math.min(1, Math.max(-1, turn.w)));
  const axis = new Vector3(turn.x, turn.y, turn.z);
  if (axis.lengthSq() > 0) axis.setLength((angle * 180) / Math.PI);
  const plain = ({ x, y, z }: Vector3): { x: number; y: number; z: number } => ({ x, y, z });
  return create(SurfacePlacementSchema, { rotationDegrees: plain(axis), scale: 1, translation: plain(move) });
}

type Row = [number, number, number];

function mean(points: readonly Vector3[]): Vector3 {
  return points.reduce((sum, point) => sum.add(point), new Vector3()).divideScalar(points.length);
}

function largest([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]: [Row, Row, Row]): Quaternion {
  const n = [
    [xx + yy + zz, yz - zy, zx - xz, xy - yx],
    [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, yy - xx - zz, yz + zy],
    [xy - yx, zx + xz, yz + zy, zz - xx - yy],
  ];
  const shift = Math.hypot(...n.flat());
  let q = [1, 0.1, 0.2, 0.3];
  for (let i = 0; i < ITERATIONS && shift > 0; i++) {
    const next = n.map((row, a) => row.reduce((sum, value, b) => sum + value * (q[b] ?? 0), shift * (q[a] ?? 0)));
    const size = Math.hypot(...next);
    q = next.map((value) => value / size);
  }
  const [w, x, y, z] = q;
  return shift > 0 ? new Quaternion(x, y, z, w).normalize() : new Quaternion();
}
