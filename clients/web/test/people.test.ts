import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { SessionClientSchema, SessionRevisionSchema } from "../gen/limber/v1/presence_pb";
import { authors, describeClient, describeRevision, duration } from "../src/session/people";

const made = (revision: bigint, first: bigint, client: bigint, name: string, ...edits: string[]) =>
  create(SessionRevisionSchema, { revision, first, client, name, edits, ageS: 5 });

test("clients and revisions are told by name, this page as such", () => {
  const ana = create(SessionClientSchema, { client: 3n, name: "ana", presentS: 300, lastRevision: 7n });
  assert.equal(describeClient(ana, 1n), "ana, here for 5 min, made revision 7");
  assert.match(describeClient(ana, 3n), /^ana \(this page\), here/);
  assert.equal(
    describeRevision(made(7n, 4n, 3n, "ana", "add", "set_gravity"), 1n),
    "revisions 4 to 7: ana added a constraint, set gravity, 5 s ago",
  );
  assert.equal(describeRevision(made(8n, 8n, 3n, "ana", "new_edit"), 3n), "revision 8: this page new edit, 5 s ago");
  assert.equal(describeRevision(made(0n, 0n, 3n, "ana", "open_session"), 1n), "ana opened the session, 5 s ago");
  assert.deepEqual([duration(119), duration(121), duration(7201)], ["119 s", "2 min", "2 h"]);
});

test("authors of revisions are those of others, once", () => {
  const all = [made(9n, 8n, 1n, "me", "move"), made(7n, 5n, 2n, "ana", "move"), made(4n, 4n, 3n, "ben", "undo")];
  assert.deepEqual(authors(all, 5n, 9n, 1n), ["ana"]);
  assert.deepEqual(authors(all, 4n, 5n, 1n), ["ana", "ben"]);
  assert.deepEqual(authors(all, 1n, 3n, 1n), []);
});
