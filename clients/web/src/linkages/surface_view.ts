import { DoubleSide, Mesh, MeshLambertMaterial, Vector3 } from "three";
import type { SurfacePlacement } from "../../gen/limber/v1/design_pb";
import type { Stage } from "../view/stage";
import { readSurface } from "./surface_files";

/** The surface that a linkage is designed for, where the design has put it. */
export class SurfaceView {
  private meshes: Mesh[] = [];
  private placement: SurfacePlacement | undefined;
  private newest = 0;
  private readonly material = new MeshLambertMaterial({
    color: 0x5b8fa8,
    transparent: true,
    opacity: 0.28,
    side: DoubleSide,
    depthWrite: false,
  });

  constructor(private readonly stage: Stage) {}

  /** Draws a file once it is read; a faulty one is not drawn, and refused by the server when it is designed for. */
  async set(name: string, content: Uint8Array): Promise<void> {
    const number = ++this.newest;
    const geometries = await readSurface(name, content).catch(() => []);
    if (number !== this.newest) return;
    for (const mesh of this.meshes) {
      mesh.geometry.dispose();
      this.stage.content.remove(mesh);
    }
    this.meshes = geometries.map((geometry) => {
      geometry.computeVertexNormals();
      const mesh = new Mesh(geometry, this.material);
      this.stage.content.add(mesh);
      return mesh;
    });
    this.place(this.placement);
    this.stage.invalidate();
  }

  /** Turned, then scaled, then moved. */
  place(placement: SurfacePlacement | undefined): void {
    this.placement = placement;
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
