import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  Color,
  Group,
  LineBasicMaterial,
  LineSegments,
  Points,
  PointsMaterial,
  type Vector3,
} from "three";
import { placed } from "./placed";
import type { Stage } from "./stage";

export type MarkerSize = "small" | "medium" | "large";

/** A point that is visible through objects in front of it, and can be picked. */
export interface Marker {
  key: string;
  position: Vector3;
  color: number;
  /** Default: medium. */
  size?: MarkerSize;
}

const SIZES: Record<MarkerSize, number> = { small: 7, medium: 12, large: 19 };

/** A disc with a rim, so that a point is seen on any ground. */
function disc(): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = 64;
  canvas.height = 64;
  const context = canvas.getContext("2d");
  if (context) {
    context.beginPath();
    context.arc(32, 32, 26, 0, 2 * Math.PI);
    context.fillStyle = "#ffffff";
    context.fill();
    context.lineWidth = 9;
    context.strokeStyle = "#3a3a3a";
    context.stroke();
  }
  return new CanvasTexture(canvas);
}

/** Handles that can be grabbed. */
export class Markers {
  private readonly group = new Group();
  private markers: Marker[] = [];
  private readonly clouds: { points: Points; size: MarkerSize }[] = [];

  constructor(private readonly stage: Stage) {
    const map = disc();
    for (const size of ["small", "medium", "large"] as const) {
      const material = new PointsMaterial({
        map,
        size: SIZES[size] * stage.renderer.getPixelRatio(),
        sizeAttenuation: false,
        vertexColors: true,
        transparent: true,
        alphaTest: 0.4,
        depthTest: false,
      });
      const points = new Points(new BufferGeometry(), material);
      points.renderOrder = 10;
      points.frustumCulled = false;
      this.clouds.push({ points, size });
      this.group.add(points);
    }
    stage.content.add(this.group);
  }

  set(markers: Marker[]): void {
    this.markers = markers;
    const color = new Color();
    for (const { points, size } of this.clouds) {
      const own = markers.filter((marker) => (marker.size ?? "medium") === size);
      const positions = placed(
        points,
        own.map((marker) => marker.position),
      );
      const colors = new Float32Array(own.flatMap((marker) => color.set(marker.color).toArray()));
      points.geometry.dispose();
      points.geometry = new BufferGeometry();
      points.geometry.setAttribute("position", new BufferAttribute(positions, 3));
      points.geometry.setAttribute("color", new BufferAttribute(colors, 3));
      points.visible = own.length > 0;
    }
    this.stage.invalidate();
  }

  /** The nearest within `radius` pixels; of those that overlap the one in front. */
  pick(x: number, y: number, radius: number): Marker | null {
    let best: Marker | null = null;
    let least = radius;
    for (const marker of this.markers) {
      const at = this.stage.project(marker.position);
      if (at.z > 1) continue;
      const distance = Math.hypot(at.x - x, at.y - y);
      if (distance < least) {
        least = distance;
        best = marker;
      }
    }
    return best;
  }
}

/** Coloured segments: pulls from a point to its target, loads, trajectories. */
export class Segments {
  private readonly lines: LineSegments;

  constructor(
    private readonly stage: Stage,
    isOnTop = true,
  ) {
    this.lines = new LineSegments(
      new BufferGeometry(),
      new LineBasicMaterial({ vertexColors: true, depthTest: !isOnTop }),
    );
    this.lines.renderOrder = 9;
    this.lines.frustumCulled = false;
    stage.content.add(this.lines);
  }

  /** Pairs of points, each pair with its colour. */
  set(pairs: { from: Vector3; to: Vector3; color: number }[]): void {
    const positions = placed(
      this.lines,
      pairs.flatMap(({ from, to }) => [from, to]),
    );
    const colors = new Float32Array(6 * pairs.length);
    const color = new Color();
    pairs.forEach(({ color: value }, i) => {
      color.set(value).toArray(colors, 6 * i);
      color.toArray(colors, 6 * i + 3);
    });
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry();
    this.lines.geometry.setAttribute("position", new BufferAttribute(positions, 3));
    this.lines.geometry.setAttribute("color", new BufferAttribute(colors, 3));
    this.lines.visible = pairs.length > 0;
    this.stage.invalidate();
  }
}
