"""Files of acceptance tests: examples, every kind of fault with its line and key, the schema."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.sources import ROOT
from tui.cli.derived import acceptance_schema
from tui.drive.profile import library
from tui.session.acceptance.plan import longest_motion, planned_motions
from tui.session.acceptance.step_file import AcceptanceFileError, read_test
from tui.session.acceptance.steps import STEP_KINDS, moves_motor

EXAMPLES = ROOT / "docs" / "acceptance"
HEAD = 'format = 1\nname = "T"\nprofile = "atv312"\n'


def faults(folder: Path, steps: str, head: str = HEAD) -> list[str]:
    """The faults of a file, without its path."""
    path = folder / "t.toml"
    path.write_text(head + steps, "utf-8")
    with pytest.raises(AcceptanceFileError) as caught:
        read_test(path)
    return [line.replace(f"{path}:", "") for line in str(caught.value).splitlines()]


@pytest.mark.parametrize("profile", [listing.id for listing in library.listings()])
def test_each_family_has_an_example(profile: str) -> None:
    test = read_test(EXAMPLES / f"{profile}.toml")
    assert test.profile.id == profile
    kinds = {step.kind for step in test.steps}
    assert {"settings", "direction", "stop", "communication-loss", "reset"} <= kinds
    if test.profile.quantity("output_frequency") is not None:
        assert kinds == set(STEP_KINDS)
    assert longest_motion(test) > 0
    planned = planned_motions(test)
    for number, step in enumerate(test.steps, start=1):
        shown = any(line.startswith(f"Step {number}: ") for line in planned)
        assert shown == (moves_motor(step) or step.kind == "communication-loss")


def test_schema_of_the_examples_is_up_to_date() -> None:
    assert (EXAMPLES / "acceptance.schema.json").read_text("utf-8") == acceptance_schema()


def step(text: str) -> str:
    return f"\n[[steps]]\n{text}\n"


FAULTS: dict[str, tuple[str, str]] = {
    "no steps": ("", "1: the test has no [[steps]]."),
    "no kind": (step('name = "x"'), "5: step 1, kind: the field `kind` is missing. Allowed: "),
    "kind": (step('kind = "ramps"'), "6: step 1, kind: 'ramps' is not a kind. Allowed: settings,"),
    "field": (
        step('kind = "ramp"\nhz = 50\nups = 3'),
        "8: step 1, ups: `ups` is not a field of this table; did you mean up?",
    ),
    "text for a number": (
        step('kind = "ramp"\nhz = "50"\nup = 3'),
        "7: step 1, hz: must be a number, not a text; allowed is 0.1 to 1000.",
    ),
    "no number": (
        step('kind = "ramp"\nhz = nan\nup = 3'),
        "7: step 1, hz: must be a finite number, not nan; allowed is 0.1 to 1000.",
    ),
    "endless": (
        step('kind = "direction"\nhz = 5\nseconds = inf'),
        "8: step 1, seconds: must be a finite number, not inf; allowed is 0.1 to 3600.",
    ),
    "too fast": (
        step('kind = "ramp"\nhz = 5000\nup = 3'),
        "7: step 1, hz: must be <= 1000, not 5000; allowed is 0.1 to 1000.",
    ),
    "no reference": (
        step('kind = "stop"\nmax = 3'),
        "6: step 1, kind: the field `hz` is missing: the reference in Hz.",
    ),
    "no maximum": (step('kind = "stop"\nhz = 30'), "5: step 1: the field `max` is missing: "),
    "no ramp": (step('kind = "ramp"\nhz = 30'), "6: step 1, kind: a ramp needs `up`, `down` or"),
    "stop of another family": (
        step('kind = "stop"\nhz = 30\nmax = 2\nmethod = "emergency-stop"'),
        "9: step 1, method: 'emergency-stop' is not a stop of Altivar 312. It has stop,",
    ),
    "no stop": (
        step('kind = "stop"\nhz = 30\nmax = 2\nmethod = "forward"'),
        "9: step 1, method: 'forward' is not a stop of Altivar 312.",
    ),
    "stop limits": (
        step('kind = "stop"\nhz = 30\nmin = 3\nmax = 2'),
        "8: step 1, min: 3 is more than max = 2.",
    ),
    "above the limit": (
        step('kind = "limit"\nover = 10'),
        "7: step 1, over: must be <= 3, not 10; allowed is 0.5 to 3.",
    ),
    "limit with a reference": (
        step('kind = "limit"\nhz = 60'),
        "7: step 1, hz: this step runs at the high speed of the drive; delete hz.",
    ),
    "unknown value": (
        step('kind = "speeds"\nhz = 50\nlimits = { motor_voltage = { max = 400, unit = "V" } }'),
        "8: step 1, limits: 'motor_voltage' is not a value of Altivar 312. It has output_freq",
    ),
    "impossible unit": (
        step('kind = "speeds"\nhz = 50\nlimits = { motor_current = { max = 4, unit = "kW" } }'),
        "8: step 1, limits: motor_current is in A here, not in 'kW'",
    ),
    "no unit": (
        step('kind = "speeds"\nhz = 50\nlimits = { motor_current = { max = 4 } }'),
        "8: step 1, limits, motor_current: the field `unit` is missing: ",
    ),
    "unknown code": (
        step('kind = "settings"\nvalues = { XYZ = "3" }'),
        "7: step 1, values: 'XYZ' is not a parameter of Altivar 312.",
    ),
    "nothing to compare": (
        step('kind = "settings"'),
        "6: step 1, kind: name a `file` or `values`.",
    ),
    "no set": (
        step('kind = "settings"\nfile = "gone.toml"'),
        "7: step 1, file: ",
    ),
    "reaction": (
        step('kind = "communication-loss"\ntimeout = 2\nreaction = "Stops"'),
        "8: step 1, reaction: 'Stops' is not a reaction of Altivar 312. It has Ignored,",
    ),
    "reference at standstill": (
        step('kind = "communication-loss"\ntimeout = 2\nhz = 20'),
        "8: step 1, hz: the motor is at standstill in this step; delete hz,",
    ),
    "second step": (
        step('kind = "reset"') + step('kind = "reset"\nhz = 5'),
        "10: step 2, hz: `hz` is not a field of this table.",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_reported_with_line_and_key(name: str, tmp_path: Path) -> None:
    steps, expected = FAULTS[name]
    (found,) = faults(tmp_path, steps)
    assert found.startswith(expected), found


def test_faults_of_the_head_are_reported_with_those_of_the_steps(tmp_path: Path) -> None:
    found = faults(tmp_path, step('kind = "x"'), 'format = 2\nname = 3\nprofil = "atv312"\n')
    texts = "\n".join(found)
    for part in ("1: format: ", "2: name: ", "3: profil: ", "the field `profile` is miss", "'x'"):
        assert part in texts
    assert len(found) == 5


def test_profile_that_does_not_exist_is_reported(tmp_path: Path) -> None:
    head = HEAD.replace("atv312", "atv313")
    (found,) = faults(tmp_path, step('kind = "reset"'), head)
    assert found.startswith("3: profile: ")


def test_set_of_another_family_is_refused(tmp_path: Path) -> None:
    (tmp_path / "set.toml").write_text(
        '[set]\nformat = 1\nprofile = "atv71"\nparameters = 0\n\n[end]\nparameters = 0\n'
    )
    (found,) = faults(tmp_path, step('kind = "settings"\nfile = "set.toml"'))
    assert found == "7: step 1, file: set.toml is a set of atv71, not of atv312."


@pytest.mark.parametrize("content", [b"a = ", b"\xff", b"x = [[[["])
def test_file_that_is_no_toml_is_reported(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "t.toml"
    path.write_bytes(content)
    with pytest.raises(AcceptanceFileError, match=r"t\.toml"):
        read_test(path)


def test_family_without_a_scale_is_refused_what_it_cannot_do(tmp_path: Path) -> None:
    head = HEAD.replace("atv312", "powerdrive")
    expected = {
        'kind = "direction"': "reports no direction: the field `turns` is missing",
        'kind = "direction"\nhz = 5\nturns = "left"': "gives Powerdrive no reference in Hz",
        'kind = "speeds"\nhz = 50': "has no output frequency that Drive Panel can read",
        'kind = "limit"': "has no output frequency that Drive Panel can read",
    }
    for text, fault in expected.items():
        assert fault in faults(tmp_path, step(text), head)[0]
