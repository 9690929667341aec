import type { GetGeometryResponse } from "../../gen/limber/v1/service_pb";
import { floats, fromFloats } from "../wire/arrays";
import { LimberError } from "../wire/errors";

/** Columns after those of a basis: rows x (known + new), of rows x known and rows x new. */
function joined(known: Float32Array, first: number, more: Float32Array, rows: number): Float32Array {
  const next = more.length / rows;
  const made = new Float32Array(rows * (first + next));
  for (let row = 0; row < rows; row++) {
    made.set(known.subarray(row * first, (row + 1) * first), row * (first + next));
    made.set(more.subarray(row * next, (row + 1) * next), row * (first + next) + first);
  }
  return made;
}

/**
 * A whole geometry of an answer that leaves out the parts that this page holds. These are the basis or its first
 * columns, the carried surface, and all of an unchanged linkage. Throws INTERNAL if a part that is left out is not
 * here.
 */
export function completed(answer: GetGeometryResponse, known: GetGeometryResponse | null): GetGeometryResponse {
  if (!answer.rest && !answer.linkage && !answer.beams && known?.basisHash === answer.basisHash) return known;
  answer.carriedSurface ??= known?.carriedSurface;
  if (!answer.tets || (answer.basis && answer.knownColumns === 0)) return answer;
  const columns = Number(known?.basis?.shape.at(-1) ?? 0);
  const isSame = !answer.basis && known?.basisHash === answer.basisHash;
  if (!known?.basis || (!isSame && columns !== answer.knownColumns))
    throw new LimberError("INTERNAL", "the server left out a basis that this page does not hold", "basis");
  if (isSame) {
    answer.basis = known.basis;
    return answer;
  }
  const rows = floats(answer.rest).length;
  const values = joined(floats(known.basis), columns, floats(answer.basis), rows);
  answer.basis = fromFloats(values, [rows / 3, 3, values.length / rows]);
  answer.knownColumns = 0;
  return answer;
}
