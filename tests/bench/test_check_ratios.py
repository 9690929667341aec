"""scripts/check-ratios with runs that are made up: nothing is measured."""

import importlib.machinery
import importlib.util
import json
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def load_script():
    loader = importlib.machinery.SourceFileLoader("check_ratios", str(ROOT / "scripts" / "check-ratios"))
    spec = importlib.util.spec_from_loader("check_ratios", loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


def run_of(ratios, simd="x86-64-v3"):
    return {"suite": "ratios", "machine": {"cpu": "made up", "simd": simd},
            "cases": [{"pair": pair, "ratio": ratio} for pair, ratio in ratios.items()]}


@pytest.fixture
def check(tmp_path, monkeypatch):
    """The script's main() against a record of two pairs, and runs that are written to files."""
    module = load_script()
    record = tmp_path / "record.json"
    record.write_text(json.dumps({"ratios": {"x86-64-v3": {"solve": 50.0, "factor": 10.0}}}))
    monkeypatch.setattr(module, "RECORD", record)

    def call(*runs):
        paths = []
        for number, run in enumerate(runs):
            path = tmp_path / f"run-{number}.json"
            path.write_text(json.dumps(run))
            paths.append(str(path))
        return module.main(paths)

    call.module = module
    return call


def test_noise_passes(check, capsys):
    assert check(run_of({"solve": 40.0, "factor": 7.1})) == 0
    assert "solve: 40, recorded 50, at least 35" in capsys.readouterr().out


def test_a_slowdown_of_half_fails_and_is_named(check, capsys):
    assert check(run_of({"solve": 50.0 / 1.5, "factor": 10.0})) == 1
    output = capsys.readouterr()
    assert "solve: 33.3, recorded 50, at least 35 FELL" in output.out
    assert "30% below the recorded ratio: solve" in output.err and "factor" not in output.err


@pytest.mark.parametrize("ratio, code", [(35.01, 0), (34.99, 1), (float("nan"), 1), (0.0, 1), (500.0, 0)])
def test_the_bound_is_thirty_percent_below(check, ratio, code):
    assert check(run_of({"solve": ratio, "factor": 10.0})) == code


def test_the_better_of_two_attempts_counts(check):
    slow, fast = {"solve": 20.0, "factor": 9.0}, {"solve": 48.0, "factor": 5.0}
    assert check(run_of(slow)) == 1 and check(run_of(fast)) == 1
    assert check(run_of(slow), run_of(fast)) == 0


def test_what_failed_is_measured_once_more_alone(check, monkeypatch):
    asked = []

    def measured(first, second):
        runs = [("x86-64-v3", first), ("x86-64-v3", second)]

        def measure(only=()):
            asked.append(list(only))
            return runs.pop(0)
        return measure

    monkeypatch.setattr(check.module, "measure", measured({"solve": 20.0, "factor": 9.0}, {"solve": 49.0}))
    assert check() == 0, "a slow spell of the machine"
    assert asked == [[], ["solve"]]
    monkeypatch.setattr(check.module, "measure", measured({"solve": 20.0, "factor": 9.0}, {"solve": 21.0}))
    assert check() == 1, "slower twice"


def test_a_pair_that_is_gone_is_an_error(check, capsys):
    assert check(run_of({"solve": 50.0})) == 2
    assert "not measured: factor" in capsys.readouterr().err


def test_a_new_pair_is_told_and_passes(check, capsys):
    assert check(run_of({"solve": 50.0, "factor": 10.0, "new": 3.0})) == 0
    assert "new: 3, not recorded yet" in capsys.readouterr().out


def test_another_simd_level_has_no_record(check, capsys):
    assert check(run_of({"solve": 1.0, "factor": 1.0}, simd="x86-64")) == 0
    assert "nothing is recorded for x86-64" in capsys.readouterr().out


@pytest.mark.parametrize("run", [{"cases": []}, {"machine": {"simd": "x86-64-v3"}, "cases": [{"pair": "solve"}]}])
def test_files_of_something_else_are_refused(check, run, capsys):
    assert check(run) == 2
    assert "not what limber-bench ratios --json writes" in capsys.readouterr().err


def test_recording_takes_the_least_of_three_runs(check, monkeypatch):
    ratios = iter([{"solve": 52.0}, {"solve": 48.04}, {"solve": 50.0}])
    monkeypatch.setattr(check.module, "measure", lambda only=(): ("x86-64-v4", next(ratios)))
    assert check.module.main(["--record"]) == 0
    document = json.loads(check.module.RECORD.read_text())
    assert document["ratios"]["x86-64-v4"] == {"solve": 48.0}
    assert document["ratios"]["x86-64-v3"] == {"solve": 50.0, "factor": 10.0}, "other levels stay"


def test_a_record_keeps_the_least_of_all_machines_unless_it_is_made_anew(check, monkeypatch):
    monkeypatch.setattr(check.module, "measure", lambda only=(): ("x86-64-v3", {"solve": 60.0, "factor": 9.0}))
    assert check.module.main(["--record"]) == 0
    assert json.loads(check.module.RECORD.read_text())["ratios"]["x86-64-v3"] == {"solve": 50.0, "factor": 9.0}
    assert check.module.main(["--anew"]) == 0
    assert json.loads(check.module.RECORD.read_text())["ratios"]["x86-64-v3"] == {"solve": 60.0, "factor": 9.0}
    assert check.module.main(["--anew", "--record"]) == 2


def test_the_record_of_the_repository_can_fail():
    """A run in which everything took twice as long must not pass against what is recorded."""
    module = load_script()
    for simd, recorded in json.loads(module.RECORD.read_text())["ratios"].items():
        failed, _ = module.compare(recorded, {pair: ratio / 2 for pair, ratio in recorded.items()})
        assert sorted(failed) == sorted(recorded), simd
        assert module.compare(recorded, recorded)[0] == []
