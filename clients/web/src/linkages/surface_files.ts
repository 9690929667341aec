import { BufferAttribute, BufferGeometry, Mesh, type Object3D, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import { STLLoader } from "three/addons/loaders/STLLoader.js";

/** Endings of files of triangle surfaces. */
export const SURFACES = [".obj", ".ply", ".stl", ".off", ".glb"];

function geometryOf(corners: number[]): BufferGeometry {
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(corners), 3));
}

/** Polygons are fanned; colours and normals are passed over. */
function readOff(text: string): BufferGeometry {
  const words = text
    .split("\n")
    .map((line) => line.replace(/#.*/, "").trim().split(/\s+/))
    .filter((line) => line[0] !== "");
  if (words[0]?.[0]?.endsWith("OFF")) words[0].shift();
  if (words[0]?.length === 0) words.shift();
  const [vertexCount, faceCount] = (words[0] ?? []).map(Number);
  const points = words.slice(1, 1 + (vertexCount ?? 0)).map((line) => line.slice(0, 3).map(Number));
  const corners: number[] = [];
  for (const line of words.slice(1 + points.length, 1 + points.length + (faceCount ?? 0))) {
    const face = line.slice(1, 1 + Number(line[0])).map((index) => points[Number(index)] ?? [0, 0, 0]);
    for (let i = 2; i < face.length; i++)
      for (const corner of [face[0], face[i - 1], face[i]]) corners.push(...(corner ?? []));
  }
  return geometryOf(corners);
}

/** Triangles of a scene's meshes where its objects put them, as triangles of their own. */
function placed(scene: Object3D): BufferGeometry[] {
  const found: BufferGeometry[] = [];
  scene.updateMatrixWorld(true);
  scene.traverse((child) => {
    if (!(child instanceof Mesh)) return;
    const geometry = child.geometry as BufferGeometry;
    const positions = geometry.getAttribute("position");
    const index = geometry.getIndex();
    const corners: number[] = [];
    for (let i = 0; i < (index ?? positions).count; i++) {
      const corner = new Vector3().fromBufferAttribute(positions, index ? index.getX(i) : i);
      corners.push(...corner.applyMatrix4(child.matrixWorld));
    }
    found.push(geometryOf(corners));
  });
  return found;
}

/** Geometries of a surface file, for drawing; the server reads the file for its own use. */
export async function readSurface(name: string, content: Uint8Array): Promise<BufferGeometry[]> {
  const kind = name.slice(name.lastIndexOf(".")).toLowerCase();
  const data = content.slice().buffer as ArrayBuffer;
  if (kind === ".ply") return [new PLYLoader().parse(data)];
  if (kind === ".stl") return [new STLLoader().parse(data)];
  if (kind === ".glb") return placed((await new GLTFLoader().parseAsync(data, "")).scene);
  const text = new TextDecoder().decode(content);
  if (kind === ".off") return [readOff(text)];
  return placed(new OBJLoader().parse(text));
}
