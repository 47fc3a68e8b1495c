"""Defects of listening: frames of other programs are misread, or disturbed."""

from __future__ import annotations

from .defect import Defect

HEARING = "tests/ui/test_hearing.py"

DEFECTS = (
    Defect(
        "listener-can-write",
        "tui/bus/transport/serial_listening.py",
        "os.O_RDONLY | os.O_NOCTTY",
        "os.O_RDWR | os.O_NOCTTY",
        "A listener that should send nothing could disturb a motor of another master.",
        ("tests/bus/test_listening_line.py::test_port_is_opened_read_only",),
    ),
    Defect(
        "listener-drains",
        "tui/bus/transport/serial_listening.py",
        "termios.TCSANOW",
        "termios.TCSADRAIN",
        "Opening a port to listen waits for its output, and so affects it.",
        ("tests/line/test_listening.py::test_no_write_no_break_no_drain_reaches_the_port",),
    ),
    Defect(
        "listener-shares-the-port",
        "tui/bus/transport/serial_listening.py",
        "        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)\n",
        "",
        "Listener and master on one port take each other's bytes.",
        ("tests/bus/test_listening_line.py::test_port_is_monitored_by_one_program_at_a_time",),
    ),
    Defect(
        "listener-takes-an-owned-line",
        "tui/bus/listening_line.py",
        "if self._lock.take() or (",
        "if True or (",
        "Listening takes the replies from the panel that commands a motor.",
        ("tests/bus/test_listening_line.py::test_line_owned_by_another_drivepanel_is_refused",),
    ),
    Defect(
        "frame-cut-at-its-zero",
        "tui/wire/heard/lengths.py",
        "or due is None or any(n > len(data) for n in due):",
        "and True:",
        "A reply that ends with a zero is truncated, and its values are lost.",
        (
            "tests/wire/test_heard.py"
            "::test_a_reply_that_is_whole_without_its_last_byte_is_found_with_it",
        ),
    ),
    Defect(
        "late-reply-of-another-device",
        "tui/wire/heard/pairing.py",
        "frame.device != requested.device or frame.function",
        "frame.function",
        "A late reply of one drive is shown as the values of another.",
        ("tests/wire/test_heard.py::test_results_of_requests",),
    ),
    Defect(
        "write-again-taken-for-its-reply",
        "tui/wire/heard/pairing.py",
        "and not _repeated(requested, frame)\n",
        "\n",
        "A drive that answers nothing is reported as accepting its commands.",
        ("tests/wire/test_heard.py::test_a_write_that_is_sent_again_is_no_reply",),
    ),
    Defect(
        "second-answer-not-told",
        "tui/wire/heard/pairing.py",
        "if same and last is not None",
        "if False and last is not None",
        "Two drives at one address are not reported.",
        ("tests/session/test_listening.py::test_two_drives_at_one_address_are_reported",),
    ),
    Defect(
        "refused-write-told-as-a-value",
        "tui/session/listening/words.py",
        'if exchange.answer not in ("ok", "broadcast"):',
        'if exchange.answer == "again":',
        "A command that the drive refused is shown as active.",
        ("tests/session/test_listening.py",),
    ),
    Defect(
        "likely-told-as-sure",
        "tui/session/listening/families.py",
        'return AssumedProfile(first, "likely",',
        'return AssumedProfile(first, "identified",',
        "A guessed family is shown as one that the drive has reported.",
        ("tests/session/test_listening.py::test_likely_family_follows_from_the_replies",),
    ),
    Defect(
        "requests-feed-without-an-answer",
        "tui/session/listening/tally.py",
        "        if exchange.turnaround is not None:\n",
        "        if exchange.turnaround is None:\n            self.fed = exchange.time\n"
        "        else:\n",
        "A drive that trips for lack of requests is shown as kept alive.",
        ("tests/session/test_listening.py::test_unanswered_request_does_not_restart_the_timeout",),
    ),
    Defect(
        "pause-of-now-forgotten",
        "tui/session/listening/tally.py",
        "now - self.fed if self.fed is not None else 0.0)",
        "0.0)",
        "A master that has exited is shown as keeping its drives alive.",
        ("tests/session/test_listening.py::test_pause_in_progress_counts",),
    ),
    Defect(
        "half-a-packet-left",
        "tui/session/capture_file.py",
        "            self._file.truncate(self._size)\n",
        "",
        "A full disk leaves a capture file that no program can read.",
        ("tests/session/test_capture_file.py",),
    ),
    Defect(
        "fed-drive-left-for-listening",
        "tui/screens/hear.py",
        "if acting := watch.left_alone():",
        "if (acting := watch.left_alone()) and False:",
        "A drive trips because a person listened to the line.",
        (f"{HEARING}::test_a_drive_that_the_panel_feeds_is_not_left_alone",),
    ),
    Defect(
        "running-motor-left-for-listening",
        "tui/screens/hear.py",
        "if running := watch.under_command():",
        "if (running := watch.under_command()) and False:",
        "A motor started by the panel runs on, and the panel no longer polls or stops it.",
        (f"{HEARING}::test_why_the_panel_may_not_fall_silent",),
    ),
    Defect(
        "listening-says-it-stops",
        "tui/screens/key_dispatcher.py",
        "if self.hearing and not self.fleets:",
        "if False:",
        "A person relies on a stop key that stops nothing.",
        (f"{HEARING}::test_a_line_that_is_not_open_is_listened_to_and_given_back",),
    ),
    Defect(
        "left-for-listening-unasked",
        "tui/screens/hear.py",
        "if here.fleet.found else",
        "if False else",
        "One key ends the panel's polling of its drives.",
        (f"{HEARING}::test_drives_that_do_not_act_are_left_to_their_master_with_a_yes",),
    ),
)
