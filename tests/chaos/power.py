#!/usr/bin/python3
"""Takes the power from limberd at random moments while clients edit sessions of all kinds, and looks for what it had
acknowledged. disk.c is the disk: of what was not synced it keeps parts, in any order, or nothing.

usage: tests/chaos/power.py [--cuts 100] [--seed 1] [--outlives power|process] [--lying] [--json FILE]

Prints one JSON object: cuts, acknowledged edits, lost ones (0 with `--outlives power`), sessions that are gone (0 then, too),
faults: sessions that come back as they never were, or cannot be read (none with either, unless the disk lies).
--lying: syncs do nothing. LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from kills import Beams, Body, Linkage, work
from reporting import give_out

import limber
from conftest import small_scene
from design_inputs import strip_scene
from limber.launching import find_binary
from test_restarts import Restartable

HERE = Path(__file__).resolve().parent


def build_disk(folder):
    library = Path(folder) / "disk.so"
    subprocess.run([os.environ.get("CC", "cc"), "-O2", "-shared", "-fPIC", HERE / "disk.c", "-o", library, "-ldl", "-lpthread"],
                   check=True)
    return library


class OnDisk(Restartable):
    """A limberd whose --data is on a disk of disk.c."""

    def __init__(self, folder, *arguments, early=50, seed=1, is_lying=False, sync_ms=0):
        self.data, self.image = folder / "data", folder / "image"
        self.full, self.broken = folder / "full", folder / "broken"
        self.data.mkdir(mode=0o700)
        self.image.mkdir(mode=0o700)
        self.settings = {"LD_PRELOAD": build_disk(folder), "DISK_FOLDER": self.data, "DISK_IMAGE": self.image,
                         "DISK_EARLY": early, "DISK_SEED": seed, "DISK_SYNC_MS": sync_ms, "DISK_FULL": self.full, "DISK_BROKEN": self.broken}
        if is_lying:
            self.settings["DISK_IGNORES_SYNC"] = 1
        super().__init__(find_binary("limberd"), folder, folder / "cache", "--data", self.data, *arguments)

    def start(self):
        plain, settings = [str(word) for word in self.command], [f"{name}={value}" for name, value in self.settings.items()]
        self.command = ["/usr/bin/env", *settings, *plain]
        try:
            super().start()
        finally:
            self.command = plain

    def cut(self):
        """Ends the process; the folder has what the disk has. Other choices from here on."""
        self.end(signal.SIGKILL)
        shutil.rmtree(self.data)
        shutil.copytree(self.image, self.data)
        self.settings["DISK_SEED"] += 1


def run(cuts, seed=1, outlives="power", is_lying=False, early=50, longest=0.4):
    numbers = random.Random(seed)
    faults, gone, lost = [], 0, 0
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        disk = OnDisk(Path(folder), "--data-outlives", outlives, early=early, seed=1000 * seed, is_lying=is_lying)
        stack.callback(disk.close)
        server = stack.enter_context(limber.connect(disk.endpoint, timeout=60))
        drags = [Body(server, "body", {"scene": small_scene()}), Linkage(server, "linkage", {"scene": strip_scene()}),
                 Beams(server, "beams", {"sample": "arch"})]
        for cut in range(cuts):
            workers = [threading.Thread(target=work, args=(drag, disk.endpoint, numbers.random())) for drag in drags]
            for worker in workers:
                worker.start()
            time.sleep(numbers.uniform(0.05, longest))
            disk.cut()
            for worker in workers:
                worker.join(60)
            try:
                disk.start()
            except AssertionError:
                faults.append(f"cut {cut}: the server does not start")
                break
            for drag in drags:
                try:
                    session = server.session(drag.name)
                    if drag.check(session):
                        continue
                    missing = drag.go_back(session)
                    if missing is None or missing < 0:
                        faults.append(f"cut {cut}: {drag.name} is as it never was")
                    else:
                        lost += missing
                except limber.LimberError as error:
                    if error.code in ("RESTARTED", "NOT_FOUND"):
                        gone, lost = gone + 1, lost + drag.acknowledged
                    else:
                        faults.append(f"cut {cut}: {drag.name} does not come back: {error}")
            if faults or gone:
                break
        edits = sum(drag.acknowledged for drag in drags)
    return {"cuts": cut + 1, "outlives": outlives, "lying": is_lying, "acknowledged": edits, "lost": lost,
            "gone": gone, "faults": faults}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cuts", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--outlives", choices=("power", "process"), default="power")
    parser.add_argument("--lying", action="store_true", help="a disk whose syncs do nothing")
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    result = run(options.cuts, options.seed, options.outlives, options.lying)
    give_out(result, options.json)
    is_loss = result["lost"] or result["gone"]
    return 1 if result["faults"] or (is_loss and options.outlives == "power") else 0


if __name__ == "__main__":
    sys.exit(main())
