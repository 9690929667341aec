import { type DescMessage, type MessageShape, toJsonString } from "@bufbuild/protobuf";
import { BeamLoadSchema, BeamMotionSchema, BeamSupportSchema } from "../../gen/limber/v1/beam_structure_pb";
import {
  ConstraintSchema,
  JointAngleSchema,
  JointLoadSchema,
  JointPinSchema,
  KeyframeSchema,
  LinkageTargetSchema,
  type Scene,
} from "../../gen/limber/v1/scene_pb";

const MOST = 6;

/** Added, removed and changed items in a list of things with a number of their own. */
function compare<D extends DescMessage>(
  name: string,
  schema: D,
  before: readonly MessageShape<D>[] | undefined,
  after: readonly MessageShape<D>[] | undefined,
  key: (one: MessageShape<D>) => string,
): string[] {
  const text = (all: readonly MessageShape<D>[] | undefined): Map<string, string> =>
    new Map((all ?? []).map((one) => [key(one), toJsonString(schema, one)]));
  const [old, now] = [text(before), text(after)];
  const added = [...now.keys()].filter((one) => !old.has(one)).map((one) => `${name} ${one} added`);
  const removed = [...old.keys()].filter((one) => !now.has(one)).map((one) => `${name} ${one} removed`);
  const changed = [...now]
    .filter(([one, json]) => old.has(one) && old.get(one) !== json)
    .map(([one]) => `${name} ${one} changed`);
  return [...added, ...removed, ...changed];
}

/** Differences between two scenes of one session, in words; empty: none that this page knows of. */
export function describeChanges(before: Scene, after: Scene): string[] {
  const [old, now] = [before.linkage?.conditions, after.linkage?.conditions];
  const [was, is] = [before.beams?.structure, after.beams?.structure];
  const joint = (one: { joint: number }): string => String(one.joint);
  const node = (one: { node: number }): string => String(one.node);
  const id = (one: { id: bigint }): string => String(one.id);
  const found = [
    ...compare("constraint", ConstraintSchema, before.constraints, after.constraints, id),
    ...compare("keyframe", KeyframeSchema, before.keyframes, after.keyframes, id),
    ...compare("pin of joint", JointPinSchema, old?.pins, now?.pins, joint),
    ...compare("angle of joint", JointAngleSchema, old?.angles, now?.angles, joint),
    ...compare("load of joint", JointLoadSchema, old?.loads, now?.loads, joint),
    ...compare("spring", LinkageTargetSchema, old?.targets, now?.targets, id),
    ...compare("support of node", BeamSupportSchema, was?.supports, is?.supports, node),
    ...compare("motion of node", BeamMotionSchema, was?.motions, is?.motions, node),
    ...compare("load of node", BeamLoadSchema, was?.loads, is?.loads, node),
  ];
  if (old?.meanAngleDegrees !== now?.meanAngleDegrees) found.push("mean opening angle changed");
  if (String(old?.segmentLengths) !== String(now?.segmentLengths)) found.push("rest lengths changed");
  return found.length > MOST ? [...found.slice(0, MOST), `and ${found.length - MOST} more`] : found;
}
