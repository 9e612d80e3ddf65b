"""One live server for all tests of this folder."""

from types import SimpleNamespace

import pytest

from a2g_jax.serving import run
from a2g_jax.serving.app import make_app
from a2g_jax.serving.live.page import lifespan, routes
from a2g_jax.serving.live.service import SERVER_OPTIONS, Limits, Service
from a2g_jax.serving.security import Security
from tests.generation.flows_for_tests import run_of


@pytest.fixture(scope="session")
def live():
    """URL and service of a server with short limits."""
    service = Service(run_of("6d"), Limits(clients=3, idle=3.0, pace=1000.0))
    service.warm_up()
    with run.served(make_app(routes(service, "toy"), Security(), lifespan(service)), **SERVER_OPTIONS) as url:
        yield SimpleNamespace(url=url, service=service)
