import { Plane, Raycaster, Vector3 } from "three";
import type { Stage } from "./stage";

/** Position of the pointer: in pixels of the canvas, and as a ray into the scene. */
export interface PointerAt {
  x: number;
  y: number;
  raycaster: Raycaster;
  /** Distance from a marker that still hits it [px]: more for fingers. */
  reach: number;
  isShift: boolean;
  isAlt: boolean;
}

/** Something that follows the pointer until it is released. */
export interface Grab {
  /** Position where the point was grabbed. */
  anchor: Vector3;
  move(point: Vector3): void;
  /** isMoved: false where the pointer was released where it was pressed. */
  end(isMoved: boolean): void;
}

export interface PointerTarget {
  grab(at: PointerAt): Grab | null;
  /** Pressed and released on nothing that can be grabbed. */
  clickedBeside(at: PointerAt): void;
}

const MOVED_PX = 3;
const AXES = { x: new Vector3(1, 0, 0), y: new Vector3(0, 1, 0), z: new Vector3(0, 0, 1) } as const;

/** Grabs things under the pointer and moves them in the plane of the screen, or along an axis whose key is held. */
export class PointerControl {
  private grabbed: {
    grab: Grab;
    plane: Plane;
    offset: Vector3;
    x: number;
    y: number;
    isMoved: boolean;
    id: number;
  } | null = null;
  private pressed: { x: number; y: number } | null = null;
  private axis: "x" | "y" | "z" | null = null;

  constructor(
    private readonly stage: Stage,
    private readonly target: PointerTarget,
  ) {
    const { canvas, closed: signal } = stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true, signal });
    canvas.addEventListener("pointermove", (event) => this.move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.up(event), { signal });
    canvas.addEventListener("pointercancel", (event) => this.up(event), { signal });
    window.addEventListener("keydown", (event) => this.key(event, true), { signal });
    window.addEventListener("keyup", (event) => this.key(event, false), { signal });
  }

  private at(event: PointerEvent): PointerAt {
    const box = this.stage.canvas.getBoundingClientRect();
    const raycaster = new Raycaster();
    raycaster.setFromCamera(this.stage.pointer(event), this.stage.camera);
    const reach = event.pointerType === "touch" ? 26 : 14;
    const { shiftKey: isShift, altKey: isAlt } = event;
    return { x: event.clientX - box.left, y: event.clientY - box.top, raycaster, reach, isShift, isAlt };
  }

  private down(event: PointerEvent): void {
    if (event.button !== 0 || this.grabbed) return;
    this.stage.canvas.focus();
    const at = this.at(event);
    const grab = this.target.grab(at);
    this.pressed = { x: at.x, y: at.y };
    if (!grab) return;
    const normal = this.stage.camera.getWorldDirection(new Vector3());
    const plane = new Plane().setFromNormalAndCoplanarPoint(normal, grab.anchor);
    const hit = at.raycaster.ray.intersectPlane(plane, new Vector3()) ?? grab.anchor;
    this.grabbed = {
      grab,
      plane,
      offset: grab.anchor.clone().sub(hit),
      x: at.x,
      y: at.y,
      isMoved: false,
      id: event.pointerId,
    };
    this.stage.controls.enabled = false;
    this.stage.canvas.setPointerCapture(event.pointerId);
  }

  private move(event: PointerEvent): void {
    const held = this.grabbed;
    if (held?.id !== event.pointerId) return;
    const at = this.at(event);
    if (!held.isMoved && Math.hypot(at.x - held.x, at.y - held.y) < MOVED_PX) return;
    held.isMoved = true;
    const point = at.raycaster.ray.intersectPlane(held.plane, new Vector3());
    if (!point) return;
    point.add(held.offset);
    if (this.axis) {
      const along = AXES[this.axis];
      const share = point.sub(held.grab.anchor).dot(along);
      point.copy(held.grab.anchor).addScaledVector(along, share);
    }
    held.grab.move(point);
  }

  private up(event: PointerEvent): void {
    const held = this.grabbed;
    if (held?.id === event.pointerId) {
      this.grabbed = null;
      this.stage.controls.enabled = true;
      held.grab.end(held.isMoved);
    } else if (this.pressed && !held) {
      const at = this.at(event);
      if (Math.hypot(at.x - this.pressed.x, at.y - this.pressed.y) < MOVED_PX) this.target.clickedBeside(at);
    }
    this.pressed = null;
  }

  private key(event: KeyboardEvent, isDown: boolean): void {
    const key = event.key.toLowerCase();
    if (key !== "x" && key !== "y" && key !== "z") return;
    if (event.ctrlKey || event.metaKey) return;
    this.axis = isDown ? key : null;
  }
}
