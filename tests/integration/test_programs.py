"""limber-bench and scripts/build: what they say before they do anything; rows of a benchmark."""

import json
import os
import shutil
import subprocess

import pytest
from conftest import ROOT
from limber.launching import find_binary


def run(command, folder, **environment):
    return subprocess.run([str(word) for word in command], env={**os.environ, **environment}, cwd=folder,
                          capture_output=True, text=True, timeout=60)


def program(path, text):
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def bench(limberd, tmp_path):
    """A limber-bench with no limberd beside it."""
    (tmp_path / "alone").mkdir()
    return shutil.copy(find_binary("limber-bench"), tmp_path / "alone")


def test_bench_says_where_it_looked_for_limberd(bench, tmp_path):
    process = run([bench, "service", "--quick"], tmp_path, PATH="/nonexistent")
    assert process.returncode == 1
    assert f"no limberd beside this program ({tmp_path}/alone) or on PATH" in process.stderr
    process = run([bench, "service", "--limberd", tmp_path / "none"], tmp_path)
    assert process.returncode == 1 and f"{tmp_path}/none is no program" in process.stderr


def test_bench_takes_limberd_from_path_and_from_beside_itself(bench, tmp_path):
    on_path = program(tmp_path / "path" / "limberd", "exit 3")
    search = f"/nonexistent:{on_path.parent}:/usr/bin:/bin"
    assert f"did not start: {on_path}" in run([bench, "service"], tmp_path, PATH=search).stderr
    beside = program(tmp_path / "alone" / "limberd", "exit 3")
    assert f"did not start: {beside}" in run([bench, "service"], tmp_path, PATH=search).stderr
    found = run(["limber-bench", "service"], tmp_path, PATH=f"{tmp_path}/alone:{search}")
    assert f"did not start: {beside}" in found.stderr, "found by the shell: there is no folder in its argv[0]"


def test_bench_of_beams_compares_with_the_papers_chart(tmp_path):
    process = run([find_binary("limber-bench"), "beams", "--quick", "--shared", tmp_path / "none", "--json", "rows.json"],
                  tmp_path)
    assert process.returncode == 0, process.stderr
    assert "the paper's chart with 20 and 40 elements" in process.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())["cases"]
    chart = {row["case"]: row for row in rows if row["method"] == "the paper's chart"}
    ours = next(row for row in rows if row["method"] == "relaxation")
    assert all(row.keys() == ours.keys() for row in chart.values())
    small = chart["cantilever, alpha 0.2"]
    assert small["status"] == "converged" and small["elements"] == 10
    assert small["error"] < 0.01 * 0.06636, "of the length, against the tip's deflection"
    assert chart["roll-up to a circle"]["status"] != "converged", "no normal below the equator"
    assert chart["45 degree bend, F 300, J 1/6"]["status"] == "unstable", "elements too long for its masses"
    assert chart["45 degree bend, F 300, J 1/6, lengths over 100"]["error"] < 0.002


def test_a_report_that_cannot_be_drawn_measures_nothing(limberd, tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ImportError('made up')\n")
    process = run([find_binary("limber-bench"), "report", "--out", tmp_path / "out"], tmp_path, PYTHONPATH=str(tmp_path))
    assert process.returncode == 1
    assert "apt-get install python3-matplotlib" in process.stderr and "nothing was measured" in process.stderr
    assert not (tmp_path / "out").exists()


def test_ratios_compare_the_same_answers_and_cases_are_chosen_by_parts_of_names(limberd, tmp_path):
    process = run([find_binary("limber-bench"), "ratios", "--quick", "--json", "rows.json"], tmp_path,
                  LIMBER_BENCH_ONLY="factor of,steps of a grid")
    assert process.returncode == 0, process.stderr
    document = json.loads((tmp_path / "rows.json").read_text())
    assert document["machine"]["simd"].startswith("x86-64") and document["machine"]["cores"] >= 1
    rows = {row["pair"]: row for row in document["cases"]}
    assert set(rows) == {"factor of a linkage", "steps of a gridshell"}
    for row in rows.values():
        assert row["difference"] <= 1e-5 and row["ratio_least"] <= row["ratio"] <= row["ratio_most"]
        assert row["ours_cpu_ms"] > 0 and row["plain_cpu_ms"] > 0


def stability(tmp_path, **environment):
    process = run([find_binary("limber-bench"), "stability", "--quick", "--json", "rows.json"], tmp_path, **environment)
    rows = json.loads((tmp_path / "rows.json").read_text())["cases"]
    assert rows and all(row.keys() == rows[0].keys() for row in rows)
    return process, {row["case"]: row for row in rows}


def test_bench_of_stability_certifies_what_is_easy(tmp_path):
    process, rows = stability(tmp_path, LIMBER_BENCH_ONLY="dynamics: ")
    assert process.returncode == 0, process.stderr
    assert all(row["outcome"] == "certified" and row["required"] for row in rows.values()), process.stderr
    assert all(row["margin"] > 1 and row["error"] >= 0 for row in rows.values())


def test_bench_of_stability_finds_faults(tmp_path):
    process, rows = stability(tmp_path, LIMBER_STABILITY_FAULTS="1")
    assert process.returncode == 1 and "7 rows are wrong, hang or crash" in process.stderr
    assert {name: row["outcome"] for name, row in rows.items()} == {
        "right": "certified", "wrong": "wrong", "no number": "wrong", "not finite": "wrong",
        "said so": "not certified, said so", "silent": "wrong", "refused": "refused with reason",
        "thrown": "wrong", "hang": "hang", "crash": "crash"}
    assert rows["refused"]["reason"] == "x: too hard" and "signal 11" in rows["crash"]["reason"]
    assert rows["right"]["margin"] == pytest.approx(10)


@pytest.fixture
def build(tmp_path):
    """scripts/build in a folder of its own, with a cmake that tells how it was called."""
    (tmp_path / "scripts").mkdir()
    shutil.copy(ROOT / "scripts" / "build", tmp_path / "scripts")
    program(tmp_path / "bin" / "cmake", f'echo "$*" >> {tmp_path}/calls')
    program(tmp_path / "scripts" / "build-web", ":")  # the page has tests of its own

    def call(*arguments):
        (tmp_path / "calls").write_text("")
        process = run([tmp_path / "scripts" / "build", *arguments], tmp_path, PATH=f"{tmp_path}/bin:/usr/bin:/bin")
        return process, (tmp_path / "calls").read_text().splitlines()

    return call


@pytest.mark.parametrize("arguments, configured, built", [
    ((), "release", ""), (("tsan",), "tsan", ""), (("release", "-j2"), "release", " -j2"),
    (("-j2",), "release", " -j2"), (("release", "-j", "2", "-v", "limberd", "limber"), "release",
                                    " -j2 -v --target limberd limber")])
def test_build_passes_options_and_targets_on(build, arguments, configured, built):
    process, calls = build(*arguments)
    assert process.returncode == 0, process.stderr
    assert calls == [f"--preset {configured}", f"--build --preset {configured}{built}"]


@pytest.mark.parametrize("arguments, words", [(("release", "--fast"), "no option --fast"), (("fast",), "no preset fast"),
                                              (("release", "-j", "x"), "-j takes a number"), (("-j2x",), "-j2x")])
def test_build_refuses_what_it_does_not_know(build, arguments, words):
    process, calls = build(*arguments)
    assert process.returncode == 2 and words in process.stderr and "usage: scripts/build" in process.stderr
    assert calls == []


def test_bench_of_the_page_says_what_it_lacks_and_reads_what_node_measures(limberd, tmp_path):
    bench = find_binary("limber-bench")
    process = run([bench, "web"], tmp_path, PATH="/nonexistent")
    assert process.returncode == 1 and "needs node on PATH: install the package nodejs" in process.stderr
    if not (ROOT / "clients" / "web" / "dist" / "main.js").exists():
        pytest.skip("the page is not built")
    node = program(tmp_path / "path" / "node", 'echo "$@" >&2\n[ "$LIMBER_BIN" ] || exit 1\n'
                   'echo \'{"suite": "web", "sample": "flower", "edits": 3, "bytes": {"stream": 7}}\'')
    search = f"{node.parent}:/usr/bin:/bin"
    process = run([bench, "web", "--quick", "--json", tmp_path / "web.json"], tmp_path, PATH=search)
    assert process.returncode == 0 and "bench/web.mjs --repeats 2 --moves 20" in process.stderr
    written = json.loads((tmp_path / "web.json").read_text())
    assert written["suite"] == "web" and written["cases"] == [{"sample": "flower", "edits": 3, "bytes_stream": 7}]
    node.write_text("#!/bin/sh\necho 'no Chromium' >&2\nexit 1\n")
    process = run([bench, "web"], tmp_path, PATH=search)
    assert process.returncode == 1 and "no Chromium" in process.stderr and "without a result" in process.stderr
