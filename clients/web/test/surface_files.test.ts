import assert from "node:assert/strict";
import { test } from "node:test";
import type { BufferGeometry } from "three";
import { readSurface } from "../src/linkages/surface_files";

/** Corners of all triangles, rounded. */
function corners(geometries: BufferGeometry[]): number[] {
  return geometries.flatMap((geometry) =>
    [...geometry.getAttribute("position").array].map((value) => Math.round(1e6 * value) / 1e6 + 0),
  );
}

const SQUARE = [0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 0, 0, 2, 1, 0, 0, 1, 0];

test("polygons of an .off are cut into triangles", async () => {
  for (const head of ["OFF\n4 1 4\n", "# by hand\nCOFF 4 1 4\n", "4 1\n"]) {
    const text = `${head}0 0 0 255 0 0\n2 0 0 # a corner\n\n2 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5\n`;
    assert.deepEqual(corners(await readSurface("a.OFF", new TextEncoder().encode(text))), SQUARE);
  }
});

/** A .glb of one mesh, which node 1 places. */
function glb(node: object): Uint8Array {
  const points = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0]);
  const json = JSON.stringify({
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [
      { children: [1], scale: [2, 1, 1] },
      { mesh: 0, ...node },
    ],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    accessors: [
      { bufferView: 0, componentType: 5126, type: "VEC3", count: 4, min: [0, 0, 0], max: [1, 1, 0] },
      { bufferView: 1, componentType: 5121, type: "SCALAR", count: 6 },
    ],
    bufferViews: [
      { buffer: 0, byteLength: 48 },
      { buffer: 0, byteOffset: 48, byteLength: 6 },
    ],
    buffers: [{ byteLength: 56 }],
  });
  const text = new TextEncoder().encode(json.padEnd(4 * Math.ceil(json.length / 4)));
  const bytes = new Uint8Array(28 + text.length + 56);
  const view = new DataView(bytes.buffer);
  [0x46546c67, 2, bytes.length, text.length, 0x4e4f534a].forEach((value, i) => {
    view.setUint32(4 * i, value, true);
  });
  bytes.set(text, 20);
  view.setUint32(20 + text.length, 56, true);
  view.setUint32(24 + text.length, 0x004e4942, true);
  bytes.set(new Uint8Array(points.buffer), 28 + text.length);
  bytes.set([0, 1, 3, 0, 3, 2], 28 + text.length + 48);
  return bytes;
}

test("meshes of a .glb are where its nodes put them", async () => {
  assert.deepEqual(corners(await readSurface("a.glb", glb({}))), SQUARE);
  const moved = corners(await readSurface("a.glb", glb({ translation: [1, 0, 3] })));
  assert.deepEqual(moved.slice(0, 6), [2, 0, 3, 4, 0, 3]);
});

test("a faulty .glb is refused", async () => {
  await assert.rejects(readSurface("a.glb", new TextEncoder().encode("glTF")));
});
