import assert from "node:assert/strict";
import { test } from "node:test";
import { fieldInWords, inWords, LimberError } from "../src/wire/errors";

test("fields of messages are told as people say them", () => {
  assert.equal(fieldInWords("scene.mesh.tets[7]"), "tets 7 of mesh");
  assert.equal(fieldInWords("edits[0].add.constraint.frame"), "frame");
  assert.equal(fieldInWords("scene.linkage.conditions.mean_angle_degrees"), "mean angle degrees of conditions");
  for (const nothing of ["", "session", "scene", "edits[3]"]) assert.equal(fieldInWords(nothing), "");
});

test("what a message says itself is not told twice", () => {
  const told = (message: string, field: string): string => inWords(new LimberError("OUT_OF_RANGE", message, field));
  assert.equal(
    told("Frame 900 is outside 0 .. 149.", "edits[0].add.constraint.frame"),
    "Frame 900 is outside 0 .. 149.",
  );
  assert.equal(told("900 is too large", "edits[0].add.constraint.frame"), "900 is too large (frame)");
  assert.equal(told("there is no such session", "session"), "there is no such session");
});

test("a page of another protocol is told to be loaded again", () => {
  const error = new LimberError(
    "UNSUPPORTED",
    "this client speaks protocol 1, this server (2.0) protocol 2: update the client",
    "version",
  );
  assert.match(inWords(error), /update the client\. Reload this page/);
  assert.doesNotMatch(inWords(new LimberError("UNSUPPORTED", "no such thing", "shutdown")), /Reload/);
});

test("what a role lacks is told by the server's words", () => {
  const error = new LimberError(
    "PERMISSION_DENIED",
    "the request edit needs the role edit; this client has the role view",
    "edit",
  );
  assert.equal(inWords(error), error.message);
});
