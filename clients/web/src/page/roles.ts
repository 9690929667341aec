import { Role } from "../../gen/limber/v1/access_pb";
import type { Connection } from "../wire/connection";
import { LimberError } from "../wire/errors";

/** What stands beside "connected" of a page that may not do everything. */
export function roleInWords(role: Role): string {
  return role === Role.VIEW ? "to look only" : "";
}

/** What this page may do; UNSPECIFIED where it cannot be found out now. */
export async function askRole(connection: Connection): Promise<Role> {
  try {
    return (await connection.call("getServerInfo", {})).role;
  } catch (error) {
    // Of another protocol: every other request would be refused as well.
    if (error instanceof LimberError && error.code === "UNSUPPORTED") throw error;
    return Role.UNSPECIFIED;
  }
}
