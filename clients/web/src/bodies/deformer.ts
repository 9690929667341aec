import {
  ClampToEdgeWrapping,
  DataArrayTexture,
  DataTexture,
  FloatType,
  GLSL3,
  HalfFloatType,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PlaneGeometry,
  RedFormat,
  RGBAFormat,
  RGFormat,
  Scene,
  ShaderMaterial,
  type Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { Reals } from "../wire/arrays";
import type { Basis } from "./basis";
import type { Carried } from "./carried";
import { CARRIED, NORMALS, POSITIONS, VERTEX } from "./deformer_shaders";
import { columnSizes, halfError, toHalf } from "./halves";

/** Half floats are used where rounding moves no vertex by more than this share of the body's length: a third of a pixel. */
const HALF_ERROR_SHARE = 5e-4;
const PAIRS_WIDTH = 1024;

function dataTexture(
  data: Float32Array,
  width: number,
  height: number,
  format: typeof RGBAFormat | typeof RedFormat | typeof RGFormat,
): DataTexture {
  const made = new DataTexture(data as Float32Array<ArrayBuffer>, width, height, format, FloatType);
  made.minFilter = NearestFilter;
  made.magFilter = NearestFilter;
  made.wrapS = ClampToEdgeWrapping;
  made.wrapT = ClampToEdgeWrapping;
  made.needsUpdate = true;
  return made;
}

function pass(fragmentShader: string, uniforms: ShaderMaterial["uniforms"]): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader,
    depthTest: false,
    depthWrite: false,
    uniforms,
  });
}

/** Texels of a texture: `side` a row. */
function sizeFor(count: number): [side: number, rows: number] {
  const side = Math.max(1, Math.ceil(Math.sqrt(count)));
  return [side, Math.max(1, Math.ceil(count / side))];
}

/**
 * The deformed surface of a body as two textures, positions (relative to the basis's origin) and normals, one texel a
 * vertex, row by row. The basis is on the GPU as an array of layers; a frame is its coordinates. Vertices are nodes, or
 * those of a carried surface, which are made of the positions of the nodes that it hangs on. If the GPU cannot draw
 * into float textures, or has fewer layers than the basis has columns, positions are computed here and uploaded.
 */
export class Deformer {
  readonly side: number;
  readonly isOnGpu: boolean;
  isHalf = false;
  private readonly rows: number;
  /** Side of textures with one texel a node. */
  private readonly nodeSide: number;
  private readonly nodeRows: number;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  private readonly quad: Mesh;
  /** Positions, normals; of a carried surface positions of nodes, too. */
  private readonly targets: WebGLRenderTarget[] = [];
  private readonly uploads: DataTexture[] = [];
  private readonly positionPass: ShaderMaterial;
  private readonly normalPass: ShaderMaterial;
  private readonly carriedPass: ShaderMaterial | null;
  private readonly coordinates: DataTexture;
  private basisTexture: DataArrayTexture | null = null;
  /** Columns of the basis are divided by these on the GPU, coordinates multiplied. */
  private readonly columnSizes: Float32Array;
  /** Largest size of each coordinate that half floats were found good enough for. */
  private halfSizes: Float32Array = new Float32Array(0);
  private readonly rings: Float32Array;
  private readonly pairs: Float32Array;
  private readonly count: number;

  /**
   * nodes: of the surface, or those that `carried` hangs on; triangles: of the surface's vertices, counted from 0.
   * extent: the body's length.
   */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly basis: Basis,
    private readonly nodes: Uint32Array,
    private readonly triangles: Uint32Array,
    private readonly extent: number,
    private readonly carried: Carried | null = null,
  ) {
    const gl = renderer.getContext() as WebGL2RenderingContext;
    const layers = gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number;
    this.isOnGpu = gl.getExtension("EXT_color_buffer_float") !== null && basis.columns <= layers && basis.columns > 0;
    this.count = carried?.vertices ?? nodes.length;
    [this.side, this.rows] = sizeFor(this.count);
    [this.nodeSide, this.nodeRows] = sizeFor(nodes.length);
    this.columnSizes = columnSizes(basis, nodes);
    [this.rings, this.pairs] = this.makeRings();
    this.coordinates = dataTexture(
      new Float32Array(Math.max(1, basis.columns)),
      Math.max(1, basis.columns),
      1,
      RedFormat,
    );
    const onGpu = (make: () => DataTexture): { value: DataTexture | null } => ({ value: this.isOnGpu ? make() : null });
    this.positionPass = pass(POSITIONS, {
      basis: { value: null },
      rest: onGpu(() => this.restTexture()),
      coordinates: { value: this.coordinates },
      columns: { value: basis.columns },
    });
    this.normalPass = pass(NORMALS, {
      positions: { value: null },
      rings: onGpu(() => dataTexture(this.rings, this.side, this.rows, RGFormat)),
      pairs: onGpu(() => dataTexture(this.pairs, PAIRS_WIDTH, this.pairs.length / 2 / PAIRS_WIDTH, RGFormat)),
      side: { value: this.side },
    });
    this.carriedPass =
      carried &&
      pass(CARRIED, {
        nodes: { value: null },
        corners: onGpu(() => this.perVertex(carried.corners)),
        weights: onGpu(() => this.perVertex(carried.weights)),
        nodeSide: { value: this.nodeSide },
      });
    this.quad = new Mesh(new PlaneGeometry(2, 2), this.positionPass);
    this.quad.frustumCulled = false;
    this.scene.add(this.quad);
    if (this.isOnGpu) {
      this.targets.push(this.makeTarget(this.side, this.rows), this.makeTarget(this.side, this.rows));
      if (carried) this.targets.push(this.makeTarget(this.nodeSide, this.nodeRows));
    } else {
      for (let i = 0; i < 2; i++)
        this.uploads.push(dataTexture(new Float32Array(4 * this.side * this.rows), this.side, this.rows, RGBAFormat));
    }
  }

  get positions(): Texture {
    return this.isOnGpu ? (this.targets[0] as WebGLRenderTarget).texture : (this.uploads[0] as DataTexture);
  }

  get normals(): Texture {
    return this.isOnGpu ? (this.targets[1] as WebGLRenderTarget).texture : (this.uploads[1] as DataTexture);
  }

  /** The surface at these coordinates. */
  show(coordinates: Reals): void {
    if (!this.isOnGpu) {
      this.computeHere(coordinates);
      return;
    }
    if (!this.basisTexture || (this.isHalf && !this.fitsHalf(coordinates))) this.uploadBasis(coordinates);
    const scaled = this.coordinates.image.data as Float32Array;
    this.columnSizes.forEach((size, k) => {
      scaled[k] = size * (coordinates[k] ?? 0);
    });
    this.coordinates.needsUpdate = true;
    this.run(this.positionPass, this.carriedPass ? 2 : 0);
    if (this.carriedPass) {
      this.carriedPass.uniforms.nodes = { value: (this.targets[2] as WebGLRenderTarget).texture };
      this.run(this.carriedPass, 0);
    }
    this.normalPass.uniforms.positions = { value: this.positions };
    this.run(this.normalPass, 1);
  }

  dispose(): void {
    for (const one of [...this.targets, ...this.uploads]) one.dispose();
    for (const one of [this.positionPass, this.normalPass, this.carriedPass]) {
      for (const uniform of Object.values(one?.uniforms ?? {})) (uniform.value as Texture | null)?.dispose?.();
      one?.dispose();
    }
    this.quad.geometry.dispose();
  }

  private run(shader: ShaderMaterial, target: number): void {
    const before = this.renderer.getRenderTarget();
    this.quad.material = shader;
    this.renderer.setRenderTarget(this.targets[target] as WebGLRenderTarget);
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(before);
  }

  private restTexture(): DataTexture {
    const data = new Float32Array(4 * this.nodeSide * this.nodeRows);
    this.nodes.forEach((node, i) => {
      for (let axis = 0; axis < 3; axis++) data[4 * i + axis] = this.basis.rest[3 * node + axis] ?? 0;
    });
    return dataTexture(data, this.nodeSide, this.nodeRows, RGBAFormat);
  }

  /** Four numbers a vertex. */
  private perVertex(values: ArrayLike<number>): DataTexture {
    const data = new Float32Array(4 * this.side * this.rows);
    data.set(values);
    return dataTexture(data, this.side, this.rows, RGBAFormat);
  }

  private makeTarget(side: number, rows: number): WebGLRenderTarget {
    return new WebGLRenderTarget(side, rows, {
      type: FloatType,
      format: RGBAFormat,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      depthBuffer: false,
    });
  }

  private fitsHalf(coordinates: Reals): boolean {
    return this.halfSizes.every((size, k) => Math.abs(coordinates[k] ?? 0) <= size);
  }

  /** Half floats where rounding the basis moves no vertex far, at coordinates twice as large as these. */
  private uploadBasis(coordinates: Reals): void {
    const sizes = Float32Array.from({ length: this.basis.columns }, (_, k) =>
      Math.max(2 * Math.abs(coordinates[k] ?? 0), this.halfSizes[k] ?? 0),
    );
    const error =
      halfError(this.basis, this.nodes, this.columnSizes, sizes) * (this.carried ? this.carried.amplification : 1);
    this.halfSizes = sizes;
    const isHalf = error <= HALF_ERROR_SHARE * this.extent && error > 0;
    if (this.basisTexture && isHalf === this.isHalf) return;
    this.isHalf = isHalf;
    this.basisTexture?.dispose();
    this.basisTexture = this.makeBasisTexture();
    this.positionPass.uniforms.basis = { value: this.basisTexture };
  }

  private makeBasisTexture(): DataArrayTexture {
    const { columns, values } = this.basis;
    const layer = this.nodeSide * this.nodeRows;
    const data = this.isHalf ? new Uint16Array(4 * layer * columns) : new Float32Array(4 * layer * columns);
    this.nodes.forEach((node, i) => {
      for (let axis = 0; axis < 3; axis++) {
        const row = (3 * node + axis) * columns;
        for (let k = 0; k < columns; k++) {
          const share = (values[row + k] ?? 0) / (this.columnSizes[k] ?? 1);
          data[4 * (k * layer + i) + axis] = this.isHalf ? toHalf(share) : share;
        }
      }
    });
    const made = new DataArrayTexture(data as Float32Array<ArrayBuffer>, this.nodeSide, this.nodeRows, columns);
    made.format = RGBAFormat;
    made.type = this.isHalf ? HalfFloatType : FloatType;
    made.minFilter = NearestFilter;
    made.magFilter = NearestFilter;
    made.needsUpdate = true;
    return made;
  }

  /** For each vertex, the start and number of its pairs; pairs: the two other corners of each triangle around it. */
  private makeRings(): [Float32Array, Float32Array] {
    const counts = new Uint32Array(this.count + 1);
    for (const vertex of this.triangles) counts[vertex + 1] = (counts[vertex + 1] ?? 0) + 1;
    for (let i = 0; i < this.count; i++) counts[i + 1] = (counts[i + 1] ?? 0) + (counts[i] ?? 0);
    const rows = Math.max(1, Math.ceil(this.triangles.length / PAIRS_WIDTH));
    const pairs = new Float32Array(2 * rows * PAIRS_WIDTH);
    const next = counts.slice();
    for (let i = 0; i < this.triangles.length; i += 3) {
      for (let corner = 0; corner < 3; corner++) {
        const vertex = this.triangles[i + corner] ?? 0;
        const at = next[vertex] ?? 0;
        next[vertex] = at + 1;
        pairs[2 * at] = this.triangles[i + ((corner + 1) % 3)] ?? 0;
        pairs[2 * at + 1] = this.triangles[i + ((corner + 2) % 3)] ?? 0;
      }
    }
    const rings = new Float32Array(2 * this.side * this.rows);
    for (let i = 0; i < this.count; i++) {
      rings[2 * i] = counts[i] ?? 0;
      rings[2 * i + 1] = (counts[i + 1] ?? 0) - (counts[i] ?? 0);
    }
    return [rings, pairs];
  }

  private computeHere(coordinates: Reals): void {
    const [positions, normals] = this.uploads as [DataTexture, DataTexture];
    const x = positions.image.data as Float32Array;
    const n = normals.image.data as Float32Array;
    const at = this.carried ? new Float64Array(3 * this.nodes.length) : x;
    this.nodes.forEach((node, i) => {
      this.basis.relative(node, coordinates, at, (this.carried ? 3 : 4) * i);
    });
    this.carried?.positions(at, x, 4);
    n.fill(0);
    for (let i = 0; i < this.triangles.length; i += 3) {
      const [a, b, c] = [0, 1, 2].map((corner) => 4 * (this.triangles[i + corner] ?? 0)) as [number, number, number];
      const u = [0, 1, 2].map((axis) => (x[b + axis] ?? 0) - (x[a + axis] ?? 0)) as [number, number, number];
      const v = [0, 1, 2].map((axis) => (x[c + axis] ?? 0) - (x[a + axis] ?? 0)) as [number, number, number];
      const cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const corner of [a, b, c])
        for (let axis = 0; axis < 3; axis++) n[corner + axis] = (n[corner + axis] ?? 0) + (cross[axis] ?? 0);
    }
    positions.needsUpdate = true;
    normals.needsUpdate = true;
  }
}
