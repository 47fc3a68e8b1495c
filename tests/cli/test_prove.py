"""`drivepanel prove`: what it asks before a motor that turns is left alone, and of which port."""

from __future__ import annotations

from .commands import ended, refused, tcp_line

ON_THE_RUN = ("prove", "sim:atv312", "--arm", "--turning")


def test_on_the_run_without_a_terminal_takes_a_yes() -> None:
    output = refused(5, *ON_THE_RUN)
    assert "a hoist falls" in output
    assert "--yes says that this is meant" in output
    error = refused(6, *ON_THE_RUN, "--yes")
    assert "The motor is at rest" in error
    assert "Sent by this command: CMD = 16#0007" in error, "its stop"


def test_the_time_out_of_each_port_counts() -> None:
    output = refused(1, "prove", "sim:powerdrive", "-p", "powerdrive", "--arm")
    assert "15.07 is Off and 11.63 is Off: the drive does not notice a dead line" in output
    with tcp_line("powerdrive@1", "--set", "11.63=5", "--any-settings") as line:
        reported = ended(1, "prove", line, "-p", "powerdrive", "--arm")
    # the simulated drive is asked by its module, which has another timeout
    assert "DID NOT REACT to 1.5 s of silence; set are 0.5 s" in reported.stdout
