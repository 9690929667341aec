import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { PaintedQuantity, SceneSchema } from "../gen/limber/v1/scene_pb";
import { lowestVertices } from "../src/page/file_dialogs";
import { carry, hasOnlyLines, meshFile, sceneOfJson } from "../src/page/files";
import { painted } from "../src/page/stiffness";

const file = (name: string, text: string): { name: string; content: Uint8Array } => ({
  name,
  content: new TextEncoder().encode(text),
});

test("a scene names files that are dropped with it", () => {
  const scene = file(
    "arm.json",
    '{"name": "arm", "frames": 60, "fixed_nodes": [1, 2], "mesh": {"path": "meshes/arm.ele"}}',
  );
  const all = [scene, file("arm.ele", "x"), file("arm.node", "y"), file("other.msh", "z")];
  const made = sceneOfJson(scene, all);
  assert.deepEqual(made.fixedNodes, [1, 2]);
  const source = made.mesh?.source;
  assert.equal(source?.case, "file");
  assert.deepEqual(source?.case === "file" && [source.value.name, Object.keys(source.value.companions)], [
    "arm.ele",
    ["arm.node"],
  ]);
});

test("a scene names the file that paints it", () => {
  const scene = file("arm.json", '{"mesh": {"path": "arm.msh"}, "painted_stiffness": {"path": "stiff/arm.txt"}}');
  const made = sceneOfJson(scene, [scene, file("arm.msh", "x"), file("arm.txt", "1 2 3")]);
  const source = made.paintedStiffness?.source;
  assert.ok(source?.case === "file" && source.value.name === "arm.txt" && source.value.content.length === 5);
});

test("a chosen file paints a body", () => {
  const made = painted("a.txt", new Uint8Array([49]), PaintedQuantity.YOUNGS_MODULUS);
  assert.equal(made.quantity, PaintedQuantity.YOUNGS_MODULUS);
  assert.ok(made.source.case === "file" && made.source.value.name === "a.txt");
});

test("a file that is missing is named", () => {
  const scene = file("arm.json", '{"mesh": {"path": "arm.msh"}}');
  assert.throws(() => sceneOfJson(scene, [scene]), /arm\.msh: drop it together/);
});

test("what is no scene is refused in words", () => {
  const not = (text: string): void => void sceneOfJson(file("a.json", text), []);
  assert.throws(() => not("{"), /a\.json is not JSON/);
  assert.throws(() => not("[]"), /an object is expected|JSON object/);
  assert.throws(() => not('{"frame": 3}'), /no scene: .*frame/);
});

test("a structure alone is one of beams", () => {
  const made = sceneOfJson(file("s.json", '{"nodes": [{"position": {"x": 1}}], "elements": []}'), []);
  assert.equal(made.beams?.structure?.nodes[0]?.position?.x, 1);
});

test("lines are told from surfaces", () => {
  assert.ok(hasOnlyLines(file("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n")));
  assert.ok(!hasOnlyLines(file("a.obj", "v 0 0 0\nl 1 2\nf 1 2 3\n")));
  assert.ok(!hasOnlyLines(file("a.stl", "l 1 2")));
});

test("beams are held at their lowest vertices", () => {
  assert.deepEqual(lowestVertices(file("a.obj", "v 0 0 2\nv 1 0 0\nv 2 0 0.001\nl 1 2\n")), [1, 2]);
  const ply =
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nelement edge 1\nend_header\n0 0 1\n0 0 0\n0 1\n";
  assert.deepEqual(lowestVertices(file("a.ply", ply)), [1]);
});

test("files of the same stem go along", () => {
  const mesh = file("a.veg", "m");
  assert.deepEqual(Object.keys(meshFile(mesh, [mesh, file("a.elastic", "e"), file("b.msh", "n")]).companions), [
    "a.elastic",
  ]);
});

test("a scene that was exported is filled with its surface, the surface's materials, and its base motion", () => {
  const scene = file(
    "kept.json",
    '{"mesh": {"path": "kept.vtu"}, "surface": {"path": "kept_surface_given.obj"}, "base_motion": {"path": "kept_base.pc2"}}',
  );
  const surface = file("kept_surface_given.obj", "mtllib sub/paint.mtl\nv 0 0 0\nmtllib other.mtl\r\n");
  const all = [scene, file("kept.vtu", "m"), surface, file("paint.mtl", "p"), file("kept_base.pc2", "b")];
  const made = sceneOfJson(scene, all);
  const mesh = made.mesh?.source;
  assert.deepEqual(mesh?.case === "file" && Object.keys(mesh.value.companions), []);
  const source = made.surface?.source;
  assert.deepEqual(source?.case === "file" && [source.value.name, Object.keys(source.value.companions)], [
    "kept_surface_given.obj",
    ["paint.mtl"],
  ]);
  assert.equal(made.baseMotion?.source.case, "pc2");
  assert.throws(() => sceneOfJson(scene, [scene, file("kept.vtu", "m")]), /kept_surface_given\.obj: drop it together/);
});

test("a body carries the surface that its tets were made of", () => {
  const surface = file("cow.obj", "mtllib cow.mtl\n");
  const source = carry(create(SceneSchema), surface, [surface, file("cow.mtl", "m")]).surface?.source;
  assert.deepEqual(source?.case === "file" && [source.value.name, Object.keys(source.value.companions)], [
    "cow.obj",
    ["cow.mtl"],
  ]);
});
