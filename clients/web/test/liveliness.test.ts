import assert from "node:assert/strict";
import { test } from "node:test";
import { TimeDiscretisation } from "../gen/limber/v1/scene_pb";
import { calmness, DEFAULT, liveliness } from "../src/bodies/liveliness";

test("the control's place and its numbers belong to each other", () => {
  for (const place of [0, 0.25, 0.5, 0.8]) {
    assert.ok(Math.abs(calmness(liveliness(place)) - place) < 1e-12);
  }
  const made = liveliness(calmness(DEFAULT));
  assert.ok(Math.abs(made.dampingRatio - DEFAULT.dampingRatio) < 1e-12);
  assert.ok(Math.abs(made.forceSmoothing - DEFAULT.forceSmoothing) < 1e-12);
});

test("calmer is more damped and smoother, within what a server takes", () => {
  let before = liveliness(0);
  for (let place = 0.05; place <= 1; place += 0.05) {
    const now = liveliness(place);
    assert.ok(now.dampingRatio > before.dampingRatio || now.dampingRatio === 0.95);
    assert.ok(now.forceSmoothing > before.forceSmoothing);
    assert.ok(now.dampingRatio < 1);
    before = now;
  }
});

test("published differences are at the lively end", () => {
  assert.equal(calmness({ ...DEFAULT, discretisation: TimeDiscretisation.DIFFERENCES }), 0);
});
