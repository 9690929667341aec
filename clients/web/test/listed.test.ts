import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { SessionState, SessionStatusSchema } from "../gen/limber/v1/service_pb";
import { describeSession } from "../src/session/listed";

test("sessions are listed with what they are of, how large, how old, and who is there", () => {
  const flower = create(SessionStatusSchema, {
    session: "s-1",
    name: "flower",
    kind: "bodies",
    tets: 900,
    frames: 240,
    revision: 3n,
    ageS: 300,
    state: SessionState.READY,
    clients: [{ client: 1n }, { client: 2n }],
  });
  assert.equal(
    describeSession(flower),
    's-1: elastic body "flower", 900 tets, 240 frames, revision 3, opened 5 min ago, 2 people here',
  );
  const arch = create(SessionStatusSchema, {
    session: "arch",
    kind: "beams",
    beamNodes: 41,
    beamElements: 40,
    ageS: 9,
  });
  arch.state = SessionState.BUILDING;
  assert.equal(
    describeSession(arch),
    "arch: beam structure, 40 elements, 41 nodes, being built, revision 0, opened 9 s ago",
  );
  const grid = create(SessionStatusSchema, { session: "g", kind: "linkages", segments: 12, joints: 30, clients: [{}] });
  assert.match(describeSession(grid), /rod linkage, 12 rods, 30 joints, .*1 person here/);
});
