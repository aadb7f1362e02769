"""Jobs in this process, on its cores and on a Dask cluster of one worker on this machine."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import engine_jobs
import pytest

from glass_nav.compare import engine
from glass_nav.compare.engine import EngineError, Failed

JOBS = [3, 1, -4, 5, 0, 2]
WHY = "scripts/setup installs distributed"
ANSWERS = [9, 1, Failed(-4, "-4 is negative"), 25, 0, 4]


def wait_until(condition, timeout_s):
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    with dask_scheduler(tmp_path_factory.mktemp("dask")) as (address, _):
        yield address


@contextlib.contextmanager
def dask_scheduler(folder):
    """Address and process of a scheduler with one worker, a process too; on free ports."""
    pytest.importorskip("distributed", reason=WHY)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(
            [str(Path(engine_jobs.__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
        ),
    }
    started = []

    def start(name, *options):
        with (folder / f"{name}.log").open("w") as log:
            started.append(
                subprocess.Popen(
                    [
                        sys.executable,
                        "-m",
                        f"distributed.cli.dask_{name}",
                        *options,
                        "--dashboard-address",
                        "127.0.0.1:0",
                    ],
                    cwd=folder,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                )
            )

    try:
        told = folder / "scheduler.json"
        start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(told))
        assert wait_until(lambda: told.exists() and told.read_text().endswith("}"), 60), "no scheduler within 60 s"
        address = json.loads(told.read_text())["address"]
        start("worker", address, "--nthreads", "1", "--no-nanny")
        yield address, started[0]
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(timeout=30)


@pytest.mark.parametrize("cores", [1, 2])
def test_answers_come_in_the_order_of_the_jobs_and_a_failure_stops_no_other(cores):
    steps = []
    assert engine.run(JOBS, engine_jobs.squared, steps.append, cores) == ANSWERS
    assert sum(steps) == 3 + 1 + 5 + 0 + 2


def test_a_dask_cluster_gives_the_same_answers(scheduler):
    steps = []
    assert engine.run(JOBS, engine_jobs.squared, steps.append, scheduler=scheduler) == ANSWERS
    assert sum(steps) == 3 + 1 + 5 + 0 + 2
    (worker,) = set(engine.run([1, 2], engine_jobs.process, steps.append, scheduler=scheduler))
    assert worker != os.getpid()


def test_more_than_one_core_means_other_processes():
    assert os.getpid() not in engine.run([1, 2], engine_jobs.process, lambda count: None, cores=2)
    assert set(engine.run([1, 2], engine_jobs.process, lambda count: None)) == {os.getpid()}


def test_a_process_that_is_killed_is_told_in_one_line_and_the_others_go_on():
    answers = engine.run([2, "end", 3, "end", 4], engine_jobs.squared_or_ended, lambda count: None, cores=2)
    assert answers == [4, Failed("end", engine.DIED), 9, Failed("end", engine.DIED), 16]


def test_a_job_whose_process_was_killed_once_is_done_by_another(tmp_path):
    jobs, steps = [str(tmp_path / "a"), str(tmp_path / "b")], []
    assert engine.run(jobs, engine_jobs.ended_once, steps.append, cores=2) == ["done"] * 2
    assert sum(steps) == 2


def test_an_error_that_nobody_expects_is_told_and_stops_no_other():
    done, failed = engine.run([2, "two"], engine_jobs.squared, lambda count: None, cores=2)
    assert done == 4
    assert failed.job == "two" and failed.reason.startswith("TypeError: ")


def test_what_a_worker_of_the_cluster_cannot_do_stops_no_other(scheduler):
    done, failed = engine.run([2, "two"], engine_jobs.squared, lambda count: None, scheduler=scheduler)
    assert done == 4
    assert failed.job == "two" and failed.reason.startswith("TypeError: ")


def test_a_scheduler_without_workers_is_reported(monkeypatch):
    distributed = pytest.importorskip("distributed", reason=WHY)
    monkeypatch.setattr(engine, "JOIN_S", 0.5)
    with distributed.LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0", scheduler_port=0) as cluster:
        address = cluster.scheduler_address
        with pytest.raises(EngineError) as caught:
            engine.run([1], engine_jobs.squared, lambda count: None, scheduler=address)
    assert str(caught.value) == f"no worker has joined the Dask scheduler at {address} within 0.5 s"


def test_a_scheduler_that_loses_its_last_worker_is_reported(monkeypatch, tmp_path):
    monkeypatch.setattr(engine, "CHECK_S", 1.0)
    with dask_scheduler(tmp_path) as (address, _):
        with pytest.raises(EngineError) as caught:
            engine.run(["end"], engine_jobs.squared_or_ended, lambda count: None, scheduler=address)
    assert str(caught.value) == f"the Dask scheduler at {address} has lost its last worker"


def test_a_scheduler_that_ends_is_reported(monkeypatch, tmp_path):
    monkeypatch.setattr(engine, "CHECK_S", 1.0)
    with dask_scheduler(tmp_path) as (address, process):
        with pytest.raises(EngineError) as caught:
            engine.run([process.pid], engine_jobs.killed, lambda count: None, scheduler=address)
    assert str(caught.value) == f"the Dask scheduler at {address} does not answer any more"


def test_without_the_package_the_option_that_needs_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        EngineError, match=r"^--scheduler needs the Python package distributed \(pip install distributed\)"
    ):
        engine.run([1, 2], engine_jobs.squared, lambda count: None, scheduler="tcp://a:1")


def test_a_scheduler_that_does_not_answer_is_reported(monkeypatch):
    pytest.importorskip("distributed", reason=WHY)
    monkeypatch.setattr(engine, "CONNECT_S", 0.5)
    with pytest.raises(EngineError, match="^no Dask scheduler answers at tcp://127.0.0.1:9: ") as caught:
        engine.run([1], engine_jobs.squared, lambda count: None, scheduler="tcp://127.0.0.1:9")
    assert "\n" not in str(caught.value)
    with pytest.raises(EngineError, match="^no Dask scheduler answers at nowhere://: "):
        engine.run([1], engine_jobs.squared, lambda count: None, scheduler="nowhere://")
