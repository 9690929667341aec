#!/usr/bin/env python3
"""Writes the add-on as one zip for Blender's Preferences > Add-ons > Install, with the Python client in it.

usage: clients/blender/make_zip.py [FILE]    default build/limber_blender.zip; build limber first, which makes the messages
"""

import pathlib
import sys
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
ADDON = ROOT / "clients" / "blender" / "limber_blender"
CLIENT = ROOT / "clients" / "python"


def main() -> int:
    target = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "limber_blender.zip"
    if not (CLIENT / "limber" / "v1" / "service_pb2.py").is_file():
        print("the messages are missing: build limber once (scripts/build)", file=sys.stderr)
        return 1
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as out:
        for file in sorted(ADDON.rglob("*.py")):
            out.write(file, pathlib.Path("limber_blender") / file.relative_to(ADDON))
        for file in sorted((CLIENT / "limber").rglob("*.py")):
            out.write(file, pathlib.Path("limber_blender") / "lib" / file.relative_to(CLIENT))
        out.write(ROOT / "LICENSE", "limber_blender/LICENSE")
    print(target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
