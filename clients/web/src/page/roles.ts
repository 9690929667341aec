import { Role } from "../../gen/limber/v1/access_pb";
import type { Connection } from "../wire/connection";
import { LimberError } from "../wire/errors";

/** Text after "connected" on a page without all permissions. */
export function roleInWords(role: Role): string {
  return role === Role.VIEW ? "to look only" : "";
}

/** Role of this page; UNSPECIFIED if it cannot be determined now. */
export async function askRole(connection: Connection): Promise<Role> {
  try {
    return (await connection.call("getServerInfo", {})).role;
  } catch (error) {
    // The server has another protocol: every other request would be refused as well.
    if (error instanceof LimberError && error.code === "UNSUPPORTED") throw error;
    return Role.UNSPECIFIED;
  }
}
