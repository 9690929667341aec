"""`python3 -m limber`: commands without C++, in addition to the command line `limber`."""

from __future__ import annotations

import argparse
import signal
import sys
import threading

from . import connect
from .errors import LimberError, ServerUnreachable
from .laths import UNITS
from .saving import TOLERANCE

DESCRIPTION = "Files that the Python client makes; everything else is done by the command `limber`."


def main(arguments: "list[str] | None" = None) -> int:
    """The exit codes of the command `limber`: 0 done, 1 refused, 2 wrong command line, 3 no server answers."""
    parser = argparse.ArgumentParser("python3 -m limber", description=DESCRIPTION)
    parser.add_argument("--endpoint", help="of limberd ($LIMBER_ENDPOINT, tcp://127.0.0.1:7801)")
    commands = parser.add_subparsers(dest="command", required=True)
    _add_laths(commands.add_parser("laths", help="what is to be cut of a linkage or a structure of beams",
                                   description="Which laths a linkage or a structure of beams is made of, with their holes."))
    _add_save(commands.add_parser("save", help="a motion as .glb, .mdd, .pc2 or .csv"))
    _add_picture(commands.add_parser("picture", help="a .png, .svg or .pdf, coloured by stress, strain, displacement"))
    _add_html(commands.add_parser("html", help="a motion and its player in one .html, which needs no server"))
    _add_render(commands.add_parser("render", help="a .png, .mp4 or .gif as the page draws it, without a display",
                                    description="Draws a session as the page does, without a display. Needs Chromium, and for "
                                                "films ffmpeg."))
    _add_record(commands.add_parser("record", help="what clients and the server say to each other, into a file"))
    _add_replay(commands.add_parser("replay", help="a recording's requests again; do the replies differ?"))
    given = parser.parse_args(arguments)
    try:
        with connect(given.endpoint) as server:
            return given.run(server, given) or 0
    except ServerUnreachable as error:
        print(f"limber: {error}", file=sys.stderr)
        return 3
    except LimberError as error:
        print(f"limber: {error}", file=sys.stderr)
        return 1


def _add_laths(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session")
    parser.add_argument("--csv", metavar="FILE", help="a row for each hole; without any file it is printed")
    parser.add_argument("--dxf", metavar="FILE", help="sheets side by side (needs python3-ezdxf)")
    parser.add_argument("--svg", metavar="FILE", help="a drawing for each sheet")
    parser.add_argument("--unit", choices=sorted(UNITS), default="mm", help="of all lengths, given and written (mm)")
    parser.add_argument("--overhang", type=float, help="of laths beyond the middles of their outer holes (1.5 diameters)")
    parser.add_argument("--hole", type=float, help="diameter (a fifth of the narrowest lath's width)")
    parser.add_argument("--sheet", type=float, nargs=2, metavar=("LENGTH", "HEIGHT"), help="as large as it takes by default")
    parser.add_argument("--margin", type=float, default=0.0, help="free at the rim of sheets (0)")
    parser.add_argument("--gap", type=float, default=0.0, help="between what is cut (0)")
    parser.add_argument("--kerf", type=float, default=0.0, help="width of the cut, half of it outside of each outline (0)")
    parser.set_defaults(run=_laths)


def _laths(server: "object", given: argparse.Namespace) -> None:
    session = server.session(given.session)  # type: ignore[attr-defined]
    if not hasattr(session, "laths"):
        raise LimberError("INVALID_ARGUMENT", f"session {given.session} is of an elastic body, which has no laths", "session")
    made = session.laths(given.unit, given.overhang, hole=given.hole)
    layout = {"sheet": given.sheet, "margin": given.margin, "gap": given.gap, "kerf": given.kerf}
    if given.csv:
        print(made.save_csv(given.csv))
    if given.dxf:
        print(made.save_dxf(given.dxf, **layout))
    if given.svg:
        print(*made.save_svg(given.svg, **layout), sep="\n")
    if not (given.csv or given.dxf or given.svg):
        print(made.csv(), end="")


def _add_save(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session")
    parser.add_argument("file")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of .glb, as a share of the size (%(default)g)")
    parser.add_argument("--up", choices=("y", "z"), help="of the scene, for .glb (y of bodies, z of linkages and beams)")
    parser.add_argument("--surface", help="of a body: an .obj that was drawn around its tets and follows them, or 'nodes' for the "
                        "boundary of its tets; by default the surface that it carries, if any")
    parser.set_defaults(run=_save)


def _save(server: "object", given: argparse.Namespace) -> None:
    saved = server.session(given.session).save(given.file, tolerance=given.tolerance, up=given.up,  # type: ignore[attr-defined]
                                               surface=given.surface)
    print(*saved.files, sep="\n")
    if saved.targets:
        print(f"{saved.targets} morph targets, off by at most {saved.error:.3g}", file=sys.stderr)


def _add_picture(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session")
    parser.add_argument("file")
    parser.add_argument("--colour", default="none", help="none, displacement, strain, stress, utilisation: see the guide")
    parser.add_argument("--frame", type=int, default=-1, help="the last one by default")
    parser.add_argument("--view", type=float, nargs=2, default=(-60.0, 25.0), metavar=("AZIMUTH", "ELEVATION"))
    parser.add_argument("--up", choices=("y", "z"), help="of the scene (y of bodies, z of linkages and beams)")
    parser.add_argument("--yield-stress", type=float, help="for the utilisation of linkages [Pa]")
    parser.add_argument("--title", default="")
    parser.set_defaults(run=_picture)


def _picture(server: "object", given: argparse.Namespace) -> None:
    print(server.session(given.session).picture(  # type: ignore[attr-defined]
        given.file, colour=given.colour, frame=given.frame, view=given.view, up=given.up, title=given.title,
        yield_stress=given.yield_stress))


def _add_html(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session")
    parser.add_argument("file")
    _add_played(parser)
    parser.set_defaults(run=_html)


def _add_played(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of bodies, as a share of the size (%(default)g)")
    parser.add_argument("--up", choices=("y", "z"), help="of the scene (y of bodies, z of linkages and beams)")
    parser.add_argument("--rate", type=float, help="frames a second (the scene's; of linkages and beams 24)")
    parser.add_argument("--surface", help="an .obj that was drawn around the tets of a body and follows them")


def _html(server: "object", given: argparse.Namespace) -> None:
    saved = server.session(given.session).save_html(  # type: ignore[attr-defined]
        given.file, tolerance=given.tolerance, up=given.up, frames_per_second=given.rate, surface=given.surface)
    print(*saved.files, sep="\n")


def _add_render(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("session")
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help=".png, .jpg: a frame; .mp4, .webm, .gif: all")
    parser.add_argument("--frame", type=int, default=-1, help="of a picture; the last one by default")
    parser.add_argument("--size", default="1280x720", metavar="WIDTHxHEIGHT", help="pixels (%(default)s)")
    parser.add_argument("--view", type=float, nargs=2, metavar=("AZIMUTH", "ELEVATION"), help="of the eye [degree]")
    _add_played(parser)
    parser.set_defaults(run=_render)


def _render(server: "object", given: argparse.Namespace) -> None:
    width, _, height = given.size.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise LimberError("INVALID_ARGUMENT", f"a size is WIDTHxHEIGHT in pixels, not {given.size}", "size")
    print(server.session(given.session).render(  # type: ignore[attr-defined]
        given.output, frame=given.frame, size=(int(width), int(height)), view=given.view, up=given.up,
        frames_per_second=given.rate, tolerance=given.tolerance, surface=given.surface))


def _add_record(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", help="FILE.limberrec")
    parser.add_argument("--bind", default="tcp://127.0.0.1:*", help="endpoint for the clients that are recorded (%(default)s)")
    parser.set_defaults(run=_record)


def _record(server: "object", given: argparse.Namespace) -> None:
    from .recorder import Recorder
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    about = {"server_version": server.info().server_version}  # type: ignore[attr-defined]
    with Recorder(server.connection.endpoint, given.file, given.bind, **about) as recorder:  # type: ignore[attr-defined]
        print(recorder.endpoint, flush=True)
        stopped.wait()
    print(f"{recorder.messages} messages", file=sys.stderr)


def _add_replay(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file")
    parser.add_argument("--tolerance", type=float, default=1e-3, help="of energies, as a share (%(default)g)")
    parser.add_argument("--wait", type=float, default=60.0, help="for a reply [s] (%(default)g)")
    parser.set_defaults(run=_replay)


def _replay(server: "object", given: argparse.Namespace) -> int:
    from .replaying import replay
    outcome = replay(given.file, server.connection.endpoint, given.tolerance, given.wait)  # type: ignore[attr-defined]
    for difference in outcome.differences:
        print(difference)
    print(f"{outcome.requests} requests, {outcome.replies} replies, {len(outcome.differences)} differences", file=sys.stderr)
    return 1 if outcome.differences else 0


if __name__ == "__main__":
    sys.exit(main())
