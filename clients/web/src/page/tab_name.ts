const TAB_KEY = "limber-tab";

/** How long to wait for a name, which a page that is loaded anew has held until then [ms]. */
const WAIT_MS = 300;

let name = "";

/** Name of this tab, until the user gives it another: by names the server knows whose edits Ctrl+Z undoes. */
export function nameOfTab(): string {
  return name;
}

/**
 * Finds the name of this tab: the one that it had before, or a random one. A duplicated tab copies stored values;
 * therefore the name is locked as long as the page lives. Call it once, before nameOfTab().
 */
export async function claimTabName(): Promise<void> {
  const before = storedName();
  if (before && (await lock(before))) {
    name = before;
    return;
  }
  const bytes = crypto.getRandomValues(new Uint8Array(4));
  name = `page-${Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("")}`;
  await lock(name);
  try {
    sessionStorage.setItem(TAB_KEY, name);
  } catch {
    // It is used until the page is loaded anew.
  }
}

function storedName(): string {
  try {
    return sessionStorage.getItem(TAB_KEY) ?? "";
  } catch {
    return ""; // A browser may refuse to store anything.
  }
}

/** False: another page of this browser has it. True without a secure context, in which there are no locks. */
function lock(wanted: string): Promise<boolean> {
  if (!navigator.locks) return Promise.resolve(true);
  const signal = AbortSignal.timeout(WAIT_MS);
  return new Promise((resolve) => {
    const hold = (): Promise<never> => {
      resolve(true);
      return new Promise(() => undefined);
    };
    navigator.locks.request(`${TAB_KEY}:${wanted}`, { signal }, hold).catch(() => resolve(!signal.aborted));
  });
}
