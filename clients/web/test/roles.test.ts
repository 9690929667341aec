import assert from "node:assert/strict";
import { test } from "node:test";
import { Role } from "../gen/limber/v1/access_pb";
import { askRole, roleInWords } from "../src/page/roles";
import type { Connection } from "../src/wire/connection";
import { LimberError } from "../src/wire/errors";

/** A connection whose every answer is this. */
function answering(answer: () => unknown): Connection {
  return { call: async () => answer() } as unknown as Connection;
}

test("a page that may only look says so", async () => {
  assert.equal(await askRole(answering(() => ({ role: Role.VIEW }))), Role.VIEW);
  assert.equal(roleInWords(Role.VIEW), "to look only");
  for (const role of [Role.EDIT, Role.ADMINISTER, Role.UNSPECIFIED]) assert.equal(roleInWords(role), "");
});

test("a server of another protocol is an error, one that does not answer is none", async () => {
  const refusing = (code: string) =>
    answering(() => {
      throw new LimberError(code, "no");
    });
  assert.equal(await askRole(refusing("TIMEOUT")), Role.UNSPECIFIED);
  await assert.rejects(askRole(refusing("UNSUPPORTED")), LimberError);
});
