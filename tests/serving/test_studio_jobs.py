"""The queue of the studio: order, progress with an estimate, cancellation, limits and errors."""

import threading

import pytest

from a2g_jax.errors import InputError
from a2g_jax.progress import checkpoint
from a2g_jax.serving.studio.jobs import CANCELLED, DONE, FAILED, QUEUED, RUNNING, STOPPING, Job, Jobs


@pytest.fixture
def jobs():
    queue = Jobs(waiting=2)
    yield queue
    queue.close()


class Held:
    """Work that waits at checkpoints until it is let go."""

    def __init__(self):
        self.started, self.go, self.steps = threading.Event(), threading.Event(), 0

    def __call__(self, job: Job) -> str:
        self.started.set()
        while not self.go.wait(0.01):
            checkpoint()
            self.steps += 1
        return "result"


def test_jobs_run_one_after_another_in_their_order(jobs):
    done = []
    held = Held()
    first = jobs.submit(Job("first", held))
    assert held.started.wait(5)
    others = [jobs.submit(Job(name, lambda job: done.append(job.title))) for name in ("second", "third")]
    assert (first.state, others[0].state, jobs.position(others[1])) == (RUNNING, QUEUED, 2)
    assert done == []
    held.go.set()
    assert jobs.wait(others[1], 5.0)
    assert done == ["second", "third"]
    assert (first.state, first.result) == (DONE, "result")


def test_a_running_job_ends_at_its_next_checkpoint(jobs):
    held = Held()
    job = jobs.submit(Job("long", held))
    assert held.started.wait(5)
    jobs.cancel(job)
    assert jobs.wait(job, 5.0)
    assert (job.state, job.result, held.go.is_set()) == (CANCELLED, None, False)
    steps = held.steps
    after = jobs.submit(Job("next", lambda job: 7))
    assert jobs.wait(after, 5.0)
    assert (after.result, held.steps) == (7, steps)


def test_a_waiting_job_that_is_cancelled_never_runs(jobs):
    held, ran = Held(), []
    jobs.submit(Job("long", held))
    assert held.started.wait(5)
    waiting = jobs.submit(Job("waiting", ran.append))
    jobs.cancel(waiting)
    assert waiting.state == CANCELLED
    held.go.set()
    last = jobs.submit(Job("last", lambda job: None))
    assert jobs.wait(last, 5.0)
    assert ran == []
    jobs.cancel(last)
    assert last.state == DONE


def test_too_many_that_wait_are_refused(jobs):
    held = Held()
    jobs.submit(Job("long", held))
    assert held.started.wait(5)
    for number in range(2):
        jobs.submit(Job(str(number), lambda job: None))
    with pytest.raises(InputError, match="2 requests wait already"):
        jobs.submit(Job("one more", lambda job: None))
    held.go.set()


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InputError("speech.wav: is\nempty."), "speech.wav: is empty."),
        (OSError(28, "No space left on device"), "a file cannot be written (No space left on device)"),
        (MemoryError(), "there is not enough memory"),
        (KeyError("x"), "unexpected KeyError"),
    ],
)
def test_an_error_is_a_message_and_the_next_job_runs(jobs, error, message, capfd):
    def fail(job):
        raise error

    job, after = jobs.submit(Job("bad", fail)), jobs.submit(Job("good", lambda job: 1))
    assert jobs.wait(after, 5.0)
    assert job.state == FAILED
    assert message in job.error["message"]
    assert after.result == 1


def test_progress_has_a_rate_and_an_estimate(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("a2g_jax.serving.studio.jobs.time.monotonic", lambda: now[0])
    job = Job("films", lambda job: None, expected=20.0, state=RUNNING, started=100.0)
    now[0] = 105.0
    assert (job.rate(), job.remaining()) == (None, 15.0)
    job.step(1, 11, "frame")  # five seconds of preparation are no frames
    for done in range(2, 7):
        now[0] += 0.5
        job.step(done, 11, "frame")
    assert job.rate() == pytest.approx(2.0)
    assert job.remaining() == pytest.approx(2.5)
    assert job.to_json()["unit"] == "frame"


def test_closing_ends_everything(jobs):
    held = Held()
    running = jobs.submit(Job("long", held))
    assert held.started.wait(5)
    waiting = jobs.submit(Job("waiting", lambda job: None))
    jobs.close(5.0)
    assert (running.state, waiting.state) == (CANCELLED, CANCELLED)
    with pytest.raises(InputError, match="closing"):
        jobs.submit(Job("late", lambda job: None))


def test_a_job_that_is_stopping_does_not_start_another_phase():
    job = Job("work", lambda job: None, state=STOPPING)
    with pytest.raises(Exception, match="cancelled"):
        job.say("writing")
