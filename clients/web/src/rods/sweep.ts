import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  FloatType,
  Group,
  Mesh,
  MeshLambertMaterial,
  NearestFilter,
  RGBAFormat,
  ShapeUtils,
  Vector2,
  type WebGLProgramParametersWithUniforms,
} from "three";
import type { Stage } from "../view/stage";
import { COLOR_MAP } from "./colors";

/** A rod: so many edges, and its section's outline around the axis in (d1, d2), counterclockwise. */
export interface Strip {
  edges: number;
  outline: readonly (readonly [number, number])[];
}

/** One shape of all strips: stations x 4 each; of a strip its edges + 1 stations in order. */
export interface RodShape {
  /** x, y, z of a station, and a value in 0 .. 1 for its colour. */
  line: Float64Array;
  /** First director of the edge that begins at a station; of the last station of a strip: not used. */
  directors: Float32Array;
}

const WIDTH = 1024;
/** Corners of an outline that turn less than this are drawn round. */
const ROUND = Math.cos(Math.PI / 4.5);

const DECLARE = `
uniform highp sampler2D line;
uniform highp sampler2D directors;
attribute vec3 stations;
attribute vec2 corner;
attribute vec3 side;
varying float vValue;
vec4 at(sampler2D numbers, float station) { int i = int(station + 0.5); return texelFetch(numbers, ivec2(i % ${WIDTH}, i / ${WIDTH}), 0); }
vec3 along(float edge) { vec3 t = at(line, edge + 1.0).xyz - at(line, edge).xyz; return t / max(length(t), 1e-30); }
`;

/** As the engine sweeps it: tangents and directors of both edges at a station, averaged and made orthonormal. */
const SWEEP = `
vec4 station = at(line, stations.x);
vec3 t = normalize(along(stations.y) + along(stations.z));
vec3 d1 = at(directors, stations.y).xyz + at(directors, stations.z).xyz;
d1 = normalize(d1 - t * dot(t, d1));
vec3 d2 = cross(t, d1);
vValue = station.w;
vec3 objectNormal = side.x * d1 + side.y * d2 + side.z * t;
`;

function texture(rows: number): DataTexture {
  const made = new DataTexture(new Float32Array(4 * WIDTH * rows), WIDTH, rows, RGBAFormat, FloatType);
  made.minFilter = NearestFilter;
  made.magFilter = NearestFilter;
  return made;
}

/** Rods, swept in the vertex shader: a shape goes up as centrelines and directors. */
export class SweptRods {
  private readonly group = new Group();
  private mesh: Mesh | null = null;
  private line = texture(1);
  private directors = texture(1);
  private readonly material = new MeshLambertMaterial({ color: 0xc9a26a });
  private readonly isColored = { value: 0 };

  constructor(private readonly stage: Stage) {
    stage.content.add(this.group);
    this.material.onBeforeCompile = (shader) => this.extend(shader);
  }

  setStrips(strips: readonly Strip[]): void {
    const stations = strips.reduce((sum, { edges }) => sum + edges + 1, 0);
    this.line.dispose();
    this.directors.dispose();
    this.line = texture(Math.ceil(stations / WIDTH));
    this.directors = texture(Math.ceil(stations / WIDTH));
    this.mesh?.geometry.dispose();
    this.group.clear();
    this.material.needsUpdate = true;
    this.mesh = new Mesh(makeGeometry(strips), this.material);
    this.mesh.frustumCulled = false;
    this.group.add(this.mesh);
    this.uniforms.line.value = this.line;
    this.uniforms.directors.value = this.directors;
  }

  show(shape: RodShape, isColored: boolean): void {
    // Relative to the first station: single precision is enough there, wherever the scene is.
    const origin = [0, 1, 2, 3].map((axis) => (axis < 3 ? (shape.line[axis] ?? 0) : 0));
    const line = this.line.image.data as Float32Array;
    shape.line.forEach((value, i) => {
      line[i] = value - (origin[i % 4] ?? 0);
    });
    this.mesh?.position.set(origin[0] ?? 0, origin[1] ?? 0, origin[2] ?? 0);
    (this.directors.image.data as Float32Array).set(shape.directors);
    this.line.needsUpdate = true;
    this.directors.needsUpdate = true;
    this.isColored.value = isColored ? 1 : 0;
    this.stage.invalidate();
  }

  private readonly uniforms = { line: { value: this.line }, directors: { value: this.directors } };

  private extend(shader: WebGLProgramParametersWithUniforms): void {
    shader.uniforms.line = this.uniforms.line;
    shader.uniforms.directors = this.uniforms.directors;
    shader.uniforms.isColored = this.isColored;
    shader.vertexShader = `${DECLARE}${shader.vertexShader}`
      .replace("#include <beginnormal_vertex>", SWEEP)
      .replace("#include <begin_vertex>", "vec3 transformed = station.xyz + corner.x * d1 + corner.y * d2;");
    shader.fragmentShader =
      `uniform float isColored;\nvarying float vValue;\n${COLOR_MAP}${shader.fragmentShader}`.replace(
        "#include <color_fragment>",
        "if (isColored > 0.5) diffuseColor.rgb = colorOf(vValue);",
      );
  }
}

/** Vertices of rings and caps. A corner of an outline has one vertex for each of its two sides. */
function makeGeometry(strips: readonly Strip[]): BufferGeometry {
  const stations: number[] = [];
  const corners: number[] = [];
  const sides: number[] = [];
  const triangles: number[] = [];
  let first = 0;
  for (const { edges, outline } of strips) {
    const normals = sideNormals(outline);
    const begin = stations.length / 3;
    const ring = 2 * outline.length;
    const add = (
      station: number,
      corner: readonly [number, number],
      side: readonly [number, number, number],
    ): number => {
      const before = Math.max(station - 1, 0);
      const after = Math.min(station, edges - 1);
      stations.push(first + station, first + before, first + after);
      corners.push(...corner);
      sides.push(...side);
      return stations.length / 3 - 1;
    };
    for (let station = 0; station <= edges; station++) {
      outline.forEach((corner, k) => {
        const next = outline[(k + 1) % outline.length] ?? corner;
        const [from, to] = normals[k] ?? [
          [0, 0],
          [0, 0],
        ];
        add(station, corner, [from[0], from[1], 0]);
        add(station, next, [to[0], to[1], 0]);
      });
      if (station === 0) continue;
      for (let k = 0; k < outline.length; k++) {
        const low = begin + (station - 1) * ring + 2 * k;
        const high = low + ring;
        triangles.push(low, low + 1, high + 1, low, high + 1, high);
      }
    }
    const flat = ShapeUtils.triangulateShape(
      outline.map(([x, y]) => new Vector2(x, y)),
      [],
    );
    for (const [station, direction] of [
      [0, -1],
      [edges, 1],
    ] as const) {
      const cap = outline.map((corner) => add(station, corner, [0, 0, direction]));
      for (const [a, b, c] of flat as [number, number, number][]) {
        const [i, j, k] = [cap[a] ?? 0, cap[b] ?? 0, cap[c] ?? 0];
        triangles.push(i, ...(direction > 0 ? [j, k] : [k, j]));
      }
    }
    first += edges + 1;
  }
  const made = new BufferGeometry();
  made.setAttribute("position", new BufferAttribute(new Float32Array(stations.length), 3));
  made.setAttribute("stations", new BufferAttribute(new Float32Array(stations), 3));
  made.setAttribute("corner", new BufferAttribute(new Float32Array(corners), 2));
  made.setAttribute("side", new BufferAttribute(new Float32Array(sides), 3));
  made.setIndex(new BufferAttribute(new Uint32Array(triangles), 1));
  return made;
}

type Pair = readonly [number, number];

/** The normals at both ends of each side of the outline: its own, or the mean with its neighbour's if that is round. */
function sideNormals(outline: readonly Pair[]): [Pair, Pair][] {
  const flat = outline.map(([x, y], k): Pair => {
    const [nextX, nextY] = outline[(k + 1) % outline.length] ?? [x, y];
    const length = Math.hypot(nextX - x, nextY - y) || 1;
    return [(nextY - y) / length, (x - nextX) / length];
  });
  const between = (a: Pair, b: Pair): Pair => {
    if (a[0] * b[0] + a[1] * b[1] < ROUND) return a;
    const length = Math.hypot(a[0] + b[0], a[1] + b[1]) || 1;
    return [(a[0] + b[0]) / length, (a[1] + b[1]) / length];
  };
  const count = outline.length;
  return flat.map((own, k) => [
    between(own, flat[(k + count - 1) % count] ?? own),
    between(own, flat[(k + 1) % count] ?? own),
  ]);
}

/** The outline counterclockwise, as sweeps want it. */
export function counterclockwise(outline: readonly Pair[]): readonly Pair[] {
  return ShapeUtils.area(outline.map(([x, y]) => new Vector2(x, y))) >= 0 ? outline : [...outline].reverse();
}
