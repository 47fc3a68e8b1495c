"""Content of the log file: everything that any module of the panel logs."""

from __future__ import annotations

import ast
import logging
import os
import threading

import pytest

from tests.programs import PATIENCE, wait_until
from tests.sources import PACKAGE, calls_of
from tui.session.connect.open_line import open_line
from tui.session.logs import log_file, start_logging, stop_logging


async def unforeseen() -> None:
    raise ZeroDivisionError("nobody thought of this")


@pytest.mark.internal_errors
def test_failed_task_leaves_its_traceback_in_the_log() -> None:
    start_logging(0)
    opened = open_line("sim:atv71")
    try:
        worker = opened.line.spawn(unforeseen, "watching device 1")
        wait_until(worker.done, "the worker's end")
    finally:
        opened.close()
    stop_logging()
    output = log_file().read_text()
    assert "watching device 1 ended by an error" in output
    assert "Traceback" in output
    assert "in unforeseen" in output
    assert "ZeroDivisionError: nobody thought of this" in output


def test_every_module_logs_by_its_own_name() -> None:
    """The handler covers all of them; a logger of any other name is not logged."""
    named: dict[str, list[str]] = {}
    for path, call in calls_of("getLogger"):
        name = path.relative_to(PACKAGE).as_posix()
        named.setdefault(name, []).extend(ast.unparse(each) for each in call.args)
    # the module that adds the handler, and the one that silences pymodbus
    assert named.pop("session/logs.py") == ["PANEL", "PANEL"]
    assert named["bus/line.py"] == ["'pymodbus'", "'pymodbus'"]
    del named["bus/line.py"]
    assert len(named) > 3
    # the client of the broker writes into one below that of its module
    assert named.pop("cli/plant/mqtt.py") == ["__name__", "f'{__name__}.client'"]
    assert {call for calls in named.values() for call in calls} == {"__name__"}


def test_log_handler_covers_every_module() -> None:
    start_logging(0)
    logging.getLogger("tui.anything.at.all").warning("heard")
    stop_logging()
    assert "WARNING heard" in log_file().read_text()


def test_hung_disk_does_not_block_logging() -> None:
    """A stop logs its actions: in the thread of the keys, and in that of the line."""
    log_file().parent.mkdir(parents=True, exist_ok=True)
    os.mkfifo(log_file())  # opening it blocks until a program reads it
    start_logging(0)
    done = threading.Event()

    def log() -> None:
        logging.getLogger("tui.session.command.stop").info("stop of device 1")
        stop_logging()
        done.set()

    threading.Thread(target=log, daemon=True).start()
    held_up = not done.wait(PATIENCE)
    with log_file().open("rb") as disk:  # lets the writer go
        assert b"stop of device 1" in disk.read()
    assert not held_up


def test_log_line_does_not_control_terminal() -> None:
    start_logging(0)
    logging.getLogger("tui.anything").warning("drive \x1b]0;x\x07\x9b2J\nsays")
    stop_logging()
    assert "WARNING drive ␛]0;x␇\ufffd2J\nsays" in log_file().read_text("utf-8")
