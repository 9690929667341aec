import assert from "node:assert/strict";
import { test } from "node:test";
import { DataUtils } from "three";
import { columnSizes, halfError, toHalf } from "../src/bodies/halves";

/** Largest error of a position where the basis is rounded as it goes to the GPU. */
function error(values: Float32Array, columns: number, sizes: Float32Array, coordinates: Float32Array): number {
  let most = 0;
  for (let row = 0; row < values.length / columns; row++) {
    let off = 0;
    for (let k = 0; k < columns; k++) {
      const value = values[row * columns + k] ?? 0;
      const size = sizes[k] ?? 1;
      off += (DataUtils.fromHalfFloat(toHalf(value / size)) * size - value) * (coordinates[k] ?? 0);
    }
    most = Math.max(most, Math.abs(off));
  }
  return most;
}

test("rounding to half floats is bounded, of tiny and of huge columns, too", () => {
  const columns = 3;
  const nodes = Uint32Array.from({ length: 50 }, (_, i) => i);
  const values = Float32Array.from({ length: 150 * columns }, (_, i) => {
    const share = Math.sin(12.9898 * i) * (i % 7 === 0 ? 1e-4 : 1);
    return share * ([1e-7, 1, 3e6][i % columns] ?? 1);
  });
  const coordinates = Float32Array.from([2e7, 2, 1e-6]);
  const sizes = columnSizes({ values, columns }, nodes);
  assert.ok(Math.abs((sizes[2] ?? 0) / 3e6 - 1) < 0.05);
  const bound = halfError({ values, columns }, nodes, sizes, coordinates);
  const found = error(values, columns, sizes, coordinates);
  assert.ok(found > 0 && found <= bound, `${found} is beyond ${bound}`);
  assert.ok(bound < 0.01, `${bound} says nothing`);
});

test("a column of zeros has the size 1", () => {
  assert.deepEqual([...columnSizes({ values: new Float32Array(6), columns: 2 }, Uint32Array.of(0))], [1, 1]);
});
