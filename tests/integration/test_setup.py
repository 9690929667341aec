"""What scripts/setup installs leaves room for what people install beside it."""

import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def listed():
    lines = (ROOT / "packages.debian.txt").read_text().splitlines()
    return [line.split()[0] for line in lines if line.strip() and not line.startswith("#")]


def simulated(packages):
    return subprocess.run(
        ["apt-get", "install", "-s", "--no-install-recommends", *packages], capture_output=True, text=True
    )


def test_scipy_can_be_installed_after_setup():
    """A Boost that excludes Debian's default one excludes what depends on that (python3-scipy, for one)."""
    if shutil.which("apt-get") is None:
        pytest.skip("no apt-get here")
    if simulated(["python3-scipy", "libboost1.81-dev-"]).returncode != 0:
        pytest.skip("python3-scipy is not to be had here, with or without limber's packages")
    # npm is left out where Node.js does not come from Debian; a Boost of an earlier list may be installed.
    packages = [name for name in listed() if name != "npm"]
    answer = simulated([*packages, "python3-scipy", *([] if "libboost1.81-dev" in packages else ["libboost1.81-dev-"])])
    assert answer.returncode == 0, answer.stderr + answer.stdout[-2000:]
