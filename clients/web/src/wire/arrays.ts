import { create } from "@bufbuild/protobuf";
import { type Array as ArrayMessage, ArraySchema, DataType } from "../../gen/limber/v1/common_pb";
import { LimberError } from "./errors";

/** Bytes of a message begin anywhere in its buffer: numbers are copied to where they are aligned. */
function aligned(data: Uint8Array): ArrayBuffer {
  return data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength) as ArrayBuffer;
}

function demand(message: ArrayMessage | undefined, size: number): Uint8Array {
  const data = message?.data ?? new Uint8Array(0);
  const count = message ? message.shape.reduce((product, extent) => product * Number(extent), 1) : 0;
  if (message && count * size !== data.byteLength)
    throw new LimberError("MALFORMED", "an array whose data does not fit its shape");
  return data;
}

/** Numbers of any type as float32. */
export function floats(message: ArrayMessage | undefined): Float32Array {
  if (message?.type === DataType.FLOAT64) return Float32Array.from(new Float64Array(aligned(demand(message, 8))));
  if (message?.type === DataType.INT32) return Float32Array.from(integers(message));
  return new Float32Array(aligned(demand(message, 4)));
}

/** Single precision, or double precision of positions far from the origin. */
export type Reals = Float32Array | Float64Array;

/** Numbers in the precision in which they came. */
export function reals(message: ArrayMessage | undefined): Reals {
  return message?.type === DataType.FLOAT64 ? doubles(message) : floats(message);
}

export function doubles(message: ArrayMessage | undefined): Float64Array {
  if (message?.type === DataType.FLOAT32) return Float64Array.from(floats(message));
  return new Float64Array(aligned(demand(message, 8)));
}

export function integers(message: ArrayMessage | undefined): Int32Array {
  return new Int32Array(aligned(demand(message, 4)));
}

export function fromFloats(values: Float32Array, shape: number[]): ArrayMessage {
  return create(ArraySchema, {
    type: DataType.FLOAT32,
    shape: shape.map(BigInt),
    data: new Uint8Array(values.buffer as ArrayBuffer, values.byteOffset, values.byteLength),
  });
}

export function fromDoubles(values: Float64Array, shape: number[]): ArrayMessage {
  return create(ArraySchema, {
    type: DataType.FLOAT64,
    shape: shape.map(BigInt),
    data: new Uint8Array(values.buffer as ArrayBuffer, values.byteOffset, values.byteLength),
  });
}

export function fromIntegers(values: Int32Array, shape: number[]): ArrayMessage {
  return create(ArraySchema, {
    type: DataType.INT32,
    shape: shape.map(BigInt),
    data: new Uint8Array(values.buffer as ArrayBuffer, values.byteOffset, values.byteLength),
  });
}
