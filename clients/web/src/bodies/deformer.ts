import {
  ClampToEdgeWrapping,
  DataArrayTexture,
  DataTexture,
  DataUtils,
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
import type { Basis } from "./basis";

const VERTEX = "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }";

/** x = rest + sum over k of z_k B_k, one texel a vertex. */
const POSITIONS = `
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray basis;
uniform sampler2D rest;
uniform sampler2D coordinates;
uniform int columns;
out vec4 result;
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec3 x = texelFetch(rest, texel, 0).xyz;
  for (int k = 0; k < columns; ++k)
    x += texelFetch(coordinates, ivec2(k, 0), 0).r * texelFetch(basis, ivec3(texel, k), 0).xyz;
  result = vec4(x, 1.0);
}`;

/** Normals of the deformed surface: the sum over a vertex's triangles, weighted by area. */
const NORMALS = `
precision highp float;
uniform sampler2D positions;
uniform sampler2D rings;
uniform sampler2D pairs;
uniform int side;
out vec4 result;
vec3 at(float vertex) { int v = int(vertex); return texelFetch(positions, ivec2(v % side, v / side), 0).xyz; }
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec3 x = texelFetch(positions, texel, 0).xyz;
  vec2 ring = texelFetch(rings, texel, 0).rg;
  int width = textureSize(pairs, 0).x;
  vec3 normal = vec3(0.0);
  for (int i = 0; i < int(ring.y); ++i) {
    int j = int(ring.x) + i;
    vec2 pair = texelFetch(pairs, ivec2(j % width, j / width), 0).rg;
    normal += cross(at(pair.x) - x, at(pair.y) - x);
  }
  result = vec4(normal / max(length(normal), 1e-30), 0.0);
}`;

/** Half floats are used where rounding moves no vertex by more than this share of the body's length: a third of a pixel. */
const HALF_ERROR_SHARE = 5e-4;
const HALF_ROUNDING = 2 ** -11;
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

/**
 * The deformed surface of a body as two textures, positions and normals, one texel a vertex, row by row. The basis is
 * on the GPU as an array of layers; a frame is its coordinates. Where the GPU cannot draw into float textures, or has
 * fewer layers than the basis has columns, positions are computed here and uploaded.
 */
export class Deformer {
  readonly side: number;
  readonly isOnGpu: boolean;
  isHalf = false;
  private readonly rows: number;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  private readonly quad: Mesh;
  private readonly targets: WebGLRenderTarget[] = [];
  private readonly uploads: DataTexture[] = [];
  private readonly positionPass: ShaderMaterial;
  private readonly normalPass: ShaderMaterial;
  private readonly coordinates: DataTexture;
  private basisTexture: DataArrayTexture | null = null;
  /** Largest size of each coordinate that half floats were found good enough for. */
  private halfSizes: Float32Array = new Float32Array(0);
  private readonly rings: Float32Array;
  private readonly pairs: Float32Array;

  /** vertices: nodes of the surface; triangles: of these, counted from 0. extent: the body's length. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly basis: Basis,
    private readonly vertices: Uint32Array,
    private readonly triangles: Uint32Array,
    private readonly extent: number,
  ) {
    const gl = renderer.getContext() as WebGL2RenderingContext;
    const layers = gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number;
    this.isOnGpu = gl.getExtension("EXT_color_buffer_float") !== null && basis.columns <= layers && basis.columns > 0;
    this.side = Math.max(1, Math.ceil(Math.sqrt(vertices.length)));
    this.rows = Math.max(1, Math.ceil(vertices.length / this.side));
    [this.rings, this.pairs] = this.makeRings();
    this.coordinates = dataTexture(
      new Float32Array(Math.max(1, basis.columns)),
      Math.max(1, basis.columns),
      1,
      RedFormat,
    );
    this.positionPass = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: POSITIONS,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        basis: { value: null },
        rest: { value: this.isOnGpu ? this.restTexture() : null },
        coordinates: { value: this.coordinates },
        columns: { value: basis.columns },
      },
    });
    this.normalPass = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: NORMALS,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        positions: { value: null },
        rings: { value: this.isOnGpu ? dataTexture(this.rings, this.side, this.rows, RGFormat) : null },
        pairs: {
          value: this.isOnGpu
            ? dataTexture(this.pairs, PAIRS_WIDTH, this.pairs.length / 2 / PAIRS_WIDTH, RGFormat)
            : null,
        },
        side: { value: this.side },
      },
    });
    this.quad = new Mesh(new PlaneGeometry(2, 2), this.positionPass);
    this.quad.frustumCulled = false;
    this.scene.add(this.quad);
    for (let i = 0; i < 2; i++) {
      if (this.isOnGpu) {
        this.targets.push(
          new WebGLRenderTarget(this.side, this.rows, {
            type: FloatType,
            format: RGBAFormat,
            minFilter: NearestFilter,
            magFilter: NearestFilter,
            depthBuffer: false,
          }),
        );
      } else {
        this.uploads.push(dataTexture(new Float32Array(4 * this.side * this.rows), this.side, this.rows, RGBAFormat));
      }
    }
  }

  get positions(): Texture {
    return this.isOnGpu ? (this.targets[0] as WebGLRenderTarget).texture : (this.uploads[0] as DataTexture);
  }

  get normals(): Texture {
    return this.isOnGpu ? (this.targets[1] as WebGLRenderTarget).texture : (this.uploads[1] as DataTexture);
  }

  /** The surface at these coordinates. */
  show(coordinates: Float32Array): void {
    if (!this.isOnGpu) {
      this.computeHere(coordinates);
      return;
    }
    if (!this.basisTexture || (this.isHalf && !this.fitsHalf(coordinates))) this.uploadBasis(coordinates);
    (this.coordinates.image.data as Float32Array).set(coordinates.subarray(0, this.basis.columns));
    this.coordinates.needsUpdate = true;
    this.run(this.positionPass, 0);
    this.normalPass.uniforms.positions = { value: this.positions };
    this.run(this.normalPass, 1);
  }

  dispose(): void {
    for (const one of [...this.targets, ...this.uploads]) one.dispose();
    for (const pass of [this.positionPass, this.normalPass]) {
      for (const uniform of Object.values(pass.uniforms)) (uniform.value as Texture | null)?.dispose?.();
      pass.dispose();
    }
    this.quad.geometry.dispose();
  }

  private run(pass: ShaderMaterial, target: number): void {
    const before = this.renderer.getRenderTarget();
    this.quad.material = pass;
    this.renderer.setRenderTarget(this.targets[target] as WebGLRenderTarget);
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(before);
  }

  private restTexture(): DataTexture {
    const data = new Float32Array(4 * this.side * this.rows);
    this.vertices.forEach((node, i) => {
      for (let axis = 0; axis < 3; axis++) data[4 * i + axis] = this.basis.rest[3 * node + axis] ?? 0;
    });
    return dataTexture(data, this.side, this.rows, RGBAFormat);
  }

  private fitsHalf(coordinates: Float32Array): boolean {
    return this.halfSizes.every((size, k) => Math.abs(coordinates[k] ?? 0) <= size);
  }

  /** Half floats where rounding the basis moves no vertex far, at coordinates twice as large as these. */
  private uploadBasis(coordinates: Float32Array): void {
    const { columns, values } = this.basis;
    const sizes = Float32Array.from({ length: columns }, (_, k) =>
      Math.max(2 * Math.abs(coordinates[k] ?? 0), this.halfSizes[k] ?? 0),
    );
    let error = 0;
    for (const node of this.vertices) {
      for (let axis = 0; axis < 3; axis++) {
        let sum = 0;
        for (let k = 0; k < columns; k++)
          sum += Math.abs(values[(3 * node + axis) * columns + k] ?? 0) * (sizes[k] ?? 0);
        error = Math.max(error, sum * HALF_ROUNDING);
      }
    }
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
    const layer = this.side * this.rows;
    const data = this.isHalf ? new Uint16Array(4 * layer * columns) : new Float32Array(4 * layer * columns);
    this.vertices.forEach((node, i) => {
      for (let axis = 0; axis < 3; axis++) {
        const row = (3 * node + axis) * columns;
        for (let k = 0; k < columns; k++) {
          const value = values[row + k] ?? 0;
          data[4 * (k * layer + i) + axis] = this.isHalf ? DataUtils.toHalfFloat(value) : value;
        }
      }
    });
    const made = new DataArrayTexture(data as Float32Array<ArrayBuffer>, this.side, this.rows, columns);
    made.format = RGBAFormat;
    made.type = this.isHalf ? HalfFloatType : FloatType;
    made.minFilter = NearestFilter;
    made.magFilter = NearestFilter;
    made.needsUpdate = true;
    return made;
  }

  /** Of each vertex, where its pairs begin and how many; pairs: the two other corners of each triangle around it. */
  private makeRings(): [Float32Array, Float32Array] {
    const counts = new Uint32Array(this.vertices.length + 1);
    for (const vertex of this.triangles) counts[vertex + 1] = (counts[vertex + 1] ?? 0) + 1;
    for (let i = 0; i < this.vertices.length; i++) counts[i + 1] = (counts[i + 1] ?? 0) + (counts[i] ?? 0);
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
    for (let i = 0; i < this.vertices.length; i++) {
      rings[2 * i] = counts[i] ?? 0;
      rings[2 * i + 1] = (counts[i + 1] ?? 0) - (counts[i] ?? 0);
    }
    return [rings, pairs];
  }

  private computeHere(coordinates: Float32Array): void {
    const [positions, normals] = this.uploads as [DataTexture, DataTexture];
    const x = positions.image.data as Float32Array;
    const n = normals.image.data as Float32Array;
    this.vertices.forEach((node, i) => {
      this.basis.position(node, coordinates, x, 4 * i);
    });
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
