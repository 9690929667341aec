"""limberd --config, --print-config, --check-config, and the example in packaging/."""

import re
import subprocess

import pytest
from conftest import ROOT

EXAMPLE = ROOT / "packaging" / "limberd.toml"


def run(limberd, *arguments):
    """Without an environment: defaults that depend on nobody's home."""
    return subprocess.run([str(limberd), *map(str, arguments)], env={}, capture_output=True, text=True, timeout=30)


def printed(limberd, *arguments):
    process = run(limberd, *arguments, "--print-config")
    assert process.returncode == 0, process.stderr
    return process.stdout


def values(text):
    """All options, those at their defaults too."""
    lines = [line for line in text.splitlines() if " = " in line and not line.startswith("# ")]
    return dict(line.lstrip("#").split(" = ", 1) for line in lines)


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "limberd.toml"
        path.write_text(text)
        return path
    return write


def test_the_example_is_what_the_defaults_are(limberd):
    assert printed(limberd) == EXAMPLE.read_text(), "make it anew: env -i limberd --print-config > packaging/limberd.toml"


def test_every_option_of_the_help_is_in_the_example(limberd):
    text = run(limberd, "--help").stdout
    names = set(re.findall(r"^ +(?:-\w,)?--([a-z-]+)", text, re.MULTILINE))
    assert len(names) > 40
    assert names - set(values(EXAMPLE.read_text())) == {"config", "check-config", "print-config", "help", "version"}


def test_the_file_wins_over_defaults_and_the_command_line_over_the_file(limberd, write):
    path = write('max-jobs = 3\nbind = "tcp://127.0.0.1:9999"  # a comment\nweb = true\nmesh-root = ["/tmp", \'/usr\',]\n'
                 'data-outlives = "process"\nallow-shutdown = true\nmax-tets = 1_000\nretain = 1.5\n')
    before, after = values(printed(limberd)), values(printed(limberd, "--config", path, "--max-jobs", 5))
    changed = {name: value for name, value in after.items() if before[name] != value}
    assert changed == {"max-jobs": "5", "bind": '"tcp://127.0.0.1:9999"', "web": "true", "mesh-root": '["/tmp", "/usr"]',
                       "data-outlives": '"process"', "allow-shutdown": "true", "max-tets": "1000", "retain": "1.5"}


def test_what_is_printed_is_read_as_the_same(limberd, write, tmp_path):
    strange = tmp_path / 'a "b" \\ #c = d'
    strange.mkdir()
    text = printed(limberd, "--mesh-root", strange, "--mesh-root", "/tmp", "--web", "127.0.0.1:8000", "--no-cache",
                   "--data", tmp_path / "data", "--data-bytes", "5 MB", "--retain", ".5", "--log-level", "DEBUG",
                   "--ready-file", tmp_path / "ready", "--web-token-file", tmp_path / "token")
    assert printed(limberd, "--config", write(text)) == text
    text = printed(limberd, "--web")  # its address is the usual one
    assert printed(limberd, "--config", write(text)) == text and run(limberd, "--config", write(text), "--check-config").returncode == 0
    # Every default, written out as a value, is itself.
    whole = "".join(line.lstrip("#") + "\n" for line in text.splitlines() if " = " in line and not line.startswith("# "))
    assert values(printed(limberd, "--config", write(whole))) == values(text)


@pytest.mark.parametrize("text, words", [
    ("threds = 3\n", "limberd.toml:1: there is no option 'threds'"),
    ('bind = "tcp://127.0.0.1:9999"\nstream = "tcp://127.0.0.1:9999"\n', "--stream: tcp://127.0.0.1:9999 is the address of --bind, too"),
    ('data = "kept"\ndata-bytes = 10\n', "--data-bytes: 10 bytes hold no session"),
    ("web = '19103'\n", "--web: '19103' is not ADDRESS:PORT, as 127.0.0.1:8080 is"),
    ("\n# x\nmax-jobs = 1\nmax-jobs = 2\n", "limberd.toml:4: 'max-jobs' comes twice"),
    ("[limits]\nmax-jobs = 1\n", "limberd.toml:1: there are no tables"),
    ("max-jobs 1\n", "limberd.toml:1: after 'max-jobs' comes ="),
    ("bind = tcp://127.0.0.1:1\n", "limberd.toml:1: a value is a number, true, false, or text in quotes"),
    ('bind = "tcp://127.0.0.1:1\n', "limberd.toml:1: a quote is not closed"),
    ('bind = "a" "b"\n', "limberd.toml:1: nothing may stand behind a value"),
    ("max-jobs = [1, 2]\n", "limberd.toml:1: 'max-jobs' has one value"),
    ('mesh-root = ["/tmp" "/usr"]\n', "limberd.toml:1: between the values of an array"),
    ("config = 'x'\n", "limberd.toml:1: there is no option 'config'"),
    ('max-jobs = "many"\n', "--max-jobs"),
    ("max-jobs = -1\n", "--max-jobs"),
    ("max-jobs = 0\n", "--max-jobs: must be > 0"),
    ("max-tets = -3\n", "--max-tets: -3 is not a whole number"),
    ("max-memory-bytes = 99999999999999999999\n", "--max-memory-bytes: 99999999999999999999 is not a whole number"),
    ("retain = -1\n", "--retain"),
    ("# " + "x" * (1 << 20), "more than 1048576 bytes are no configuration"),
    ('log-level = "loud"\n', "--log-level"),
    ('data-outlives = "fire"\n', "--data-outlives"),
    ("drain-seconds = -1\n", "--drain-seconds: must be in [0, 86400]"),
    ('bind = "tcp://0.0.0.0:7801"\n', "--bind: tcp://0.0.0.0:7801 reaches beyond this machine"),
    ('web-host = ["a"]\n', "--web-host: is for a limberd with --web"),
    ('web = "0.0.0.0:80"\n', "--web-beyond-loopback"),
    ('mesh-root = ["/does/not/exist"]\n', "--mesh-root: /does/not/exist is no folder"),
    ("curve-secret-file = '/none'\n", "--curve-secret-file and --curve-allow go together"),
    ("curve-secret-file = '/none'\ncurve-allow = '/none'\n", "/none"),
    ("web = true\nweb-token-file = '/none'\n", "/none"),
])
def test_what_is_wrong_is_said_and_nothing_is_started(limberd, write, tmp_path, text, words):
    process = run(limberd, "--config", write(text), "--check-config", "--ready-file", tmp_path / "ready")
    assert process.returncode == 2 and words in process.stderr, process
    assert "sound" not in process.stdout and not (tmp_path / "ready").exists()


def test_sound_options_are_said_to_be_so_and_nothing_is_started(limberd, write, tmp_path):
    process = run(limberd, "--config", write("max-jobs = 2\n"), "--check-config", "--data", tmp_path / "data")
    assert (process.returncode, process.stdout) == (0, "limberd: the options are sound\n")
    assert not (tmp_path / "data").exists()
    assert run(limberd, "--config", EXAMPLE, "--check-config").returncode == 0
    # Ports that the system chooses are two.
    assert run(limberd, "--bind", "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0", "--check-config").returncode == 0


def test_a_byte_order_mark_is_passed_over(limberd, write):
    assert values(printed(limberd, "--config", write("\ufeffmax-jobs = 3\n")))["max-jobs"] == "3"


def test_a_file_that_is_not_there_is_an_error(limberd, tmp_path):
    process = run(limberd, "--config", tmp_path / "none.toml", "--check-config")
    assert process.returncode == 2 and "none.toml" in process.stderr


def test_a_server_runs_by_its_file(launch, write):
    server = launch("--config", str(write("max-sessions = 3\nallow-shutdown = true\nweb = '127.0.0.1:0'\n")))
    info = server.info()
    assert info.limits.sessions == 3 and info.web.startswith("http://127.0.0.1:")
