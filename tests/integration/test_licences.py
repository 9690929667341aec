"""NOTICE.md names what is linked, and programs say which licence they are under."""

import pathlib
import re
import subprocess

from limber import launching

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOTICE = (ROOT / "NOTICE.md").read_text()


def linked(program):
    return subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout


def test_the_notice_names_every_library_that_is_installed():
    packages = [line.split()[0] for line in (ROOT / "packages.debian.txt").read_text().splitlines()
                if re.match(r"lib|zlib|cppzmq|nlohmann|prometheus|python3-", line)]
    assert len(packages) > 15
    assert not [name for name in packages if name not in NOTICE]


def test_clients_link_no_part_of_cholmod():
    assert "libzmq" in linked(launching.find_binary("limber"))
    for library in "cholmod", "openblas", "metis", "prometheus", "systemd":
        assert library not in linked(launching.find_binary("limber"))


def test_what_only_the_server_needs_is_said_to_be_its():
    for library, package in ("libprometheus-cpp-core", "prometheus-cpp-dev"), ("libsystemd", "libsystemd-dev"):
        assert library in linked(launching.find_binary("limberd"))
        row, = [line for line in NOTICE.splitlines() if package in line]
        assert "`limberd`" in row


def test_limberd_says_which_licence_it_is_under():
    program = launching.find_binary("limberd")
    printed = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if "libcholmod" in linked(program):
        assert "GNU General Public License, version 3 or later" in printed
    else:
        assert "GPL, and so" not in printed and "Under the Apache License 2.0" in printed


def test_the_citation_names_this_version():
    citation = (ROOT / "CITATION.cff").read_text()
    version, = re.findall(r"^version: (\S+)$", citation, re.MULTILINE)
    assert f'version = "{version}"' in (ROOT / "clients" / "python" / "pyproject.toml").read_text()
    assert f"VERSION {version}" in (ROOT / "CMakeLists.txt").read_text()
    assert "license: Apache-2.0" in citation
