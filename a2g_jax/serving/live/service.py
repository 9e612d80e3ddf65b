"""What all clients of a live server share: compiled programs, threads that compute, and limits."""

import asyncio
import json
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

from a2g_jax.errors import InputError
from a2g_jax.generation.delivery import PLAIN, Delivery
from a2g_jax.generation.live.stream import Stream
from a2g_jax.serving.live.protocol import MALFORMED, Hello, Refusal, checked_sampling
from a2g_jax.training.run import Run

#: Settings of the server's process. Without pings: the answer to one waits behind audio that is not read yet, so that a
#: client that sends faster than it is read would be taken for dead. Silent ones are found by their silence.
SERVER_OPTIONS: dict[str, Any] = {"ws_ping_interval": None}

Result = TypeVar("Result")


@dataclass(frozen=True)
class Limits:
    """Bounds of one server."""

    clients: int = 8
    """At a time; further ones are refused."""
    idle: float = 30.0
    """Seconds without a message, or without reading, after which a client is disconnected."""
    pace: float = 4.0
    """Times real time at which a client's audio is read."""
    burst: float = 10.0
    """Seconds of audio that are read without waiting."""
    programs: int = 4
    """Different sampling settings and look-aheads whose programs are kept, besides the server's own."""
    threads: int = 2
    """Threads that compute."""


class Service:
    """A run that is generated live for several clients.

    Clients with equal settings share what is compiled and the parameters; each has a stream of its own, whose arrays do
    not grow. Computing takes place in a fixed number of threads, so that the event loop never waits for it.
    """

    def __init__(
        self, run: Run, limits: Limits = Limits(), lookahead: float | None = None, delivery: Delivery = PLAIN
    ) -> None:
        """
        Args:
            lookahead: of clients that name none, seconds.
            delivery: the character that frames are for; of the run's skeleton by default.

        Raises:
            InputError: a run that cannot be generated live, or a character that does not fit it.
        """
        self.run, self.limits, self.lookahead, self.delivery = run, limits, lookahead, delivery
        self.clients = 0
        self._pool = ThreadPoolExecutor(limits.threads, "a2g-live")
        self._compiler = ThreadPoolExecutor(1, "a2g-compile")
        self._compiling = asyncio.Lock()
        self.default = Stream(run, lookahead=lookahead)
        frames = None if lookahead is None else round(lookahead * self.default.fps)
        self._own = json.dumps([frames, []])
        self._programs: OrderedDict[str, Stream] = OrderedDict()
        delivery.match(run.config.skeleton)

    def warm_up(self) -> None:
        """Compile what clients without settings of their own use."""
        self.default.warm_up()

    async def compute(self, function: Callable[..., Result], *arguments: Any) -> Result:
        """The result of a function that runs in one of the threads."""
        return await asyncio.get_running_loop().run_in_executor(self._pool, function, *arguments)

    async def open(self, hello: Hello) -> Stream:
        """The stream of a client.

        Raises:
            Refusal: settings that do not fit the run.
        """
        changes = checked_sampling(self.run.config.sampling_settings, hello.sampling)
        lookahead = self.lookahead if hello.lookahead is None else hello.lookahead
        frames = None if lookahead is None else round(lookahead * self.run.config.fps)
        key = json.dumps([frames, sorted(changes.items())])
        if key == self._own:  # never dropped, and does not wait for what other clients compile
            return await self.compute(self.default.restarted, hello.seed, hello.sample_rate)
        # One at a time: compiling takes all cores for seconds. Others continue meanwhile, in their own threads.
        async with self._compiling:
            if key not in self._programs:
                made = asyncio.get_running_loop().run_in_executor(self._compiler, self._compiled, lookahead, changes)
                self._programs[key] = await made
                while len(self._programs) > self.limits.programs:
                    self._programs.popitem(last=False)
            self._programs.move_to_end(key)
            shared = self._programs[key]
        return await self.compute(shared.restarted, hello.seed, hello.sample_rate)

    def close(self) -> None:
        """End the threads once they are done with what they compute."""
        for pool in (self._pool, self._compiler):
            pool.shutdown(wait=False, cancel_futures=True)

    def _compiled(self, lookahead: float | None, changes: dict[str, Any]) -> Stream:
        try:
            stream = Stream(self.run, lookahead=lookahead, **changes)
        except InputError as error:
            raise Refusal(MALFORMED, f"hello: {error}") from None
        stream.warm_up()
        return stream
