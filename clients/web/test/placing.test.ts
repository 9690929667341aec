import assert from "node:assert/strict";
import { test } from "node:test";
import { Quaternion, Vector3 } from "three";
import { nearest } from "../src/linkages/placing";

const POINTS = [new Vector3(0, 0, 0), new Vector3(2, 0, 0.3), new Vector3(2, 1, 0), new Vector3(0, 1, -0.2)];

test("points are turned and moved to where others are", () => {
  for (const angle of [0, 0.4, 2.5, Math.PI]) {
    const axis = new Vector3(1, -2, 0.5).normalize();
    const turn = new Quaternion().setFromAxisAngle(axis, angle);
    const onto = POINTS.map((point) =>
      point
        .clone()
        .applyQuaternion(turn)
        .add(new Vector3(3, 0, -1)),
    );
    const placement = nearest(POINTS, onto);
    const { x = 0, y = 0, z = 0 } = placement?.rotationDegrees ?? {};
    const vector = new Vector3(x, y, z);
    const found = new Quaternion().setFromAxisAngle(vector.clone().normalize(), (vector.length() * Math.PI) / 180);
    const move = placement?.translation;
    POINTS.forEach((point, i) => {
      const placed = point
        .clone()
        .applyQuaternion(found)
        .add(new Vector3(move?.x, move?.y, move?.z));
      assert.ok(placed.distanceTo(onto[i] ?? placed) < 1e-6, `${angle}: point ${i}`);
    });
  }
});

test("without the same points on both sides there is no place", () => {
  assert.equal(nearest(POINTS, POINTS.slice(1)), null);
  assert.equal(nearest([], []), null);
  assert.equal(nearest(POINTS, [...POINTS.slice(1), new Vector3(Number.NaN, 0, 0)]), null);
});
