import { Vector3 } from "three";
import type { GetGeometryResponse } from "../../gen/limber/v1/service_pb";
import type { RodShape, Strip } from "../rods/sweep";
import { counterclockwise } from "../rods/sweep";
import { doubles, integers, type Reals } from "../wire/arrays";

/** How the numbers of a frame make a shape (LinkageGeometry): of each segment its vertices and directors, then angles. */
export class LinkageShapes {
  readonly edges: readonly number[];
  readonly joints: number;
  readonly outline: readonly (readonly [number, number])[];
  /** segments x 2; -1: a free end. */
  readonly ends: Int32Array;
  /** Stations of all segments. */
  readonly stations: number;
  /** Hash of the geometry: it changes if the linkage was cut into more edges. */
  readonly hash: string;
  private readonly coordinates: number;

  /** lengthUnit [m] */
  constructor(
    geometry: GetGeometryResponse,
    readonly lengthUnit = 1,
  ) {
    this.hash = geometry.basisHash;
    const made = geometry.linkage;
    this.edges = made?.edges ?? [];
    this.joints = made?.vertexOfJoint.length ?? 0;
    this.coordinates = made?.coordinates ?? 0;
    this.ends = integers(made?.jointsOfSegment);
    const corners = doubles(made?.outline);
    this.outline = counterclockwise(
      Array.from({ length: corners.length / 2 }, (_, i) => [corners[2 * i] ?? 0, corners[2 * i + 1] ?? 0] as const),
    );
    this.stations = this.edges.reduce((sum, count) => sum + count + 1, 0);
  }

  get strips(): Strip[] {
    return this.edges.map((edges) => ({ edges, outline: this.outline }));
  }

  fits(frame: Reals): boolean {
    return frame.length === this.coordinates;
  }

  /** Centrelines and directors as the sweep takes them; values: one a station, 0 .. 1. */
  shape(frame: Reals, values: Float32Array | null): RodShape {
    const line = new Float64Array(4 * this.stations);
    const directors = new Float32Array(4 * this.stations);
    let at = 0;
    let station = 0;
    for (const edges of this.edges) {
      for (let i = 0; i <= edges; i++)
        for (let axis = 0; axis < 3; axis++) line[4 * (station + i) + axis] = frame[at + 3 * i + axis] ?? 0;
      at += 3 * (edges + 1);
      for (let i = 0; i < edges; i++)
        for (let axis = 0; axis < 3; axis++) directors[4 * (station + i) + axis] = frame[at + 3 * i + axis] ?? 0;
      at += 3 * edges;
      station += edges + 1;
    }
    for (let i = 0; i < this.stations; i++) line[4 * i + 3] = values?.[i] ?? 0;
    return { line, directors };
  }

  /** Positions of joints; of one without a segment: not a number. */
  jointPositions(frame: Reals): Vector3[] {
    const made = Array.from({ length: this.joints }, () => new Vector3(Number.NaN, 0, 0));
    let at = 0;
    this.edges.forEach((edges, segment) => {
      const vertex = (i: number): Vector3 => new Vector3().fromArray(frame, at + 3 * i);
      const pairs = [
        [0, 1],
        [edges, edges - 1],
      ] as const;
      pairs.forEach(([outer, inner], end) => {
        const joint = this.ends[2 * segment + end] ?? -1;
        if (joint >= 0) made[joint] = vertex(outer).add(vertex(inner)).multiplyScalar(0.5);
      });
      at += 6 * edges + 3;
    });
    return made;
  }

  /** Opening angle of each joint [degree]. */
  angles(frame: Reals): Float32Array {
    return Float32Array.from(frame.subarray(frame.length - this.joints), (angle) => (angle * 180) / Math.PI);
  }

  /** Curvature of the centreline at each station [1/m]. */
  curvatures(shape: RodShape): Float32Array {
    return this.perStation(shape, (before, here, after) => {
      const a = here.clone().sub(before);
      const b = after.clone().sub(here);
      return (2 * a.angleTo(b)) / Math.max((a.length() + b.length()) * this.lengthUnit, 1e-30);
    });
  }

  /** Twist per length at each station [radian/m]: of directors, beyond the parallel transport of one to the next. */
  twists(shape: RodShape): Float32Array {
    const director = (station: number): Vector3 => new Vector3().fromArray(shape.directors, 4 * station);
    return this.perStation(shape, (before, here, after, station) => {
      const a = here.clone().sub(before);
      const b = after.clone().sub(here);
      const length = (a.length() + b.length()) / 2;
      const from = a.clone().normalize();
      const to = b.clone().normalize();
      const carried = transport(director(station - 1), from, to);
      const next = director(station);
      const angle = Math.atan2(to.dot(carried.clone().cross(next)), carried.dot(next));
      return Math.abs(angle) / Math.max(length * this.lengthUnit, 1e-30);
    });
  }

  /** Angles of joints, from one end of each segment to the other. */
  anglesAlong(frame: Reals): Float32Array {
    const angles = this.angles(frame);
    const made = new Float32Array(this.stations);
    let station = 0;
    this.edges.forEach((edges, segment) => {
      const [first, last] = [this.ends[2 * segment] ?? -1, this.ends[2 * segment + 1] ?? -1];
      const a = angles[first >= 0 ? first : last] ?? Number.NaN;
      const b = angles[last >= 0 ? last : first] ?? Number.NaN;
      for (let i = 0; i <= edges; i++) made[station + i] = a + ((b - a) * i) / edges;
      station += edges + 1;
    });
    return made;
  }

  private perStation(
    { line }: RodShape,
    value: (before: Vector3, here: Vector3, after: Vector3, station: number) => number,
  ): Float32Array {
    const made = new Float32Array(this.stations);
    const vertex = (station: number): Vector3 => new Vector3().fromArray(line, 4 * station);
    let first = 0;
    for (const edges of this.edges) {
      for (let i = 1; i < edges; i++)
        made[first + i] = value(vertex(first + i - 1), vertex(first + i), vertex(first + i + 1), first + i);
      made[first] = made[first + 1] ?? 0;
      made[first + edges] = made[first + edges - 1] ?? 0;
      first += edges + 1;
    }
    return made;
  }
}

/** A vector turned as one direction is turned into another, without twist. */
function transport(vector: Vector3, from: Vector3, to: Vector3): Vector3 {
  const axis = from.clone().cross(to);
  const sine = axis.length();
  if (sine < 1e-12) return vector;
  return vector.clone().applyAxisAngle(axis.divideScalar(sine), Math.atan2(sine, from.dot(to)));
}
