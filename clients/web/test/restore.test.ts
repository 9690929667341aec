import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { type Keyframe, SceneSchema } from "../gen/limber/v1/scene_pb";
import { posesOf, restored } from "../src/session/restore";
import { fromFloats } from "../src/wire/arrays";

const pose = (value: number): Keyframe["pose"] => ({
  case: "positions",
  value: fromFloats(Float32Array.from([value, 0, 0]), [1, 3]),
});
const opened = create(SceneSchema, {
  mesh: { source: { case: "file", value: { name: "a.msh" } } },
  baseMotion: { source: { case: "pc2", value: Uint8Array.from([1, 2]) } },
  surface: { source: { case: "file", value: { name: "skin.obj" } } },
  keyframes: [
    { frame: 3, pose: pose(3) },
    { frame: 5, pose: pose(5) },
  ],
});
const first = create(SceneSchema, {
  keyframes: [
    { id: 1n, frame: 3 },
    { id: 2n, frame: 5 },
  ],
});

test("a scene is opened again with all that the session's answers leave out, as edited", () => {
  const poses = posesOf(opened, first);
  poses.set(4n, pose(4));
  const edited = create(SceneSchema, {
    frames: 9,
    keyframes: [
      { id: 2n, frame: 6 },
      { id: 4n, frame: 8 },
    ],
  });
  const { scene, missing } = restored(edited, { opened, poses, hasBaseMotion: true, hasSurface: true });
  assert.deepEqual(missing, []);
  assert.deepEqual(
    scene.keyframes.map(({ frame, pose }) => [frame, pose]),
    [
      [6, pose(5)],
      [8, pose(4)],
    ],
  );
  assert.equal(scene.frames, 9);
  assert.deepEqual([scene.mesh, scene.baseMotion, scene.surface], [opened.mesh, opened.baseMotion, opened.surface]);
  assert.equal(edited.mesh, undefined);
  // Keyframes that have numbers already keep them.
  assert.deepEqual([...posesOf(scene, create(SceneSchema)).keys()], [2n, 4n]);
});

test("what is not here is named", () => {
  const edited = create(SceneSchema, { keyframes: [{ id: 7n }] });
  const { missing } = restored(edited, { opened: null, poses: new Map(), hasBaseMotion: true, hasSurface: true });
  assert.deepEqual(missing, ["its mesh", "its base motion", "its surface", "the pose of keyframe 7"]);
  const sample = create(SceneSchema, { mesh: { source: { case: "sample", value: "beam" } } });
  const kept = { opened: null, poses: new Map(), hasBaseMotion: false, hasSurface: false };
  assert.deepEqual(restored(sample, kept).missing, []);
  assert.deepEqual(restored(create(SceneSchema, { beams: {} }), kept).missing, []);
});
