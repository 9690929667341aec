import "./style.css";
import { App } from "./page/app";
import { claimTabName } from "./page/tab_name";

const TOKEN_KEY = "limber-token";

/** The token of the page's address, which is taken out of the address bar and kept as long as the tab lives. */
function takeToken(): string {
  const query = new URLSearchParams(location.search);
  const given = query.get("token");
  if (given !== null) {
    sessionStorage.setItem(TOKEN_KEY, given);
    query.delete("token");
    const session = query.get("session");
    query.delete("session");
    const hash = session ? `#${encodeURIComponent(session)}` : location.hash;
    const rest = query.size ? `?${query}` : "";
    history.replaceState(null, "", `${location.pathname}${rest}${hash}`);
  }
  return given ?? sessionStorage.getItem(TOKEN_KEY) ?? "";
}

await claimTabName();
const base = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}`;
const app = new App(base, takeToken());

declare global {
  interface Window {
    /** For tests and for people at the console. */
    limber: App;
  }
}
window.limber = app;
