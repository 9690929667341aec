import { Vector3 } from "three";
import type { Grab, PointerAt } from "../view/pointer";
import type { Stage } from "../view/stage";
import { Rectangle } from "./rectangle";
import type { BodySurface } from "./surface";

/** Share of the body's length: distance from the pointer within which Shift and drag add nodes to a group. */
const BRUSH_SHARE = 0.03;

/** A body whose nodes are selected, and the selected part. */
export interface Selecting {
  stage: Stage;
  surface: BodySurface;
  /** Extent of the body [length unit]. */
  extent: number;
  group(): number[];
  set(group: number[]): void;
  /** isMoved: false where the pointer was released where it was pressed. */
  end(isMoved: boolean): void;
}

/** Adds nodes around the pointer; null next to the body. */
export function paint({ stage, surface, extent, group, set, end }: Selecting, at: PointerAt): Grab | null {
  const hit = surface.pick(at.raycaster);
  if (!hit) return null;
  const add = (point: Vector3): void => {
    const near = surface.near(point, BRUSH_SHARE * extent);
    set([...new Set([...group(), hit.node, ...near])].sort((a, b) => a - b));
  };
  add(hit.position);
  return {
    anchor: hit.position,
    move: (point) => {
      const projected = stage.project(point);
      const again = surface.pickAt(projected.x, projected.y);
      if (again) add(again.position);
    },
    end: () => end(true),
  };
}

/** A rectangle from here to where the pointer is released: all nodes within, in front or behind. */
export function drawBox({ stage, surface, extent, set, end }: Selecting, at: PointerAt): Grab {
  const rectangle = new Rectangle(stage, at.x, at.y);
  return {
    anchor: at.raycaster.ray.at(extent, new Vector3()),
    move: (point) => {
      const pixel = stage.project(point);
      rectangle.extend(pixel.x, pixel.y);
      set(surface.within(rectangle));
    },
    end: (isMoved) => {
      rectangle.remove();
      end(isMoved);
    },
  };
}
