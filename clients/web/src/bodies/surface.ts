import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Mesh,
  MeshLambertMaterial,
  type Ray,
  Raycaster,
  Vector2,
  Vector3,
  type WebGLProgramParametersWithUniforms,
} from "three";
import type { CarriedSurface, GetGeometryResponse } from "../../gen/limber/v1/service_pb";
import type { Stage } from "../view/stage";
import { integers } from "../wire/arrays";
import { Basis } from "./basis";
import { carriedSurface } from "./carried";
import { Deformer } from "./deformer";

/** A point of the body under the pointer. */
export interface BodyHit {
  node: number;
  /** Of that node, as shown. */
  position: Vector3;
}

/** The deformed surface of a body. */
export class BodySurface {
  readonly group = new Group();
  basis: Basis | null = null;
  deformer: Deformer | null = null;
  private mesh: Mesh | null = null;
  private carried: CarriedSurface | null = null;
  private vertices = new Uint32Array(0);
  private triangles = new Uint32Array(0);
  private shown: Float32Array = new Float32Array(0);
  private extent = 1;

  constructor(private readonly stage: Stage) {
    stage.content.add(this.group);
  }

  /** Low and high corner of the body at rest. */
  setGeometry(geometry: GetGeometryResponse): [Vector3, Vector3] {
    this.clear();
    this.basis = new Basis(geometry.rest, geometry.basis);
    const surface = integers(geometry.surface);
    const used = [...new Set(surface)].sort((a, b) => a - b);
    this.vertices = Uint32Array.from(used);
    const compact = new Map(used.map((node, i) => [node, i]));
    this.triangles = Uint32Array.from(surface, (node) => compact.get(node) ?? 0);
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = low.clone().negate();
    const point = new Vector3();
    for (const node of used) {
      point.fromArray(this.basis.rest, 3 * node);
      low.min(point);
      high.max(point);
    }
    this.extent = high.distanceTo(low);
    this.draw();
    return [low, high];
  }

  /** From now on this is drawn in place of the boundary of the tets, whose nodes are still what is picked. */
  carry(carried: CarriedSurface): void {
    this.carried = carried;
    if (!this.basis) return;
    this.clear();
    this.draw();
    if (this.shown.length) this.show(this.shown);
  }

  show(coordinates: Float32Array): void {
    if (!this.deformer || coordinates.length !== this.basis?.columns) return;
    this.shown = coordinates;
    this.deformer.show(coordinates);
    this.stage.invalidate();
  }

  /** The surface's node nearest to where a ray meets it. */
  pick(raycaster: Raycaster): BodyHit | null {
    const { basis } = this;
    if (!basis || !this.shown.length) return null;
    const x = new Float32Array(3 * this.vertices.length);
    this.vertices.forEach((node, i) => {
      basis.position(node, this.shown, x, 3 * i);
    });
    const corners = [new Vector3(), new Vector3(), new Vector3()] as const;
    const at = new Vector3();
    const ray: Ray = raycaster.ray;
    let nearest = Infinity;
    let hit: BodyHit | null = null;
    for (let i = 0; i < this.triangles.length; i += 3) {
      corners.forEach((corner, k) => {
        corner.fromArray(x, 3 * (this.triangles[i + k] ?? 0));
      });
      if (!ray.intersectTriangle(corners[0], corners[1], corners[2], true, at)) continue;
      const distance = at.distanceTo(ray.origin);
      if (distance >= nearest) continue;
      nearest = distance;
      const best = [0, 1, 2].reduce((a, b) =>
        (corners[b]?.distanceTo(at) ?? 0) < (corners[a]?.distanceTo(at) ?? 0) ? b : a,
      );
      hit = { node: this.vertices[this.triangles[i + best] ?? 0] ?? 0, position: (corners[best] as Vector3).clone() };
    }
    return hit;
  }

  /** The same of a pixel of the canvas. */
  pickAt(x: number, y: number): BodyHit | null {
    const { clientWidth, clientHeight } = this.stage.canvas;
    const raycaster = new Raycaster();
    raycaster.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.stage.camera);
    return this.pick(raycaster);
  }

  /** Nodes of the surface within a distance of a point, as shown. */
  near(point: Vector3, distance: number): number[] {
    const one = [0, 0, 0];
    return [...this.vertices].filter((node) => {
      this.basis?.position(node, this.shown, one);
      return Math.hypot((one[0] ?? 0) - point.x, (one[1] ?? 0) - point.y, (one[2] ?? 0) - point.z) <= distance;
    });
  }

  clear(): void {
    this.group.clear();
    this.deformer?.dispose();
    this.mesh?.geometry.dispose();
    this.deformer = null;
    this.mesh = null;
  }

  private draw(): void {
    if (!this.basis) return;
    const drawn = this.carried && carriedSurface(this.carried, this.basis);
    const vertices = drawn ? Uint32Array.from({ length: drawn.basis.nodes }, (_, i) => i) : this.vertices;
    const triangles = drawn?.triangles ?? this.triangles;
    this.deformer = new Deformer(this.stage.renderer, drawn?.basis ?? this.basis, vertices, triangles, this.extent);
    this.mesh = this.makeMesh(this.deformer, vertices.length, triangles);
    this.group.add(this.mesh);
  }

  private makeMesh(deformer: Deformer, vertices: number, triangles: Uint32Array): Mesh {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * vertices), 3));
    geometry.setIndex(new BufferAttribute(triangles, 1));
    const material = new MeshLambertMaterial({ color: 0xdc8a5c });
    material.onBeforeCompile = (shader) => useTextures(shader, deformer);
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    return mesh;
  }
}

/** Positions and normals come from the deformer's textures. Where the surface has an edge, the triangle's own normal. */
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
