import { create } from "@bufbuild/protobuf";
import { type Array as ArrayMessage, ArraySchema, DataType } from "../../gen/limber/v1/common_pb";

/** Numbers in 16 bits: of each column its least value and its step. */
export interface Packed {
  rows: number;
  columns: number;
  /** base64 of float32, a column each. */
  low: string;
  step: string;
  /** base64 of uint16, row by row. */
  numbers: string;
}

/** A motion as the Python client embeds it. */
export interface StoredMotion {
  version: number;
  kind: "bodies" | "linkages" | "beams";
  title: string;
  up: "y" | "z";
  /** Frames per second. */
  rate: number;
  frameName: string;
  low: [number, number, number];
  high: [number, number, number];
  /** base64 of a GetGeometryResponse; for a body its nodes are the surface's vertices, and the basis is separate. */
  geometry: string;
  basis?: Packed;
  /** base64 of a BeamStructure. */
  structure?: string;
  frames: Packed;
}

export function bytes(base64: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}

export function unpack({ rows, columns, low, step, numbers }: Packed): Float32Array<ArrayBuffer> {
  const [lows, steps] = [new Float32Array(bytes(low).buffer), new Float32Array(bytes(step).buffer)];
  const packed = new Uint16Array(bytes(numbers).buffer);
  if (packed.length !== rows * columns || lows.length !== columns || steps.length !== columns)
    throw new Error("the motion in this file is damaged");
  return Float32Array.from(packed, (value, i) => (lows[i % columns] ?? 0) + (steps[i % columns] ?? 0) * value);
}

/** The same as an array of a message. */
export function unpackMessage(packed: Packed): ArrayMessage {
  return create(ArraySchema, {
    type: DataType.FLOAT32,
    shape: [BigInt(packed.rows), BigInt(packed.columns)],
    data: new Uint8Array(unpack(packed).buffer),
  });
}
