import { fromBinary } from "@bufbuild/protobuf";
import { BeamStructureSchema } from "../../gen/limber/v1/beam_structure_pb";
import { GetGeometryResponseSchema } from "../../gen/limber/v1/service_pb";
import { BeamShapes } from "../beams/shape";
import { BodySurface } from "../bodies/surface";
import { LinkageShapes } from "../linkages/shape";
import { SweptRods } from "../rods/sweep";
import type { Stage } from "../view/stage";
import { bytes, type StoredMotion, unpack, unpackMessage } from "./data";

/** Puts a frame of a stored motion into the picture. */
export type Show = (frame: number) => void;

/** The figure of a stored motion, drawn as the page draws that of a session. */
export function figureOf(stage: Stage, stored: StoredMotion): Show {
  const numbers = unpack(stored.frames);
  const { columns } = stored.frames;
  const frame = (at: number): Float32Array => numbers.subarray(at * columns, (at + 1) * columns);
  const geometry = fromBinary(GetGeometryResponseSchema, bytes(stored.geometry));
  if (stored.kind === "bodies") {
    const surface = new BodySurface(stage);
    if (stored.basis) geometry.basis = unpackMessage(stored.basis);
    surface.setGeometry(geometry);
    return (at) => surface.show(frame(at));
  }
  const rods = new SweptRods(stage);
  const structure = stored.structure ? fromBinary(BeamStructureSchema, bytes(stored.structure)) : undefined;
  const shapes = stored.kind === "linkages" ? new LinkageShapes(geometry) : new BeamShapes(geometry, structure);
  rods.setStrips(shapes.strips);
  return (at) => rods.show(shapes.shape(frame(at), null), false);
}
