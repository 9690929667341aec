import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  FrontSide,
  Group,
  Mesh,
  MeshLambertMaterial,
  type Ray,
  Raycaster,
  Triangle,
  Vector2,
  Vector3,
  type WebGLProgramParametersWithUniforms,
} from "three";
import { PointSurface } from "../../gen/limber/v1/scene_pb";
import type { GetGeometryResponse } from "../../gen/limber/v1/service_pb";
import type { Stage } from "../view/stage";
import { integers, type Reals } from "../wire/arrays";
import { Basis } from "./basis";
import { Carried } from "./carried";
import { Deformer } from "./deformer";
import { type Place, type WeightedNodes, weightedNodes } from "./places";

/** A point of the body under the pointer. */
export interface BodyHit {
  /** The nearest: of a carried surface that which its nearest vertex follows most. */
  node: number;
  /** The very point, as a constraint names it. */
  point: { triangle: number; weights: number[]; surface: PointSurface };
  /** Position of that point, as shown. */
  position: Vector3;
}

/** The deformed surface of a body: the boundary of its tets, or the surface that it carries. */
export class BodySurface {
  readonly group = new Group();
  basis: Basis | null = null;
  deformer: Deformer | null = null;
  /** The scene's `surface`, if it names one. */
  carried: Carried | null = null;
  /** Whether the carried surface is drawn, where there is one. */
  isCarriedWanted = true;
  private mesh: Mesh | null = null;
  /** Triangles of the boundary of the tets. */
  private boundary = new Uint32Array(0);
  private boundaryTriangles = new Uint32Array(0);
  /** Its triangles, of nodes. */
  private meshTriangles = new Uint32Array(0);
  private length = 1;
  private shown: Reals = new Float32Array(0);

  constructor(private readonly stage: Stage) {
    stage.content.add(this.group);
  }

  /** Low and high corner of the body at rest. */
  setGeometry(geometry: GetGeometryResponse): [Vector3, Vector3] {
    this.basis = new Basis(geometry.rest, geometry.basis);
    if (geometry.carriedSurface && !this.carried) this.carried = new Carried(geometry.carriedSurface);
    const surface = integers(geometry.surface);
    this.meshTriangles = Uint32Array.from(surface);
    const used = [...new Set(surface)].sort((a, b) => a - b);
    this.boundary = Uint32Array.from(used);
    const compact = new Map(used.map((node, i) => [node, i]));
    this.boundaryTriangles = Uint32Array.from(surface, (node) => compact.get(node) ?? 0);
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = low.clone().negate();
    const point = new Vector3();
    for (const node of used) {
      point.fromArray(this.basis.rest, 3 * node).add(new Vector3(...this.basis.origin));
      low.min(point);
      high.max(point);
    }
    this.length = high.distanceTo(low);
    this.rebuild();
    return [low, high];
  }

  /** Draws the carried surface, or the boundary of the tets. */
  setCarried(isWanted: boolean): void {
    this.isCarriedWanted = isWanted;
    const { shown } = this;
    this.rebuild();
    this.show(shown);
  }

  show(coordinates: Reals): void {
    if (!this.deformer || coordinates.length !== this.basis?.columns) return;
    this.shown = coordinates;
    this.deformer.show(coordinates);
    this.stage.invalidate();
  }

  /** The nodes with which the held place of a constraint moves. */
  held(place: Place): WeightedNodes {
    return weightedNodes(place, { triangles: this.meshTriangles, carried: this.carried });
  }

  private get drawn(): Carried | null {
    return this.isCarriedWanted ? this.carried : null;
  }

  private get triangles(): Uint32Array {
    return this.drawn?.triangles ?? this.boundaryTriangles;
  }

  private nodeOf(vertex: number): number {
    return this.drawn ? this.drawn.nodeOf(vertex) : (this.boundary[vertex] ?? 0);
  }

  /** Positions of the drawn surface's vertices, as shown. */
  private positions(basis: Basis): Float64Array {
    const { drawn } = this;
    if (!drawn) return basis.positions(this.boundary, this.shown);
    return drawn.positions(basis.positions(drawn.nodes, this.shown), new Float64Array(3 * drawn.vertices));
  }

  /** The first intersection of a ray with the surface. */
  pick(raycaster: Raycaster): BodyHit | null {
    const { basis } = this;
    if (!basis || !this.shown.length) return null;
    const x = this.positions(basis);
    const { triangles } = this;
    const isOpaque = !this.drawn; // A carried surface may be open, or turned inside out: it is met from both sides.
    const corners = [new Vector3(), new Vector3(), new Vector3()] as const;
    const at = new Vector3();
    const ray: Ray = raycaster.ray;
    let nearest = Infinity;
    let first = -1;
    const position = new Vector3();
    for (let i = 0; i < triangles.length; i += 3) {
      corners.forEach((corner, k) => {
        corner.fromArray(x, 3 * (triangles[i + k] ?? 0));
      });
      if (!ray.intersectTriangle(corners[0], corners[1], corners[2], isOpaque, at)) continue;
      const distance = at.distanceTo(ray.origin);
      if (distance >= nearest) continue;
      nearest = distance;
      first = i;
      position.copy(at);
    }
    if (first < 0) return null;
    corners.forEach((corner, k) => {
      corner.fromArray(x, 3 * (triangles[first + k] ?? 0));
    });
    const weights = barycentric(position, corners);
    const best = [0, 1, 2].reduce((a, b) =>
      (corners[b]?.distanceTo(position) ?? 0) < (corners[a]?.distanceTo(position) ?? 0) ? b : a,
    );
    const surface = this.drawn ? PointSurface.CARRIED : PointSurface.MESH;
    const node = this.nodeOf(triangles[first + best] ?? 0);
    return { node, point: { triangle: first / 3, weights, surface }, position };
  }

  /** The same of a pixel of the canvas. */
  pickAt(x: number, y: number): BodyHit | null {
    const { clientWidth, clientHeight } = this.stage.canvas;
    const raycaster = new Raycaster();
    raycaster.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.stage.camera);
    return this.pick(raycaster);
  }

  /** Nodes of the surface whose pixels are within a rectangle, in front or behind. */
  within(rectangle: { contains(x: number, y: number): boolean }): number[] {
    if (!this.basis) return [];
    const x = this.positions(this.basis);
    const found = new Set<number>();
    const point = new Vector3();
    for (let i = 0; i < x.length; i += 3) {
      const at = this.stage.project(point.fromArray(x, i));
      if (at.z <= 1 && rectangle.contains(at.x, at.y)) found.add(this.nodeOf(i / 3));
    }
    return [...found].sort((a, b) => a - b);
  }

  /** Nodes of the surface within a distance of a point, as shown. */
  near(point: Vector3, distance: number): number[] {
    if (!this.basis) return [];
    const x = this.positions(this.basis);
    const found = new Set<number>();
    for (let i = 0; i < x.length; i += 3)
      if (Math.hypot((x[i] ?? 0) - point.x, (x[i + 1] ?? 0) - point.y, (x[i + 2] ?? 0) - point.z) <= distance)
        found.add(this.nodeOf(i / 3));
    return [...found];
  }

  private rebuild(): void {
    this.clear();
    const { basis, drawn } = this;
    if (!basis) return;
    const nodes = drawn?.nodes ?? this.boundary;
    this.deformer = new Deformer(this.stage.renderer, basis, nodes, this.triangles, this.length, drawn);
    this.mesh = this.makeMesh(this.deformer);
    this.mesh.position.set(...basis.origin);
    this.group.add(this.mesh);
  }

  clear(): void {
    this.group.clear();
    this.deformer?.dispose();
    this.mesh?.geometry.dispose();
    this.deformer = null;
    this.mesh = null;
  }

  private makeMesh(deformer: Deformer): Mesh {
    const geometry = new BufferGeometry();
    geometry.setAttribute(
      "position",
      new BufferAttribute(new Float32Array(3 * (this.drawn?.vertices ?? this.boundary.length)), 3),
    );
    geometry.setIndex(new BufferAttribute(this.triangles, 1));
    const material = new MeshLambertMaterial({ color: 0xdc8a5c, side: this.drawn ? DoubleSide : FrontSide });
    material.onBeforeCompile = (shader) => useTextures(shader, deformer);
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    return mesh;
  }
}

/** Weights of a triangle's corners at a point of it: none negative, their sum 1. */
function barycentric(point: Vector3, corners: readonly [Vector3, Vector3, Vector3]): number[] {
  const weights = Triangle.getBarycoord(point, ...corners, new Vector3());
  if (!weights) return [1, 0, 0]; // Without area.
  const shares = weights.toArray().map((weight) => Math.min(1, Math.max(0, weight)));
  const sum = shares.reduce((a, b) => a + b, 0);
  return shares.map((share) => share / sum);
}

/** Positions and normals are from the deformer's textures. At an edge of the surface, the triangle's own normal is used. */
function useTextures(shader: WebGLProgramParametersWithUniforms, deformer: Deformer): void {
  shader.uniforms.deformed = { value: deformer.positions };
  shader.uniforms.deformedNormals = { value: deformer.normals };
  shader.uniforms.side = { value: deformer.side };
  const fetch = "ivec2(gl_VertexID % side, gl_VertexID / side)";
  shader.vertexShader =
    `uniform highp sampler2D deformed;\nuniform highp sampler2D deformedNormals;\nuniform int side;\n${shader.vertexShader}`
      .replace("#include <beginnormal_vertex>", `vec3 objectNormal = texelFetch(deformedNormals, ${fetch}, 0).xyz;`)
      .replace("#include <begin_vertex>", `vec3 transformed = texelFetch(deformed, ${fetch}, 0).xyz;`);
  shader.fragmentShader = shader.fragmentShader.replace(
    "#include <normal_fragment_begin>",
    `#include <normal_fragment_begin>
     vec3 facet = normalize(cross(dFdx(vViewPosition), dFdy(vViewPosition)));
     normal = normalize(mix(facet, normal, smoothstep(0.5, 0.65, dot(facet, normal))));`,
  );
}
