"""The page of a session, in a browser or in a notebook."""

from __future__ import annotations

import atexit
import html
import os
import sys
import tempfile
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from . import checks
from .errors import LimberError

if TYPE_CHECKING:
    from .open_session import OpenSession


@dataclass(frozen=True)
class SessionPage:
    """Address where a session is viewed and edited. A notebook shows it as an IFrame."""

    url: str                # with the token, which admits everyone that knows it
    height: int = 600       # of the IFrame [pixel]

    def _repr_html_(self) -> str:
        return (f'<iframe src="{html.escape(self.url)}" width="100%" height="{self.height}" style="border: 0" '
                f'title="limber"></iframe>')

    def __repr__(self) -> str:
        return "SessionPage(...)"  # the token stays out of logs and saved notebooks

    def open(self) -> bool:
        """In a browser; whether there is one."""
        return webbrowser.open(_redirection(self.url).as_uri())


def page_of(session: "OpenSession", height: int) -> SessionPage:
    """raises LimberError: the session does not exist any more, or its server has no pages."""
    checks.whole(height, "height")
    name = session.status().session  # which refuses sessions that are closed, or of another run
    info = session.server.info()
    if not info.web or not info.web_token:
        raise LimberError(
            "FAILED_PRECONDITION",
            "this server has no pages: start it with `limberd --web` (limber.launch(web=True) in Python, `limber web` in a "
            "terminal)", "web")
    return SessionPage(f"{_reachable(info.web)}/?token={quote(info.web_token)}#{quote(name, safe='')}", height)


def show(session: "OpenSession", height: int, browser: "bool | None") -> SessionPage:
    """See OpenSession.show()."""
    if browser is not None:
        checks.flag(browser, "browser")
    page = page_of(session, height)
    if (not in_notebook() if browser is None else browser) and not page.open():
        raise LimberError("FAILED_PRECONDITION", "there is no browser here; open the address .url of show(browser=False)",
                          "browser")
    return page


def in_notebook() -> bool:
    """Whether a kernel of a notebook runs this."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


def notebook_origins() -> "list[str]":
    """Origins of the notebook servers of this user that run here: their pages may embed ours."""
    try:
        from jupyter_server.serverapp import list_running_servers  # type: ignore[import-not-found]
    except ImportError:
        return []
    origins = set()
    for server in list_running_servers():
        scheme, _, rest = server["url"].partition("://")
        place = rest.split("/")[0]
        origins.add(f"{scheme}://{place}")
        if place.startswith(("localhost:", "127.0.0.1:")):
            port = place.rpartition(":")[2]
            origins |= {f"{scheme}://localhost:{port}", f"{scheme}://127.0.0.1:{port}"}
    return sorted(origins)


def _reachable(url: str) -> str:
    """Address for a browser on this machine of a server that is bound to all addresses."""
    return url.replace("://0.0.0.0:", "://127.0.0.1:").replace("://[::]:", "://[::1]:")


def _redirection(url: str) -> Path:
    """A file that leads to the address. Other users of this machine could read the token from a command line."""
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "limber"
    try:
        state.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        state = Path(tempfile.gettempdir())
    handle, name = tempfile.mkstemp(prefix="show-", suffix=".html", dir=state)  # of this user alone
    with os.fdopen(handle, "w", encoding="utf-8") as out:
        out.write(f'<!doctype html><meta charset="utf-8"><title>limber</title>'
                  f'<meta http-equiv="refresh" content="0; url={html.escape(url)}">')
    path = Path(name)
    atexit.register(lambda: path.unlink(missing_ok=True))
    return path
