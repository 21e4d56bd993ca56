"""Processes of the page's jobs: ended when they take too much, or when nobody waits for them."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from asperity.app.jobs import Jobs
from asperity.app.worker import limited

JOB = "asperity.app.api.unruly:"
#: A law outside the package.
COMPOSITE = Path(__file__).parents[2] / "examples" / "composite_law.py"


@pytest.fixture
def with_jobs(monkeypatch, tmp_path):
    """Call a coroutine function with `Jobs` whose workers know `unruly_jobs`, and laws if any."""
    monkeypatch.setattr("asperity.app.jobs._PATIENCE", 0.1)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=":")

    def run(work, *laws):
        async def whole():
            jobs = Jobs(preload="unruly_jobs", laws=laws, folder=tmp_path)
            try:
                return await work(jobs)
            finally:
                await jobs.close()

        # A thread of its own: the browser of other tests has a loop in this one.
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(lambda: asyncio.run(whole())).result()

    return run


async def messages(jobs, job, **options):
    return [m async for m in jobs.run(JOB + job, {"x": 1}, **options)]


def test_workers_know_laws_and_the_folder_that_the_server_was_given(with_jobs, tmp_path):
    """What a killed worker leaves in the folder is removed by the server."""

    async def work(jobs):
        return [(await messages(jobs, job))[-1]["result"] for job in ("laws", "place")]

    laws, place = with_jobs(work, f"{COMPOSITE}:Composite")
    assert {"rice-ruina", "composite"} <= set(laws)
    assert place == str(tmp_path)


def test_a_job_that_takes_too_much_is_ended(with_jobs):
    async def work(jobs):
        return [
            (await messages(jobs, job, limits=limits))[-1]
            for job, limits in (
                ("spin", {"seconds": 1}),
                ("hoard", {"memory": 256 * 1024**2, "seconds": 20}),
                ("answer", None),
            )
        ]

    spun, hoarded, answered = with_jobs(work)
    assert spun == {"error": spun["error"], "done": True}
    assert "time or memory" in spun["error"]
    assert "memory" in hoarded["error"]
    assert answered == {"result": {"x": 1}, "done": True}


def test_a_part_of_the_work_has_limits_of_its_own():
    resource = pytest.importorskip("resource", reason="this system has no such limits")
    kinds = resource.RLIMIT_AS, resource.RLIMIT_CPU
    before = [resource.getrlimit(kind) for kind in kinds]
    spent = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    with limited({"memory": 2**40, "seconds": 10_000}):
        memory, seconds = (resource.getrlimit(kind)[0] for kind in kinds)
    assert memory == pytest.approx(2**40, rel=0.1)
    assert 10_000 <= seconds - spent < 20_000
    assert [resource.getrlimit(kind) for kind in kinds] == before


def test_a_job_that_nobody_waits_for_is_ended_whether_it_listens_or_not(with_jobs):
    async def work(jobs):
        running = jobs.run(JOB + "spin", {})
        assert await anext(running) == {"begun": True}
        await running.aclose()
        left = await messages(jobs, "answer")
        # Another job waits for its turn.
        running = jobs.run(JOB + "spin", {})
        while await anext(running) != {"begun": True}:
            pass  # the worker may be looked after yet
        waiting = asyncio.ensure_future(messages(jobs, "answer"))
        await asyncio.sleep(0.01)
        await running.aclose()
        return left, await waiting

    left, waiting = with_jobs(work)
    assert left[-1]["result"] == {"x": 1}
    assert waiting == [{"waiting": 1}, {"result": {"x": 1}, "done": True}]
