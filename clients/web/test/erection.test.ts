import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { DesignInfoSchema } from "../gen/limber/v1/design_pb";
import { type LinkageErection, LinkageErectionSchema, SceneSchema } from "../gen/limber/v1/scene_pb";
import { describeErection, shownErection } from "../src/linkages/erection";

const texts = (erection: LinkageErection): string[] => describeErection(erection).lines.map(({ text }) => text);

test("a plan says how it opens, what is held and which moments are applied", () => {
  const erection = create(LinkageErectionSchema, {
    meanAngleDegrees: 60,
    push: [{ joint: 3 }, { joint: 8 }],
    pathDegrees: [20, 40.123, 60],
    pathMoments: [0.012, -0.5, 1.25],
    support: { joint: 5, force: { x: 1, y: 2.5, z: 0 }, moment: { x: 0, y: 0.125, z: 3 } },
  });
  assert.deepEqual(texts(erection), [
    "opens from flat to 60°, pushed out of its plane at 2 joints",
    "hold joint 5 meanwhile: up to 1, 2.5, 0 N and 0, 0.125, 3 N m along x, y, z",
  ]);
  assert.deepEqual(describeErection(erection).moments, [
    ["20°", "0.012 N m"],
    ["40.1°", "-0.5 N m"],
    ["60°, without the push", "1.25 N m"],
  ]);
});

test("a plan without push needs no support, and one whose moments are not known has no table", () => {
  const erection = create(LinkageErectionSchema, { meanAngleDegrees: 45, pathDegrees: [20, 45], pathMoments: [1, 2] });
  assert.deepEqual(texts(erection), ["opens from flat to 45° by itself"]);
  assert.deepEqual(describeErection(erection).moments.at(-1), ["45°", "2 N m"]);
  assert.deepEqual(describeErection({ ...erection, pathMoments: [] }).moments, []);
  assert.match(texts(create(LinkageErectionSchema, { push: [{ joint: 1 }] }))[0] ?? "", /at 1 joint$/);
});

test("a shape that no path leads to is marked", () => {
  const erection = create(LinkageErectionSchema, { failure: "opening stopped at 31 degrees" });
  assert.deepEqual(describeErection(erection), {
    lines: [{ tone: "warning", text: "no working path from flat is known: opening stopped at 31 degrees" }],
    moments: [],
  });
});

test("the plan is that of the design, and of the linkage as soon as the design is taken", () => {
  const scene = create(SceneSchema, { linkage: { erection: { meanAngleDegrees: 30 } } });
  const design = create(DesignInfoSchema, { erection: { meanAngleDegrees: 60 } });
  const angle = (...of: Parameters<typeof shownErection>) => shownErection(...of)?.meanAngleDegrees;
  assert.equal(angle(null, null), undefined);
  assert.equal(angle(null, scene), 30);
  assert.equal(angle(design, scene), 60);
  assert.equal(angle(create(DesignInfoSchema, {}), scene), undefined, "it is running");
  assert.equal(angle({ ...design, takenRevision: 4n }, scene), 30);
});
