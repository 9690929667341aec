"""What the README and the demo promise, run as it is written."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request

import pytest
from conftest import ROOT


def python_blocks(path):
    return re.findall(r"^```python\n(.*?)^```", path.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def run(arguments, folder, cache_dir, timeout):
    environment = dict(os.environ, XDG_CACHE_HOME=str(cache_dir))
    return subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True,
                          timeout=timeout)


@pytest.mark.timeout(150)
def test_readme_example_runs_as_written(limberd, cache_dir, tmp_path):
    example, = python_blocks(ROOT / "README.md")
    assert len(example.rstrip().splitlines()) <= 20
    (tmp_path / "example.py").write_text(example)
    process = run(["example.py"], tmp_path, cache_dir, 140)
    assert process.returncode == 0, process.stderr
    assert "energy" in process.stdout
    assert list(tmp_path.rglob("*.pvd")) and list(tmp_path.rglob("*.pc2"))


def shell_block(path, heading):
    """The indented lines below a heading, as a person would paste them."""
    text = path.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return "".join(line[4:] + "\n" for line in text.splitlines() if line.startswith("    "))


@pytest.mark.timeout(150)
def test_readme_shell_block_runs_as_written(limberd, cache_dir, tmp_path):
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "release").mkdir()
    (tmp_path / "build" / "release" / "bin").symlink_to(limberd.parent)
    # An endpoint of the test's own: the default one may be somebody's.
    environment = dict(os.environ, XDG_CACHE_HOME=str(cache_dir), XDG_STATE_HOME=str(tmp_path / "state"),
                       LIMBER_ENDPOINT=f"ipc://{tmp_path}/requests")
    block = shell_block(ROOT / "README.md", "From a shell")
    assert block.splitlines()[-1] == "limber stop"
    try:
        process = subprocess.run(["bash", "-e", "-c", block], cwd=tmp_path, env=environment, capture_output=True,
                                 text=True, timeout=140)
    finally:
        subprocess.run([limberd.parent / "limber", "stop"], env=environment, capture_output=True, timeout=30)
    assert process.returncode == 0, process.stderr + process.stdout
    assert re.search(r"^status +converged, final$", process.stdout, re.MULTILINE), process.stdout
    assert float(re.search(r"^constraint error +(\S+) at most", process.stdout, re.MULTILINE)[1]) < 0.01
    assert "warning" not in process.stderr
    assert (tmp_path / "out/motion/motion.pvd").is_file() and (tmp_path / "out/motion/motion_surface.pc2").is_file()


@pytest.mark.timeout(150)
def test_demo_prints_its_table_and_leaves_frames(limberd, cache_dir, tmp_path):
    process = run([str(ROOT / "examples" / "demo.py"), "--out", str(tmp_path / "out")], tmp_path, cache_dir, 140)
    assert process.returncode == 0, process.stderr + process.stdout
    rows = re.findall(r"^(.{34})((?: +[\d.e+-]+){7})", process.stdout, re.MULTILINE)
    assert len(rows) >= 10, process.stdout
    for _, numbers in rows:
        acknowledged, first, final, error, forces, constraints, total = map(float, numbers.split())
        # Not in an order: frames are timed when they arrive, the acknowledgement when the caller continues.
        assert 0 < acknowledged and 0 < first <= final and error >= 0
        assert total == pytest.approx(forces + constraints, rel=6e-3)  # three digits of each are printed
    before, after = (float(number) for number in re.findall(r"a node up to (\S+) off", process.stdout))
    assert after < 0.02 < before, "one motion before and after"
    assert (tmp_path / "out/motion.pvd").is_file() and (tmp_path / "out/motion_surface.pc2").is_file()
    assert not list(left_behind(tmp_path))


@pytest.mark.timeout(150)
def test_demo_keeps_its_page_until_it_is_interrupted(limberd, cache_dir, tmp_path):
    with subprocess.Popen([sys.executable, ROOT / "examples" / "demo.py", "--out", tmp_path / "out", "--wait"], cwd=tmp_path,
                          env=dict(os.environ, XDG_CACHE_HOME=str(cache_dir)), stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as demo:
        try:
            for line in demo.stdout:
                if found := re.search(r"^ +(http://127\.0\.0\.1:\d+)/\?token=([0-9a-f]{32})&session=\S+$", line):
                    break
            else:
                pytest.fail(demo.stderr.read())
            with urllib.request.urlopen(found[1]) as answer:
                assert answer.status == 200
            with pytest.raises(urllib.error.HTTPError) as refused:  # with a wrong token: 401
                urllib.request.urlopen(f"{found[1]}/v1/requests?token={found[2]}")
            assert refused.value.code == 426
            demo.send_signal(signal.SIGINT)
            rest, errors = demo.communicate(timeout=30)
        finally:
            demo.kill()
    assert (demo.returncode, errors) == (0, "") and "have ended" in rest
    assert not list(left_behind(tmp_path))


def left_behind(folder):
    """Processes that still work in the folder."""
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if pathlib.Path(os.readlink(entry / "cwd")) == folder:
                yield entry.name
        except OSError:
            continue


def test_guide_names_every_command():
    from test_cli import COMMANDS
    guide = (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")
    assert [command for command in COMMANDS if f"`limber {command}" not in guide] == []
