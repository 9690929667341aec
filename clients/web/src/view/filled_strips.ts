import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  type Vector3,
} from "three";
import { placed } from "./placed";
import type { Stage } from "./stage";

const OPACITY = 0.45;

/** A flat piece along a curve, and its colour: base to tip. */
export interface FilledPiece {
  base: [Vector3, Vector3];
  tip: [Vector3, Vector3];
  color: number;
  /** A line is drawn from its base to its tip where it begins. */
  hasEdge: boolean;
}

/** Half transparent pieces with the outline of their tips, as diagrams over beams. */
export class FilledStrips {
  private readonly fill: Mesh;
  private readonly outline: LineSegments;

  constructor(private readonly stage: Stage) {
    const material = new MeshBasicMaterial({
      vertexColors: true,
      side: DoubleSide,
      transparent: true,
      opacity: OPACITY,
      depthWrite: false,
    });
    this.fill = new Mesh(new BufferGeometry(), material);
    this.outline = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true }));
    for (const made of [this.fill, this.outline]) {
      made.frustumCulled = false;
      made.renderOrder = 5;
      stage.content.add(made);
    }
    this.set([]);
  }

  set(pieces: readonly FilledPiece[]): void {
    fill(
      this.fill,
      pieces.flatMap(({ base: [a, b], tip: [c, d], color }) => [a, b, d, a, d, c].map((point) => ({ point, color }))),
    );
    fill(
      this.outline,
      pieces.flatMap(({ base: [a], tip: [c, d], color, hasEdge }) =>
        (hasEdge ? [c, d, a, c] : [c, d]).map((point) => ({ point, color })),
      ),
    );
    this.stage.invalidate();
  }
}

function fill(object: Mesh | LineSegments, corners: readonly { point: Vector3; color: number }[]): void {
  const positions = placed(
    object,
    corners.map(({ point }) => point),
  );
  const colors = new Float32Array(positions.length);
  const color = new Color();
  corners.forEach(({ color: value }, i) => {
    color.set(value).toArray(colors, 3 * i);
  });
  object.geometry.dispose();
  object.geometry = new BufferGeometry();
  object.geometry.setAttribute("position", new BufferAttribute(positions, 3));
  object.geometry.setAttribute("color", new BufferAttribute(colors, 3));
  object.visible = corners.length > 0;
}
