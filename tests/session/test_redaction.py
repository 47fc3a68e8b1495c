"""Names and passwords are removed from texts, and everything else stays."""

from __future__ import annotations

import pytest

from tui.session.bundle.redaction import HOME, HOST, SECRET, USER, Names, Redaction, local_names

PEOPLE = "/".join(("", "home"))
"""Split so that no test of the project takes it for a path on this machine."""
NAMES = Names(
    users=frozenset({"jdoe", "Jane Doe", "root", "x"}),
    hosts=frozenset({"Press7-PC", "localhost"}),
    homes=frozenset({"/srv/people/jd/", "/"}),
    secrets=frozenset({"hunter2!", "abc"}),
)


def cleaned(*texts: str) -> list[str]:
    """The texts after all of them were learned."""
    redaction = Redaction(NAMES)
    for text in texts:
        redaction.learn(text)
    return [redaction.clean(text) for text in texts]


CLEAN = {
    "a user": ("the panel of jdoe, on pts/3", f"the panel of {USER}, on pts/3"),
    "in any case": ("JDOE_1 and JANE DOE", f"{USER}_1 and {USER}"),
    "a short name in a word": ("the word ajdoeb", "the word ajdoeb"),
    "a common name": ("root at localhost", "root at localhost"),
    "a host": ("press7-pc: up", f"{HOST}: up"),
    "a home": ("/srv/people/jd/x.toml", f"{HOME}/x.toml"),
    "any home": (f"File '{PEOPLE}/otto/a.py'", f"File '{HOME}/a.py'"),
    "a home on Windows": (r"C:\Users\otto\a.py", rf"{HOME}\a.py"),
    "a secret": ("got hunter2! here", f"got {SECRET} here"),
    "too short a secret": ("abc", "abc"),
    "a URL": ("mqtts://me:p%40ss@10.0.0.9:8883/x", f"mqtts://{SECRET}@10.0.0.9:8883/x"),
    "an odd password": ("mqtt://me:p@s/s@10.0.0.9", f"mqtt://{SECRET}@10.0.0.9"),
    "an assignment": ("password = 'a b, c'; next", f"password = '{SECRET}'; next"),
    "a JSON pair": ('{"mqtt_password": "s3!", "a": 1}', f'{{"mqtt_password": "{SECRET}", "a": 1}}'),
    "an option": ("--mqtt-password s3cr3t --json", f"--mqtt-password {SECRET} --json"),
    "a header": ("Authorization: Bearer abcdef0123456789", f"Authorization: Bearer {SECRET}"),
    "a line": ("rtu-tcp:plc7.factory.lan:502 is lost", f"rtu-tcp:{HOST}:502 is lost"),
    "an address": ("tcp:192.168.0.10:502", "tcp:192.168.0.10:502"),
    "a value": ("ACC = { raw = 30, value = \"3.0 s\" }", "ACC = { raw = 30, value = \"3.0 s\" }"),
}  # fmt: skip


@pytest.mark.parametrize("case", CLEAN.values(), ids=CLEAN.keys())
def test_private_words_are_removed_from_a_text(case: tuple[str, str]) -> None:
    assert cleaned(case[0]) == [case[1]]


def test_name_revealed_by_one_text_is_removed_from_all() -> None:
    texts = cleaned(
        "publishing to mqtt://erna:Tr0ub4dor@broker.lan", "erna used Tr0ub4dor", "tcp:gw-3:502",
        "no answer of gw-3", f"{PEOPLE}/fritz/x", "by fritz",
    )  # fmt: skip
    for planted in ("erna", "Tr0ub4dor", "broker.lan", "gw-3", "fritz"):
        assert not any(planted in text for text in texts)


def test_secret_is_found_in_other_spellings() -> None:
    texts = cleaned("mqtt://me:p%40s%22s@10.0.0.9", 'p@s"s', 'in JSON p@s\\"s', "p%40s%22s again")
    assert texts[1:] == [SECRET, f"in JSON {SECRET}", f"{SECRET} again"]


def test_named_user_and_host_are_removed_from_all() -> None:
    texts = cleaned("Broker(host='gw', user='erna', x='y')", "erna at gw, y")
    assert texts[1] == f"{USER} at {HOST}, y"


def test_plain_word_after_password_is_not_taken_for_a_secret() -> None:
    assert cleaned("password=None", "none of them; None")[1] == "none of them; None"


def test_document_is_redacted_except_keys_and_numbers() -> None:
    redaction = Redaction(NAMES)
    found = redaction.clean({"jdoe": ["by jdoe", 1, None], "b": {"c": "Press7-PC"}})
    assert found == {"jdoe": [f"by {USER}", 1, None], "b": {"c": HOST}}
    assert redaction.counts == {USER: 1, HOST: 1}


def test_redacting_twice_changes_nothing_more() -> None:
    for text, once in CLEAN.values():
        assert cleaned(once) == [once], text


def test_names_of_this_computer_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("USER", "erna")
    monkeypatch.setenv("HOME", "/srv/erna")
    monkeypatch.setenv("DRIVEPANEL_MQTT_PASSWORD", "Tr0ub4dor")
    monkeypatch.setattr("socket.gethostname", lambda: "press7.factory.lan")
    found = local_names(["otto"])
    assert {"erna", "otto"} <= found.users
    assert {"press7.factory.lan", "press7"} <= found.hosts
    assert "/srv/erna" in found.homes
    assert "Tr0ub4dor" in found.secrets
