"""`drivepanel run`: a motor that runs as long as this command does, and is stopped at its end."""

from __future__ import annotations

import click

from ..running.motor import RunOptions, run_motor
from ..shared.numbers import seconds as seconds_range
from ..shared.options import (
    Target,
    drive_options,
    json_option,
    line_argument,
    never_forced,
    on_line,
    read_only_option,
)
from ..shared.registration import WRITING, command
from .orders import arm_option, need_arming


@command("Run a motor until this command ends.", statuses=WRITING, acts=True)
@line_argument
@drive_options
@click.option("--reverse", is_flag=True, help="Run reverse.")
@click.option("--reference", metavar="REFERENCE", help="Set this reference first: 30Hz, 900rpm.")
@click.option(
    "--for",
    "seconds",
    type=seconds_range(above=True),
    metavar="S",
    help="Stop the motor after S seconds.",
)
@arm_option
@click.option(
    "--leave-running", is_flag=True, help="Leave the motor running at the end of this command."
)
@click.option(
    "--unrecorded",
    is_flag=True,
    help="Start even if the start cannot be recorded.",
)
@click.option(
    "--take-control",
    is_flag=True,
    help="Take control from the terminals; their stop is disabled.",
)
@read_only_option
@json_option
@never_forced
def run(
    target: Target,
    reverse: bool,
    reference: str | None,
    seconds: float | None,
    arm: bool,
    leave_running: bool,
    unrecorded: bool,
    take_control: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Run a motor until this command ends; Ctrl-C stops it on its ramp.

    Other signals that end a program, a closed standard output and the end of --for stop it, too.
    """
    need_arming(arm, "run starts the motor")
    wish = RunOptions(
        "reverse" if reverse else "forward",
        reference,
        seconds,
        leave_running,
        unrecorded,
        as_json,
        take_control,
    )
    on_line(target, lambda opened: run_motor(opened, target, wish), read_only=read_only)
