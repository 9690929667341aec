#!/usr/bin/python3
"""How long edits wait for their acknowledgement while the same client fetches long motions without a pause over a slow link.

usage: tests/chaos/slow_link.py [--seconds 15] [--megabits 100] [--whole] [--json FILE]

A relay in front of limberd lets so many megabits a second through to the client. --whole: each motion in one answer, as before
there were parts. Prints one JSON object: acknowledgements [ms] and what was fetched [MB/s]. LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import socket
import sys
import tempfile
import threading
import time
from pathlib import Path

from kills import ROOT  # noqa: F401  (finds limber and its tests)
from reporting import end_with

import limber
import numpy as np
from conftest import small_scene, tip_of
from limber.launching import find_binary
from limber.messages import service
from test_restarts import Restartable

FRAMES = 20_000  # of 63 nodes: 15 MB
PAUSE = 1 / 120  # between edits [s]


class Relay:
    """A port whose connections lead to another one. What comes back is let through so fast and no faster."""

    def __init__(self, port, bytes_per_s):
        self.port, self.bytes_per_s, self.door = port, bytes_per_s, socket.socket()
        self.door.bind(("127.0.0.1", 0))
        self.door.listen()
        self.endpoint = f"tcp://127.0.0.1:{self.door.getsockname()[1]}"
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self.door.accept()
                far = socket.socket()
                # A small buffer: what a link has not taken waits in the server, as it would with a real one.
                far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
                far.connect(("127.0.0.1", self.port))
                threading.Thread(target=self.pump, args=(near, far, None), daemon=True).start()
                threading.Thread(target=self.pump, args=(far, near, self.bytes_per_s), daemon=True).start()

    @staticmethod
    def pump(source, sink, bytes_per_s):
        due = time.monotonic()
        with contextlib.suppress(OSError):
            while data := source.recv(32768):
                sink.sendall(data)
                if bytes_per_s:
                    due = max(due, time.monotonic() - 0.01) + len(data) / bytes_per_s
                    time.sleep(max(0.0, due - time.monotonic()))


def fetched(session, is_whole):
    """@returns bytes of the frames of one motion"""
    if is_whole:
        request = service.GetFramesRequest(session=session.reference, encoding=service.ENCODING_POSITIONS)
        return len(session.connection.call("get_frames", request, timeout=60).frames.data.data)
    return len(session.raw_frames(encoding="positions").data.data)


def run(options):
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        folder = Path(folder)
        running = Restartable(find_binary("limberd"), folder, folder / "cache")
        stack.callback(running.close)
        relay = Relay(int(running.endpoint.rsplit(":", 1)[1]), options.megabits * 1e6 / 8)
        stack.callback(relay.door.close)
        server = stack.enter_context(limber.connect(relay.endpoint, timeout=120))
        long = server.open(small_scene(frames=FRAMES), session="long", progress=False)
        long.wait(timeout=120)
        dragged = server.open(small_scene(), session="dragged", progress=False)
        held = dragged.add(node=tip_of(dragged), frame=20, displacement=(0, 0.05, 0))
        is_over, total, faults = threading.Event(), [0], []

        def fetch():
            try:
                while not is_over.is_set():
                    total[0] += fetched(long, options.whole)
            except limber.LimberError as fault:
                faults.append(str(fault))

        fetcher = threading.Thread(target=fetch)
        fetcher.start()
        begin, acks = time.monotonic(), []
        while time.monotonic() < begin + options.seconds:
            sent = time.perf_counter()
            held.move((0, 0.05 + 1e-4 * (len(acks) % 100), 0))
            acks.append(1e3 * (time.perf_counter() - sent))
            time.sleep(max(0.0, PAUSE - acks[-1] / 1e3))
        is_over.set()
        fetcher.join()
        return {"whole": options.whole, "megabits": options.megabits, "edits": len(acks), "ack_p50_ms": round(float(np.percentile(acks, 50)), 1),
                "ack_p99_ms": round(float(np.percentile(acks, 99)), 1), "fetched_mb_per_s": round(total[0] / 1e6 / (time.monotonic() - begin), 1),
                "faults": faults}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=15)
    parser.add_argument("--megabits", type=float, default=100, help="a second that the link lets through")
    parser.add_argument("--whole", action="store_true", help="motions in one answer each")
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    return end_with(run(options), options.json)


if __name__ == "__main__":
    sys.exit(main())
