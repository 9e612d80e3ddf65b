"""The plan of the command that makes all tables: order, folders, commands that exist, and what a failure leaves."""

import importlib.util
import os
import signal
import threading
import time
from pathlib import Path

import pytest

from a2g_jax.cli.parser import make_parser
from a2g_jax.config import parse_flags
from a2g_jax.io.sealed import write_sealed
from a2g_jax.models.registry import find_model
from a2g_jax.training.run_file import FORMAT
from experiments.tables.__main__ import run
from experiments.tables.jobs import JOBS, PAPERS, Job, ready

WORK = Path("work")


def test_every_job_comes_after_those_that_it_needs():
    before: set[str] = set()
    for job in JOBS:
        assert set(job.needs) <= before, job.name
        assert job.name not in before
        before.add(job.name)


@pytest.mark.parametrize("job", JOBS, ids=lambda job: job.name)
def test_commands_exist_and_their_folders_are_made_by_what_they_need(job):
    module, *arguments = job.arguments(WORK)
    if module == "a2g_jax.cli":
        options, settings = make_parser().parse_known_args(arguments)  # exits on a flag that does not exist
        if settings:
            entry = find_model(options.model)
            parse_flags(settings, entry.presets["tiny"], entry.training_preset("tiny"), hint="--settings")
    else:
        assert importlib.util.find_spec(module) is not None
    needed = {job.name, "runs", *job.needs}
    needed |= {name for one in JOBS if one.name in job.needs for name in one.needs}
    for argument in arguments:
        if argument.startswith("work/"):
            assert Path(argument).name in needed


def test_tables_of_one_paper_run_one_at_a_time_and_corpora_beside_them():
    jobs = [job for job in JOBS if job.paper == PAPERS[0]]
    first = ready(jobs, set(), set(), set())
    assert [job.name for job in first] == [job.name for job in jobs if not job.needs]
    corpora = {job.name for job in jobs if job.makes}
    assert [job.name for job in ready(jobs, corpora, corpora, set())] == ["audio2gestures.table1"]
    first_table = {"audio2gestures.table1"}
    assert ready(jobs, corpora, corpora | first_table, first_table) == []
    # One that failed is not in the way of the others.
    assert [job.name for job in ready(jobs, corpora, corpora | first_table, set())] == ["audio2gestures.table2"]


def test_a_network_is_finished_once_it_has_all_its_steps(tmp_path):
    job = next(job for job in JOBS if job.name == "flow_loss")
    assert not job.finished(tmp_path)
    for steps in (job.steps - 1, job.steps):
        (tmp_path / "flow_loss").mkdir(exist_ok=True)
        write_sealed(tmp_path / "flow_loss" / "run.json", {"format": FORMAT, "version": 1, "steps": steps})
        assert job.finished(tmp_path) == (steps == job.steps)


def _job(name, code, needs=(), makes=""):
    return Job(name, "p", f"timeit -n1 -r1 {code}", needs, makes)


@pytest.mark.parametrize("at_once", [1, 2])
def test_jobs_that_need_a_failed_one_are_left_out_and_the_others_run(tmp_path, capfd, at_once):
    made = tmp_path / "made"
    jobs = [
        _job("fails", "1/0"),
        _job("writes", f"open('{made}','w').close()", makes="made"),
        _job("needs both", "pass", ("fails", "writes")),
        _job("needs one", "pass", ("writes",)),
    ]
    assert run(jobs, tmp_path, at_once) == 1
    printed = capfd.readouterr().out
    assert "ZeroDivisionError" in printed
    assert "not begun, since they need what failed: needs both" in printed
    assert "needs one: " in printed
    assert made.exists()
    # What is made is not made again; tables decide themselves.
    assert run(jobs[1:2], tmp_path, at_once) == 0
    assert "writes" not in capfd.readouterr().out


def test_a_signal_ends_what_runs_and_the_same_command_may_follow(tmp_path, capfd):
    started = tmp_path / "started"
    # One word, since commands are split at spaces.
    code = f"[open('{started}','w').write(str(__import__('os').getpid())),__import__('time').sleep(600)]"
    jobs = [_job("sleeps", code)]

    def end():
        while not started.exists() or not started.read_text():
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=end, daemon=True).start()
    assert run(jobs, tmp_path, 1) == 130
    assert "the same command resumes" in capfd.readouterr().out
    with pytest.raises(ProcessLookupError):
        os.kill(int(started.read_text()), 0)
    assert not (tmp_path / ".lock").exists()
