"""A server of a small untrained run, and conversations with it."""

import json

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

RATE = 16000


def speech(seconds=1.0, seed=0):
    """Bursts of noise, samples of 16 bits."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    loud = np.maximum(np.sin(2 * np.pi * 2.3 * time), 0.0)
    return (6000 * loud * rng.standard_normal(len(time))).clip(-32768, 32767).astype("<i2")


def socket_url(url):
    return f"{url.replace('http', 'ws')}live"


def opened(url, **hello):
    """A client whose first message is sent and answered."""
    client = connect(socket_url(url), max_size=2**24)
    client.send(json.dumps({"sample_rate": RATE, **hello}))
    return client, json.loads(client.recv(timeout=60))


def closing(client):
    """Close code, its reason, and the error message of a client that the server disconnects."""
    error = None
    try:
        while True:
            message = client.recv(timeout=60)
            found = json.loads(message) if isinstance(message, str) else {}
            error = found.get("error", error)
    except ConnectionClosed as closed:
        return closed.rcvd.code, closed.rcvd.reason, error
