import { type BufferGeometry, DoubleSide, Mesh, MeshLambertMaterial, type Object3D, Vector3 } from "three";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import { STLLoader } from "three/addons/loaders/STLLoader.js";
import type { SurfacePlacement } from "../../gen/limber/v1/design_pb";
import type { Stage } from "../view/stage";

/** Geometries of a surface file. */
function read(name: string, content: Uint8Array): BufferGeometry[] {
  const kind = name.slice(name.lastIndexOf(".")).toLowerCase();
  const data = content.slice().buffer as ArrayBuffer;
  if (kind === ".ply") return [new PLYLoader().parse(data)];
  if (kind === ".stl") return [new STLLoader().parse(data)];
  const found: BufferGeometry[] = [];
  new OBJLoader().parse(new TextDecoder().decode(content)).traverse((child: Object3D) => {
    if (child instanceof Mesh) found.push(child.geometry as BufferGeometry);
  });
  return found;
}

/** The surface that a linkage is designed for, where the design has put it. */
export class SurfaceView {
  private meshes: Mesh[] = [];
  private readonly material = new MeshLambertMaterial({
    color: 0x5b8fa8,
    transparent: true,
    opacity: 0.28,
    side: DoubleSide,
    depthWrite: false,
  });

  constructor(private readonly stage: Stage) {}

  set(name: string, content: Uint8Array): void {
    for (const mesh of this.meshes) {
      mesh.geometry.dispose();
      this.stage.content.remove(mesh);
    }
    this.meshes = read(name, content).map((geometry) => {
      geometry.computeVertexNormals();
      const mesh = new Mesh(geometry, this.material);
      this.stage.content.add(mesh);
      return mesh;
    });
    this.stage.invalidate();
  }

  /** Turned, then scaled, then moved. */
  place(placement: SurfacePlacement | undefined): void {
    const turn = placement?.rotationDegrees;
    const axis = new Vector3(turn?.x ?? 0, turn?.y ?? 0, turn?.z ?? 0);
    const angle = (axis.length() * Math.PI) / 180;
    if (angle > 0) axis.normalize();
    const move = placement?.translation;
    for (const mesh of this.meshes) {
      mesh.quaternion.setFromAxisAngle(angle > 0 ? axis : new Vector3(0, 0, 1), angle);
      mesh.scale.setScalar(placement?.scale ?? 1);
      mesh.position.set(move?.x ?? 0, move?.y ?? 0, move?.z ?? 0);
    }
    if (this.meshes.length) this.stage.invalidate();
  }
}
