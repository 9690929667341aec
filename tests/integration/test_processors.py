"""Programs end with a sentence on a processor without the instructions that they were built for."""

import subprocess

import pytest
from limber.launching import find_binary

QEMU = "qemu-x86_64"  # of qemu-user, which packages.debian.txt lists


@pytest.mark.parametrize("program", ["limberd", "limber"])
def test_an_old_processor_is_told_what_it_lacks(program):
    run = subprocess.run([QEMU, "-cpu", "Nehalem", find_binary(program), "--version"], capture_output=True, text=True, timeout=60)
    if run.returncode == 0:
        pytest.skip("this build needs no instructions that a Nehalem lacks")
    assert run.returncode == 1 and run.stdout == ""
    assert run.stderr.startswith(f"{program}: this processor lacks instructions that this build needs: ")
    assert "AVX2" in run.stderr and "LIMBER_ARCH" in run.stderr
