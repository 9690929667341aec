"""bench/report: rows, fits, goals and the page, from raw data that is made up; no benchmark runs."""

import json
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench" / "report"))

import figures  # noqa: E402
import fits  # noqa: E402
import goals  # noqa: E402
import page  # noqa: E402
import rows  # noqa: E402
from goals import Outcome  # noqa: E402

SCRIPT = ROOT / "bench" / "report" / "make_page.py"


def raw_of(**cases):
    report = {"machine": {"cpu": "made up", "cores": 2, "simd": "x86-64-v3", "compiler": "g++", "build_type": "Release"},
              "commit": "0123", "load_before": 0.1, "load_after": 1.0, "seconds": 61, "cpu_seconds": 90, "quick": False,
              "has_public_data": True,
              "runs": [{"id": name, "suite": name, "quick": False, "repeats": 5, "only": "", "seconds": 1.0,
                        "cpu_seconds": 1.5, "status": 0 if found is not None else 1} for name, found in cases.items()]}
    return rows.Raw(report, {name: found for name, found in cases.items() if found is not None})


def write(folder, raw):
    (folder / "raw").mkdir(parents=True)
    (folder / "raw" / "report.json").write_text(json.dumps(raw.report))
    for name, found in raw.cases.items():
        (folder / "raw" / f"{name}.json").write_text(json.dumps({"suite": name, "cases": found}))


def goal_of(**fields):
    return {"key": "k", "text": "t", "run": "a", "where": {}, "value": "ms", "direction": "at most", "target": 2,
            "unit": "ms", "claimed": "README.md", **fields}


def test_rows_are_chosen_by_values_lists_and_bounds():
    found = [{"n": 1, "m": "x"}, {"n": 2, "m": "y"}, {"n": 3, "m": "y"}, {"m": "y"}]
    assert rows.select(found, {"m": "y", "n": {"at least": 3}}) == [found[2]]
    assert rows.select(found, {"n": {"at most": 2}}) == found[:2]
    assert rows.select(found, {"n": [1, 3]}) == [found[0], found[2]]
    assert rows.select(found, {"n": {"at least": 0}, "m": "x"}) == [found[0]], "no number fits no bound"


def test_runs_that_failed_have_no_rows(tmp_path):
    write(tmp_path, raw_of(a=[{"ms": 1}], b=None))
    raw = rows.load(tmp_path / "raw")
    assert raw.cases == {"a": [{"ms": 1}]} and raw.failed == ["b"]
    (tmp_path / "raw" / "report.json").write_text("{}")
    with pytest.raises(ValueError, match="there is no machine"):
        rows.load(tmp_path / "raw")


def test_power_laws_are_found():
    law = fits.fit([1, 10, 100, 1000], [3 * n**1.5 for n in (1, 10, 100, 1000)])
    assert law.exponent == pytest.approx(1.5) and law.factor == pytest.approx(3)
    assert law.spread == pytest.approx(1) and law.last == pytest.approx(1.5) and law.at(4) == pytest.approx(24)
    # Constant, then linear: the law lies between, and says that it does not fit.
    bent = fits.fit([1, 10, 100, 1000], [1, 1, 1, 10])
    assert 0 < bent.exponent < 0.5 and bent.last == pytest.approx(1) and bent.spread > 1.5
    assert fits.fit([1000, 1, 10, 100], [10, 1, 1, 1]) == bent, "the order of points does not matter"


@pytest.mark.parametrize("x, y, words", [([1, 2], [1, 2], "three points"), ([1, 2, 3], [1, 0, 1], "positive"),
                                         ([2, 2, 2], [1, 1, 1], "different x")])
def test_what_is_no_power_law_is_refused(x, y, words):
    with pytest.raises(ValueError, match=words):
        fits.fit(x, y)


@pytest.mark.parametrize("direction, target, ms, outcome", [
    ("at most", 2, 2.0, Outcome.MET), ("at most", 2, 2.01, Outcome.MISSED), ("at least", 2, 2.0, Outcome.MET),
    ("at least", 2, 1.99, Outcome.MISSED), ("at most", 2, float("nan"), Outcome.MISSED),
    ("at least", 2, float("nan"), Outcome.MISSED)])
def test_goals_are_judged(direction, target, ms, outcome):
    assert goals.judge(goal_of(direction=direction, target=target), raw_of(a=[{"ms": ms}])).outcome is outcome


def test_goals_are_measured_from_rows():
    raw = raw_of(a=[{"n": 1, "ms": 2.0, "of": 4.0}, {"n": 10, "ms": 20.0, "of": 10.0}, {"n": 100, "ms": -200.0, "of": 8.0}])
    assert goals.measure(goal_of(where={"n": 1}, over="of", scale=100), raw) == 50
    assert goals.measure(goal_of(reduce="max"), raw) == 20
    assert goals.measure(goal_of(reduce="max", absolute=True), raw) == 200
    assert goals.measure(goal_of(reduce="median"), raw) == 2
    assert goals.measure(goal_of(reduce="exponent", by="n", absolute=True), raw) == pytest.approx(1)


@pytest.mark.parametrize("fields, words", [
    ({"run": "other"}, "no part of this report"), ({"run": "lost"}, "the run lost failed"), ({"where": {"n": 9}}, "no such row"),
    ({"where": {"n": [1, 9]}}, "no such row of n 9"),
    ({"value": "s"}, "has no s"), ({}, "2 rows of a fit"), ({"where": {"n": 1}, "over": "none"}, "has no none"),
    ({"reduce": "exponent", "by": "n"}, "three points")])
def test_what_cannot_be_measured_says_why(fields, words):
    judged = goals.judge(goal_of(**fields), raw_of(a=[{"n": 1, "ms": 1.0}, {"n": 2, "ms": 1.0}], lost=None))
    assert judged.outcome is Outcome.NOT_MEASURED and judged.measured is None and words in judged.why


@pytest.mark.parametrize("change, words", [
    ({"direction": "below"}, "direction is 'below'"), ({"reduce": "mean"}, "reduce is 'mean'"), ({"by": "n"}, "'by' belongs"),
    ({"reduce": "exponent"}, "'by' belongs"), ({"target": "2"}, "target must be a number"), ({"measured": 1}, "no field measured")])
def test_goals_that_are_no_goals_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        goals.check(goal_of(**change))
    incomplete = goal_of()
    del incomplete["claimed"]
    with pytest.raises(ValueError, match="k: there is no claimed"):
        goals.check(incomplete)


def test_the_goals_of_the_project_are_sound():
    found = goals.load()
    assert len(found) > 40
    for goal in found:
        where = goal["claimed"]
        assert where in ("goal", "here") or (ROOT / where.split("#")[0]).is_file(), goal["key"]


def test_every_goal_is_measured_by_the_report_of_the_repository():
    """A goal whose rows have another name by now would be "not measured" for ever."""
    raw = rows.load(ROOT / "docs" / "report" / "raw")
    unmeasured = {one.goal["key"]: one.why for one in (goals.judge(goal, raw) for goal in goals.load())
                  if one.outcome is Outcome.NOT_MEASURED}
    assert unmeasured == {}


def test_every_figure_has_all_its_lines_in_the_report_of_the_repository():
    raw = rows.load(ROOT / "docs" / "report" / "raw")
    figures.add_derived(raw)
    for figure in figures.trade_offs():
        found = {points.line.name for points in figures.points_of(figure, raw)}
        assert found == {line.name for line in figure.lines}, figure.key
    for growth in figures.GROWTHS:
        assert growth.points(raw), growth.key


def test_points_are_in_the_order_of_rows_and_none_is_below_the_floor():
    figure = figures.Figure("k", "t", "", "ms", "error", "", "", [figures.Line("ours", "a", {"m": 1})], 1e-6)
    raw = raw_of(a=[{"m": 1, "ms": 3, "error": 0}, {"m": 1, "ms": 2, "error": 0.5}, {"m": 1, "ms": None, "error": 1},
                    {"m": 2, "ms": 1, "error": 1}])
    (points,) = figures.points_of(figure, raw)
    assert points.x == [3, 2] and points.y == [1e-6, 0.5]


def test_missed_goals_are_red_in_both_pages():
    blocks = [page.Table(["what", "outcome"], [["a | b", page.Cell("missed", True)], ["<c>", page.Cell("met")]])]
    markdown, html = page.to_markdown(blocks), page.to_html(blocks, "t")
    assert "| a \\| b | \N{LARGE RED CIRCLE} **missed** |" in markdown and "| <c> | met |" in markdown
    assert "<td class=missed>missed</td>" in html and "<td>&lt;c&gt;</td><td>met</td>" in html


def make_page(folder):
    return subprocess.run([sys.executable, SCRIPT, folder], capture_output=True, text=True, timeout=60)


def test_a_page_is_drawn_twice_with_the_same_bytes(tmp_path):
    pytest.importorskip("matplotlib")
    growth = [{"growth": "edges", "size": n, "what": "factor", "ms": 0.1 * n, "not_converged": 0} for n in (5, 10, 20)]
    stream = [{"scene": "flower", "method": "limber, coordinates", "tolerance": t, "bytes_per_frame": 4 / t, "error": t}
              for t in (0.1, 0.01)]
    for name in ("one", "two"):
        write(tmp_path / name, raw_of(growth_linkages=growth, streams=stream, service=None))
        process = make_page(tmp_path / name)
        assert process.returncode == 0, process.stderr
    for path in ("README.md", "index.html", "plots/growth_edges.svg", "plots/streams.svg"):
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes(), path
    plots = sorted(path.name for path in (tmp_path / "one" / "plots").iterdir())
    assert plots == ["growth_edges.svg", "streams.svg"], "figures without rows are left out"
    drawn = (tmp_path / "one" / "plots" / "growth_edges.svg").read_text()
    assert "factor: 1.00" in drawn, "the exponent, as text"
    markdown = (tmp_path / "one" / "README.md").read_text()
    assert "the run service failed" in markdown and "made up" in markdown
    # 400 bytes at the default tolerance are just within the goal.
    assert "| at most 400 bytes | 400 | met |" in markdown


def test_without_raw_data_the_script_says_so(tmp_path):
    pytest.importorskip("matplotlib")
    process = make_page(tmp_path)
    assert process.returncode == 1 and "report.json" in process.stderr
    assert make_page("--help").returncode == 2


def test_without_matplotlib_the_script_says_what_to_install(tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ImportError('made up')\n")
    process = subprocess.run([sys.executable, SCRIPT, "--check"], capture_output=True, text=True, timeout=60,
                             env={"PYTHONPATH": str(tmp_path)})
    assert process.returncode == 2 and "apt-get install python3-matplotlib" in process.stderr
