import {
  AmbientLight,
  Color,
  DirectionalLight,
  GridHelper,
  Group,
  HemisphereLight,
  PerspectiveCamera,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

export type UpAxis = "y" | "z";

/** Share of the picture's height and width that a framed box may fill. */
const MARGIN = 0.82;

/** Whether pictures are drawn by the processor: then at its own resolution and without smoothed edges, to be quick. */
function isSoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/** Canvas, camera and lights. Draws when something changed, and never otherwise. */
export class Stage {
  readonly renderer: WebGLRenderer;
  readonly camera = new PerspectiveCamera(40, 1, 0.01, 100);
  controls: OrbitControls;
  /** Objects that the views put into the scene. */
  readonly content = new Group();
  /** Before each drawing. */
  beforeDraw: () => void = () => undefined;
  frames = 0;
  private readonly closing = new AbortController();
  private readonly scene = new Scene();
  private readonly lights = new Group();
  private grid: GridHelper | null = null;
  private isAsked = false;
  private size = 1;

  /** Throws where the browser has no WebGL 2. */
  constructor(readonly canvas: HTMLCanvasElement) {
    const isSlow = isSoftware();
    this.renderer = new WebGLRenderer({ canvas, antialias: !isSlow });
    this.renderer.setPixelRatio(isSlow ? 1 : Math.min(2, window.devicePixelRatio));
    this.scene.background = new Color(0xf3f5f6);
    const key = new DirectionalLight(0xffffff, 1.9);
    key.position.set(0.6, 1, 0.9);
    const fill = new DirectionalLight(0xffffff, 0.6);
    fill.position.set(-1, 0.2, -0.4);
    this.lights.add(key, fill, new HemisphereLight(0xffffff, 0xb9c4c9, 1.1), new AmbientLight(0xffffff, 0.25));
    this.camera.add(this.lights);
    this.scene.add(this.camera, this.content);
    this.controls = this.makeControls();
    const observer = new ResizeObserver(() => this.resize());
    observer.observe(canvas.parentElement ?? canvas);
    this.closed.addEventListener("abort", () => observer.disconnect());
    this.resize();
  }

  /** Aborted when the stage is removed: for listeners of its users. */
  get closed(): AbortSignal {
    return this.closing.signal;
  }

  dispose(): void {
    this.closing.abort();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Draws at the next opportunity. */
  invalidate(): void {
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => {
      this.isAsked = false;
      if (this.closed.aborted) return;
      this.beforeDraw();
      this.renderer.render(this.scene, this.camera);
      this.frames++;
    });
  }

  /** Looks at a box from where most of it is seen. */
  frame(low: Vector3, high: Vector3, up: UpAxis): void {
    const center = low.clone().add(high).multiplyScalar(0.5);
    this.size = Math.max(1e-12, high.distanceTo(low));
    if ((up === "z") !== (this.camera.up.z === 1)) {
      this.camera.up.set(0, up === "y" ? 1 : 0, up === "z" ? 1 : 0);
      this.controls.dispose();
      this.controls = this.makeControls();
    }
    const direction = up === "y" ? new Vector3(0.45, 0.3, 1) : new Vector3(0.55, -1, 0.5);
    const distance = this.distanceFor(low, high, direction.normalize());
    this.camera.near = this.size / 200;
    this.camera.far = this.size * 50;
    this.camera.position.copy(center).addScaledVector(direction, distance);
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(center);
    this.controls.update();
    this.placeGrid(low, high, up);
    this.invalidate();
  }

  /** Length of the diagonal of the framed box. */
  get extent(): number {
    return this.size;
  }

  /** Pixels of the canvas where a point is seen; z beyond 1: behind the camera. */
  project(point: Vector3): Vector3 {
    const at = point.clone().project(this.camera);
    const { clientWidth, clientHeight } = this.canvas;
    return new Vector3(((at.x + 1) / 2) * clientWidth, ((1 - at.y) / 2) * clientHeight, at.z);
  }

  /** Position of a pointer event, in -1 .. 1. */
  pointer(event: { clientX: number; clientY: number }): Vector2 {
    const box = this.canvas.getBoundingClientRect();
    return new Vector2(
      ((event.clientX - box.left) / box.width) * 2 - 1,
      1 - ((event.clientY - box.top) / box.height) * 2,
    );
  }

  /** How far from its middle, along a direction, all corners of a box are seen. */
  private distanceFor(low: Vector3, high: Vector3, direction: Vector3): number {
    const right = this.camera.up.clone().cross(direction).normalize();
    const upwards = direction.clone().cross(right);
    const half = high.clone().sub(low).multiplyScalar(0.5);
    const slope = Math.tan((this.camera.fov * Math.PI) / 360) * MARGIN;
    let distance = 0.1 * this.size;
    for (const sign of [0, 1, 2, 3, 4, 5, 6, 7]) {
      const corner = new Vector3(sign & 1 ? half.x : -half.x, sign & 2 ? half.y : -half.y, sign & 4 ? half.z : -half.z);
      const beside = Math.max(Math.abs(corner.dot(upwards)), Math.abs(corner.dot(right)) / this.camera.aspect);
      distance = Math.max(distance, corner.dot(direction) + beside / slope);
    }
    return distance;
  }

  /** They take over which direction is up when they are made. */
  private makeControls(): OrbitControls {
    const made = new OrbitControls(this.camera, this.canvas);
    made.addEventListener("change", () => this.invalidate());
    made.enableDamping = false;
    return made;
  }

  private placeGrid(low: Vector3, high: Vector3, up: UpAxis): void {
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const step = 10 ** Math.floor(Math.log10(this.size / 4));
    const count = Math.min(60, 2 * Math.ceil(this.size / step));
    this.grid = new GridHelper(count * step, count, 0xaab4ba, 0xd9dfe2);
    if (up === "z") this.grid.rotation.x = Math.PI / 2;
    const floor = up === "z" ? low.z : low.y;
    const middle = low.clone().add(high).multiplyScalar(0.5);
    const snap = (value: number): number => Math.round(value / step) * step;
    if (up === "z") this.grid.position.set(snap(middle.x), snap(middle.y), floor);
    else this.grid.position.set(snap(middle.x), floor, snap(middle.z));
    this.scene.add(this.grid);
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas.parentElement ?? this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }
}
