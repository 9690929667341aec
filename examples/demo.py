#!/usr/bin/env python3
"""Opens the sample flower, drags its top through space and time, and prints how fast the motion follows.

Starts a limberd of its own on 127.0.0.1, whose page shows the flower and lets it be dragged on. In a terminal the page stays
until Ctrl-C. limberd is stopped at the end, also after an error.
"""

import argparse
import contextlib
import pathlib
import signal
import socket
import sys
import time
import webbrowser

import limber
import numpy as np

PATIENCE = 60.0  # for one edit to converge [s]
PAGE_PORT = 8080  # where it is free
MARKS = ".:-=+*#"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="out/demo", help="folder for the frames (default: %(default)s)")
    parser.add_argument("--sample", default="flower", help="scene to edit (default: %(default)s)")
    parser.add_argument("--open", action="store_true", help="open the page in a browser at the end")
    wait = parser.add_mutually_exclusive_group()
    wait.add_argument("--wait", action="store_true", default=None, help="keep the page until Ctrl-C (default: in a terminal)")
    wait.add_argument("--no-wait", dest="wait", action="store_false", help="end when the table is printed")
    arguments = parser.parse_args()
    is_kept = sys.stdin.isatty() and sys.stdout.isatty() if arguments.wait is None else arguments.wait
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the server is stopped then, too
    with limber.launch(transport="tcp", arguments=("--web", page_address())) as server:
        print(f"limberd {server.info().server_version} answers at {server.connection.endpoint}")
        session = run(server, arguments.sample, pathlib.Path(arguments.out))
        fit(server, arguments.sample)
        before_and_after(server, arguments.sample)
        show_page(server, session, arguments.open, is_kept)
    return 0


def page_address() -> str:
    """127.0.0.1:8080, or any free port where that is taken."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", PAGE_PORT))
        except OSError:
            return "127.0.0.1:0"
    return f"127.0.0.1:{PAGE_PORT}"


def show_page(server: limber.Server, session: limber.Session, is_opened: bool, is_kept: bool) -> None:
    """Prints where a person drags on what the demo has dragged so far."""
    info = server.info()
    url = f"{info.web}/?token={info.web_token}&session={session.id}"
    if not is_kept:
        print(f"\nThe page was at {info.web}; --wait keeps it.")
        return
    if not info.web.endswith(f":{PAGE_PORT}"):
        print(f"\nPort {PAGE_PORT} is taken by another program: the page is at another one.")
    try:
        print(f"\nDrag a point of it in a browser:\n\n    {url}\n\nCtrl-C ends limberd and the page.", flush=True)
        if is_opened and not webbrowser.open(url):
            print("No browser could be opened here: open the address yourself.", flush=True)
        while server.process.poll() is None:
            time.sleep(0.5)
    except KeyboardInterrupt:
        print("\ndemo: limberd and its page have ended")
        return
    sys.exit(f"demo: limberd ended by itself: {server.log.strip()}")


def run(server: limber.Server, sample: str, out: pathlib.Path) -> limber.Session:
    scene = server.sample(sample)
    node = scene.constraints[0].nodes[0]  # the point that the sample's own constraints lead
    del scene.constraints[:]
    session = server.open(scene)
    status = session.status()
    model = status.model
    print(f"{sample}: {status.tets} tets, {status.nodes} nodes, {status.frames} frames; model: {model.modes} modes, "
          f"{model.basis_size} basis columns, {model.cubature_size} cubature tets, "
          f"{100 * model.error_mean:.2f} % mean error,\nready after {model.build_s:.2f} s"
          f"{' (from the cache)' if model.from_cache else ''}. Node {node} is dragged.\n")
    rest = session.geometry().rest
    size = float((rest.max(axis=0) - rest.min(axis=0)).max())
    with session.stream() as stream:
        print(f"{'edit':<34}{'ack':>8}{'first':>9}{'final':>9}{'error':>10}{'E forces':>11}{'E constr.':>11}"
              f"{'E total':>11}\n{'':<34}{'[ms]':>8}{'[ms]':>9}{'[ms]':>9}{'[length]':>10}")
        for text, edit in edits(session, node, status.frames, size):
            measure(session, stream, text, edit)
        print(f"\n{stream.missed} stream messages missed\n")
    files = session.export(out, formats=("pvd", "blender"))
    pvd, pc2, obj = (next(file for file in files if file.suffix == ending) for ending in (".pvd", ".pc2", ".obj"))
    print(f"{len(files)} files in {out}:\n"
          f"  {pvd}  ParaView: open it, press Apply, play\n"
          f"  {obj}  Blender: import it with Forward = Y, Up = Z, vertex order kept (Split off); then add a Mesh Cache\n"
          f"  {pc2}  modifier with this file, format PC2, Forward = Y, Up = Z")
    return session


def fit(server: limber.Server, sample: str) -> None:
    """The sample's own constraints, with forces alone and with the material optimised, too."""
    session = server.open(sample=sample, optimise="all")
    session.optimise("motion")
    session.wait()
    print(f"\n{sample} through its own {len(session.constraints())} constraints: forces alone, and with the material\n\n"
          f"{'optimised':<34}{'ack':>8}{'first':>9}{'final':>9}{'error':>10}{'E forces':>11}{'E constr.':>11}"
          f"{'E total':>11}")
    with session.stream() as stream:
        for text, variables in (("and frequencies and damping", "dynamics"), ("forces alone, material reset", "motion"),
                                ("and frequencies, damping and modes", "all")):
            changes = [limber.reset_material(), limber.optimise(variables)]
            measure(session, stream, text, lambda changes=changes: session.edit(changes))
    fitted = session.material()
    print("\nmode  scene [Hz]  fitted [Hz]")
    for k, (mode, own) in enumerate(zip(fitted.modes[:4], fitted.initial), start=1):
        print(f"{k:4}{own.frequency:12.3f}{mode.frequency:13.3f}")


def before_and_after(server: limber.Server, sample: str) -> None:
    """One key by the published form and by the default: where its node is, a character for every so many frames."""
    curves = {}
    for form in ("differences", "sampled"):
        scene = server.sample(sample)
        node = scene.constraints[0].nodes[0]
        del scene.constraints[:]
        scene.dynamics.Clear()
        scene.dynamics.discretisation = limber.bodies.edits.DISCRETISATIONS[form]
        with contextlib.closing(server.open(scene, progress=False)) as session:
            rest = session.geometry().rest
            size = float(np.ptp(rest, axis=0).max())
            session.add(node=node, frame=scene.frames // 2, displacement=(0.2 * size, 0, 0), exact=True)
            session.wait(timeout=PATIENCE)
            frames = session.frames()
            bent = np.linalg.norm(frames[1:-1] - (frames[:-2] + frames[2:]) / 2, axis=2).max() / size
            curves[form] = (frames[:, node, 0] - rest[node, 0]) / size, bent
    print(f"\n{sample}, one key of 0.2 lengths in the middle: where its node is, from the other side (.) to the key (#)\n")
    low, high = min(curve.min() for curve, _ in curves.values()), 0.2
    for form, (curve, bent) in curves.items():
        shown = curve[:: max(1, len(curve) // 64)]
        marks = "".join(MARKS[round(min(1.0, (at - low) / (high - low)) * (len(MARKS) - 1))] for at in shown)
        print(f"  {'published' if form == 'differences' else 'default':<10}{marks}\n{'':<12}"
              f"{-curve.min():.3f} lengths to the other side, a node up to {bent:.3f} off the mean of its neighbour frames")


def edits(session: limber.Session, node: int, frames: int, size: float):
    """A few gestures at the top of the body: what each is, and the function that sends it."""
    def at(share):
        return round(share * (frames - 1))

    held = {}

    def add(name, share, **what):
        def send():
            held[name] = session.add(node=node, frame=at(share), **what)
        return send

    def target(x, y, z):
        return (x * size, y * size, z * size)

    yield f"add: frame {at(0.2)}, to the right", add("a", 0.2, displacement=target(0.2, -0.03, 0))
    yield f"add: frame {at(0.4)}, to the left", add("b", 0.4, displacement=target(-0.2, -0.03, 0))
    yield f"add: frame {at(0.6)}, forward", add("c", 0.6, displacement=target(0, -0.03, 0.2))
    for step in range(1, 5):
        yield (f"drag frame {at(0.2)} further ({step} of 4)",
               lambda step=step: held["a"].move(target(0.2 + 0.04 * step, -0.03 - 0.02 * step, 0.05 * step)))
    yield f"add: frame {at(0.75)}, only z, exactly", add("d", 0.75, displacement=target(0, 0, -0.15), axes="z",
                                                         exact=True)
    yield "let the last frame go", lambda: session.ends("position_velocity", "free")
    yield "undo that", session.undo
    yield f"remove frame {at(0.4)}", lambda: held["b"].remove()


def measure(session: limber.Session, stream: limber.FrameStream, text: str, edit) -> None:
    """Sends one edit and times, as a client sees them, its acknowledgement, the first frames that contain it and the
    final ones."""
    start = time.monotonic()
    edit()
    acknowledged = time.monotonic()
    first = None
    while True:
        frames = stream.next(PATIENCE)
        if frames.result.revision < session.revision:
            continue
        first = first or frames.received
        if frames.result.final:
            break
    result = frames.result
    print(f"{text:<34}{1e3 * (acknowledged - start):8.2f}{1e3 * (first - start):9.2f}"
          f"{1e3 * (frames.received - start):9.2f}{result.max_error:10.2e}{result.force_energy:11.3e}"
          f"{result.constraint_energy:11.3e}{result.energy:11.3e}{'' if result.status == 'CONVERGED' else '  ' + result.status}",
          flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except limber.LimberError as error:
        sys.exit(f"demo: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
