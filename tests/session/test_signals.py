"""Signals that the system gives to another thread than the main one."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from tui.session.signals import wait_for


@pytest.fixture(autouse=True)
def _usual_handler() -> object:
    before = signal.getsignal(signal.SIGUSR1)
    yield
    signal.signal(signal.SIGUSR1, before)


def test_wait_notices_a_signal_that_another_thread_took() -> None:
    """On a busy computer, SIGTERM to a keeper had no effect."""
    ended = threading.Event()
    signal.signal(signal.SIGUSR1, lambda *_: ended.set())

    def take() -> None:
        time.sleep(0.1)  # the main thread waits by now
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)

    threading.Thread(target=take).start()
    begun = time.monotonic()
    wait_for(ended)
    assert time.monotonic() - begun < 5.0


def test_wait_ends_with_its_event() -> None:
    ended = threading.Event()
    threading.Timer(0.1, ended.set).start()
    wait_for(ended)
    assert ended.is_set()
