import { Quaternion, Vector3 } from "three";
import type { BeamSection, BeamStructure } from "../../gen/limber/v1/beam_structure_pb";
import type { GetGeometryResponse } from "../../gen/limber/v1/service_pb";
import type { RodShape, Strip } from "../rods/sweep";
import { integers, type Reals, reals } from "../wire/arrays";

/** Edges that an element is drawn with, and where there are many elements. */
const DRAWN_EDGES = 8;
const FEW_EDGES = 3;
const MANY_ELEMENTS = 1500;
const ROUND_CORNERS = 14;
/** Share of a structure's size: thinner beams are drawn with this thickness, to be visible. */
const LEAST_SHARE = 0.003;

/** A section's outline in (axis 2, axis 3). least: half of the least thickness drawn. */
export function outlineOf(section: BeamSection | undefined, least: number): [number, number][] {
  const { shape } = section ?? { shape: { case: undefined } as const };
  if (shape.case === "rectangle") {
    const x = Math.max(shape.value.width / 2, least);
    const y = Math.max(shape.value.height / 2, least);
    return [
      [-x, -y],
      [x, -y],
      [x, y],
      [-x, y],
    ];
  }
  const radius = Math.max(shape.case === "tube" ? shape.value.outerRadius : 0, least);
  return Array.from({ length: ROUND_CORNERS }, (_, i) => {
    const angle = (2 * Math.PI * i) / ROUND_CORNERS;
    return [radius * Math.cos(angle), radius * Math.sin(angle)];
  });
}

/** How frames of a structure of beams make a shape: of each node its position and its rotation from rest. */
export class BeamShapes {
  readonly rest: Reals;
  /** elements x 2 */
  readonly elements: Int32Array;
  readonly nodes: number;
  readonly drawnEdges: number;
  readonly size: number;
  private readonly normals: Vector3[];

  constructor(
    geometry: GetGeometryResponse,
    private readonly structure: BeamStructure | undefined,
  ) {
    this.rest = reals(geometry.rest);
    this.elements = integers(geometry.beams?.elements);
    this.nodes = this.rest.length / 3;
    this.drawnEdges = this.count > MANY_ELEMENTS ? FEW_EDGES : DRAWN_EDGES;
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = low.clone().negate();
    for (let node = 0; node < this.nodes; node++) {
      low.min(this.restOf(node));
      high.max(this.restOf(node));
    }
    this.size = high.distanceTo(low);
    this.normals = Array.from({ length: this.count }, (_, element) => this.normalOf(element));
  }

  get count(): number {
    return this.elements.length / 2;
  }

  get strips(): Strip[] {
    const outlines = new Map<number, [number, number][]>();
    return Array.from({ length: this.count }, (_, element) => {
      const section = this.structure?.elements[element]?.section ?? 0;
      const outline = outlines.get(section) ?? outlineOf(this.structure?.sections[section], LEAST_SHARE * this.size);
      outlines.set(section, outline);
      return { edges: this.drawnEdges, outline };
    });
  }

  fits(frame: Reals): boolean {
    return frame.length === 7 * this.nodes;
  }

  position(frame: Reals, node: number): Vector3 {
    return new Vector3().fromArray(frame, 7 * node);
  }

  ends(element: number): [number, number] {
    return [this.elements[2 * element] ?? 0, this.elements[2 * element + 1] ?? 0];
  }

  /** Elements bend as cubics between their nodes. values: of each element at equal distances, from its start to its finish, 0 .. 1. */
  shape(frame: Reals, values: Float32Array | null): RodShape {
    const stations = this.drawnEdges + 1;
    const line = new Float64Array(4 * stations * this.count);
    const directors = new Float32Array(line.length);
    const point = new Vector3();
    const normal = new Vector3();
    for (let element = 0; element < this.count; element++) {
      const [a, b] = this.ends(element);
      const x0 = this.position(frame, a);
      const x1 = this.position(frame, b);
      const turns = [this.rotation(frame, a), this.rotation(frame, b)] as const;
      const drawn = this.restOf(b).sub(this.restOf(a)).normalize();
      const chord = x1.distanceTo(x0);
      const t0 = drawn.clone().applyQuaternion(turns[0]).multiplyScalar(chord);
      const t1 = drawn.clone().applyQuaternion(turns[1]).multiplyScalar(chord);
      const at = 4 * stations * element;
      for (let i = 0; i < stations; i++) {
        const s = i / this.drawnEdges;
        const [h00, h10] = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2];
        const [h01, h11] = [s * s * (3 - 2 * s), s * s * (s - 1)];
        point
          .set(0, 0, 0)
          .addScaledVector(x0, h00)
          .addScaledVector(t0, h10)
          .addScaledVector(x1, h01)
          .addScaledVector(t1, h11);
        point.toArray(line, at + 4 * i);
        line[at + 4 * i + 3] = values ? this.valueAt(values, element, s) : 0;
      }
      for (let i = 0; i < this.drawnEdges; i++) {
        const middle = turns[0].clone().slerp(turns[1], (i + 0.5) / this.drawnEdges);
        normal.copy(this.normals[element] ?? drawn).applyQuaternion(middle);
        const along = point
          .fromArray(line, at + 4 * (i + 1))
          .clone()
          .sub(new Vector3().fromArray(line, at + 4 * i));
        normal
          .cross(along)
          .normalize()
          .toArray(directors, at + 4 * i);
      }
    }
    return { line, directors };
  }

  /** Stations of an element as it is drawn: its points and axis 2 or 3 of its section there. */
  stations({ line, directors }: RodShape, element: number, axis: 2 | 3): { point: Vector3; axis: Vector3 }[] {
    const first = (this.drawnEdges + 1) * element;
    const point = (i: number): Vector3 => new Vector3().fromArray(line, 4 * (first + i));
    return Array.from({ length: this.drawnEdges + 1 }, (_, i) => {
      const before = Math.max(0, i - 1);
      const after = Math.min(i, this.drawnEdges - 1);
      const along = point(after + 1)
        .sub(point(before))
        .normalize();
      const second = new Vector3()
        .fromArray(directors, 4 * (first + before))
        .add(new Vector3().fromArray(directors, 4 * (first + after)))
        .normalize();
      return { point: point(i), axis: axis === 2 ? second : along.cross(second).normalize() };
    });
  }

  private valueAt(values: Float32Array, element: number, share: number): number {
    const count = values.length / this.count;
    const place = share * (count - 1);
    const i = Math.max(0, Math.min(Math.floor(place), count - 2));
    const [a, b] = [values[count * element + i] ?? 0, values[count * element + i + 1] ?? 0];
    return a + (place - i) * (b - a);
  }

  private restOf(node: number): Vector3 {
    return new Vector3().fromArray(this.rest, 3 * node);
  }

  /** Unit quaternions are w, x, y, z on the wire. */
  private rotation(frame: Reals, node: number): Quaternion {
    const at = 7 * node + 3;
    return new Quaternion(frame[at + 1], frame[at + 2], frame[at + 3], frame[at]);
  }

  private normalOf(element: number): Vector3 {
    const own = this.structure?.elements[element]?.normal;
    const made = new Vector3(own?.x ?? 0, own?.y ?? 0, own?.z ?? 0);
    if (made.lengthSq() === 0) {
      for (const node of this.ends(element)) {
        const normal = this.structure?.nodes[node]?.normal;
        made.add(new Vector3(normal?.x ?? 0, normal?.y ?? 0, normal?.z ?? 1));
      }
    }
    const [a, b] = this.ends(element);
    const axis = this.restOf(b).sub(this.restOf(a)).normalize();
    made.addScaledVector(axis, -made.dot(axis));
    return made.lengthSq() > 1e-12 ? made.normalize() : new Vector3(1, 0, 0);
  }
}
