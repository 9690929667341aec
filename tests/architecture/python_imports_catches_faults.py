#!/usr/bin/env python3
"""The check of Python imports must be able to fail: a small package with one fault of each kind."""

import pathlib
import sys
import tempfile

import python_imports

TYPING = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    "
# Modules below limber/: their text, and what is said of it.
FAULTS = {
    "beams/a.py": ("from ..bodies import session\n", "beams/a.py: beams must not import limber.bodies.session"),
    "beams/b.py": ("from ..bodies.session import Session\n", "beams/b.py: beams must not import limber.bodies.session"),
    "beams/c.py": ("import limber.bodies.session\n", "beams/c.py: beams must not import limber.bodies.session"),
    "beams/d.py": (TYPING + "from ..bodies.session import Session\n", "beams/d.py: beams must not import limber.bodies"),
    "beams/e.py": ("def f():\n    from limber import bodies\n", "beams/e.py: beams must not import limber.bodies"),
    "bodies/f.py": ("from .. import kinds\n", "bodies/f.py: the registry is for limber.server alone"),
    "bodies/g.py": ("from ..server import Server\n", "bodies/g.py: bodies must not import limber.server, which"),
    "linkages/h.py": ("def f():\n    import limber\n", "linkages/h.py: linkages must not import limber, which"),
    "i.py": ("from .beams import edits\n", "i.py: what all kinds share must not import limber.beams.edits"),
    "j.py": ("from . import beams\n", "j.py: what all kinds share must not import limber.beams"),
    "k.py": (TYPING + "from .bodies.session import Session\n", "k.py: what all kinds share must not import limber.bodies"),
    "l.py": ("from .kinds import Requests\n", "l.py: the registry is for limber.server alone"),
    "m.py": ('if scene.HasField("beams"):\n    pass\n', 'm.py: asks for a kind: HasField("beams")'),
    "beams/n.py": ("scene.HasField('linkage')\n", "n.py: asks for a kind: HasField('linkage')"),
    "o.py": ("from . import p\n", "import cycle through limber.o"),
    "p.py": ("from .q import r\n", "import cycle through limber.p"),
    "q/__init__.py": ("", "packages and folders differ: limber.q"),
    "q/r.py": ("from ..o import s\n", "import cycle through limber.q.r"),
}
ALLOWED = {
    "__init__.py": "from .beams import edits\nfrom .server import Server\n",
    "kinds.py": "from .beams.kind import Beams\nfrom .bodies import session\n",
    "server.py": "from .kinds import Requests\n",
    "kind.py": TYPING + "from .server import Server\n",
    "beams/__init__.py": "", "bodies/__init__.py": "", "linkages/__init__.py": "",
    "beams/edits.py": "from ..kind import Kind\nfrom . import kind\nfrom ..v1 import scene_pb2\n",
    "beams/kind.py": 'import limberlost\nscene.HasField("beams")\n',
    "bodies/session.py": TYPING + "from ..server import Server\n",
}


def write(package: pathlib.Path, files: "dict[str, str]") -> None:
    for path, text in files.items():
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(text)


with tempfile.TemporaryDirectory() as folder:
    root = pathlib.Path(folder)
    package = root / python_imports.PACKAGE
    write(package, ALLOWED)
    (package.parent / "pyproject.toml").write_text(
        'packages = ["limber", "limber.beams", "limber.bodies",\n            "limber.linkages", "limber.v1"]\n')
    assert python_imports.check(root) == [], python_imports.check(root)
    write(package, {path: text for path, (text, _) in FAULTS.items()})
    found = "\n".join(python_imports.check(root))
    for path, (_, expected) in FAULTS.items():
        if expected not in found:
            sys.exit(f"not caught: {path}: {expected}\n{found}")
print("every fault is caught")
