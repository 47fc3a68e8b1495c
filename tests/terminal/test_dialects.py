"""Keys from the bytes of terminals, whole and cut anywhere."""

from __future__ import annotations

import re
import string
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from textual._ansi_sequences import ANSI_SEQUENCES_KEYS, IGNORE_SEQUENCE
from textual._xterm_parser import XTermParser

from tests.limits import BURST_GAP
from tui.terminal.dialects import ESCAPE_DELAY, SEQUENCE_WITHIN, Tokenizer
from tui.terminal.tokens import KeyToken, Paste, Report, Token

from .dialect_tables import DIALECTS, REPLIES, REPORTS, SHIFTED_AND_MORE

STOPS = {"f9", "f12"}
GAPS = [0.0, 0.02, BURST_GAP + 0.01, ESCAPE_DELAY + 0.01, 0.9]
"""Seconds between the two halves of a sequence."""
AFTERWARDS = 10.0
FUNCTION_KEYS = [
    (keys[number - 1], f"f{number}") for keys in DIALECTS.values() for number in range(1, 13)
]


def cuts(text: str, most: int = 2) -> Iterator[list[str]]:
    """Every way to read a text in one to three reads."""
    for count in range(most + 1):
        for places in combinations(range(1, len(text)), count):
            bounds = [0, *places, len(text)]
            yield [text[a:b] for a, b in pairwise(bounds)]


def tokens(reads: Sequence[str], gap: float = 0.0, *, mouse: bool = False) -> list[Token]:
    """Result of reads with pauses of this many seconds, and the time when all that waited is
    delivered.
    """
    tokenizer, found, now = Tokenizer(mouse=mouse), list[Token](), 0.0
    for read in reads:
        found += tokenizer.tick(now)
        found += tokenizer.feed(read, now)
        now += gap
    found += tokenizer.tick(now + AFTERWARDS)
    assert tokenizer.deadline is None
    return found


def names(found: Sequence[Token]) -> list[str]:
    assert not [token for token in found if isinstance(token, Paste | Report)]
    return [token.name for token in found if isinstance(token, KeyToken)]


def test_function_key_in_one_read_is_that_key_or_none() -> None:
    for sequence, key in FUNCTION_KEYS:
        found = names(tokens([sequence]))
        assert found == [key] or (key not in STOPS and found == []), (sequence, key)


@pytest.mark.parametrize("gap", GAPS)
def test_function_key_in_several_reads_is_that_key_or_none(gap: float) -> None:
    for sequence, key in FUNCTION_KEYS:
        for reads in cuts(sequence):
            # an ESC without a following byte in time is Escape, whatever follows later
            late = ["escape"] if gap > ESCAPE_DELAY and reads[0] == "\x1b" else []
            found = names(tokens(reads, gap))
            assert found == [*late, key] or (key not in STOPS and found == late), (key, reads)


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("report", ["\x1b[12;40R", "\x1b[?2026;2$y", *REPLIES.values()])
def test_report_between_halves_of_a_key_is_separate(report: str, gap: float) -> None:
    """A multiplexer reports where the cursor is while the other half is still on its way to it."""
    for sequence, key in FUNCTION_KEYS:
        for first, rest in (each for each in cuts(sequence) if len(each) == 2):
            tokenizer, found = Tokenizer(), list[Token]()
            for number, read in enumerate((first, report, rest)):
                found += tokenizer.tick(number * gap / 2)
                found += tokenizer.feed(read, number * gap / 2)
            found += tokenizer.tick(AFTERWARDS)
            keys = [token.name for token in found if isinstance(token, KeyToken)]
            keys = keys[1:] if first == "\x1b" and keys[:1] == ["escape"] else keys
            assert keys in ([key], [] if key not in STOPS else [key]), (key, first, found)


@pytest.mark.parametrize("report", ["\x1b[12;40R", "\x1b[?2026;2$y", "\x1b[?62;22c"])
@pytest.mark.parametrize("began", ["\x1b[", "\x1bO", "\x1b[2"])
@pytest.mark.parametrize("late", [True, False])
def test_reports_do_not_keep_a_sequence_waiting(report: str, began: str, late: bool) -> None:
    """Esc and `[` typed one after the other: the panel asks the terminal twice a second."""
    tokenizer, found, now = Tokenizer(), list[Token](), 0.0
    pieces = [began[0], began[1:]] if late else [began]
    for piece in pieces:
        found += [*tokenizer.tick(now), *tokenizer.feed(piece, now)]
        now += 0.5
    for _ in range(4):
        found += [*tokenizer.tick(now), *tokenizer.feed(report, now)]
        now += 0.5
    found += [*tokenizer.tick(now), *tokenizer.feed("2", now)]
    keys = [token.name for token in found if isinstance(token, KeyToken)]
    assert keys == [*(["escape"] if late else []), "2"]


@pytest.mark.parametrize("dialect", SHIFTED_AND_MORE)
@pytest.mark.parametrize("gap", GAPS)
def test_other_keys_of_the_dialects_type_nothing_and_stop_nothing(dialect: str, gap: float) -> None:
    for sequence in SHIFTED_AND_MORE[dialect]:
        if sequence == "\x1b[O":
            continue
        for reads in cuts(sequence, 1):
            for token in tokens(reads, gap):
                if isinstance(token, KeyToken):
                    assert token.character in (None, "\x1b"), (reads, token)
                    assert token.name not in STOPS | {"space", "enter"}, (reads, token)


@pytest.mark.parametrize("sequence", REPORTS.values(), ids=REPORTS)
@pytest.mark.parametrize("gap", GAPS)
def test_report_is_passed_on_and_is_not_a_key(sequence: str, gap: float) -> None:
    for reads in cuts(sequence):
        found = [token for token in tokens(reads, gap) if token != _escape(token)]
        assert found == [Report(sequence)], reads


def _escape(token: Token) -> Token | None:
    return token if isinstance(token, KeyToken) and token.name == "escape" else None


@pytest.mark.parametrize("sequence", REPLIES.values(), ids=REPLIES)
def test_other_replies_are_dropped(sequence: str) -> None:
    for reads in cuts(sequence):
        for gap in (0.0, 0.02):
            assert tokens(reads, gap) == [], (reads, gap)


def test_esc_bracket_m_without_mouse_is_complete_without_a_space() -> None:
    assert names(tokens(["\x1b[M   "])) == ["f1", "space", "space", "space"]
    assert tokens(["\x1b[M !!"], mouse=True) == [Report("\x1b[M !!")]
    assert tokens(["\x1b[<0;3;4M"], mouse=True) == [Report("\x1b[<0;3;4M")]
    assert tokens(["\x1b[<0;3;4M"]) == []


@pytest.mark.parametrize(
    "begin", ["\x1b", "\x1b[", "\x1b[2", "\x1bO", "\x1b[[", "\x1b\x1b[", "\x9b"]
)
@pytest.mark.parametrize("gap", GAPS)
def test_space_stops_inside_any_sequence(begin: str, gap: float) -> None:
    assert names(tokens([begin, " "], gap))[-1:] == ["space"]
    assert names(tokens([begin + " "]))[-1:] == ["space"]


@pytest.mark.parametrize("begin", ["\x1b[200~text", "\x1b]11;rgb:", "\x1bP>|"])
def test_stop_key_is_not_lost_with_a_missing_terminator(begin: str) -> None:
    for key in (" ", "\x1b[24~", "\x1bO[", "\x1b[U"):
        found = tokens([begin, key], BURST_GAP + 0.01)
        assert next(t.name for t in found if isinstance(t, KeyToken)) in STOPS | {"space"}, key
    held_down = tokens([begin, *[" "] * 5], BURST_GAP + 0.01)
    assert sum(isinstance(token, KeyToken) for token in held_down) == 5


STOP_SEQUENCES = {
    " ": "space",
    **{keys[number - 1]: f"f{number}" for keys in DIALECTS.values() for number in (9, 12)},
}
SENT_BEFORE = [*REPLIES.values(), *REPORTS.values(), "\x9d11;rgb:0/1\x9c", "\x901$r2 q\x9c"]


@pytest.mark.parametrize("reply", SENT_BEFORE)
def test_stop_key_after_a_cut_or_incomplete_reply_stops(reply: str) -> None:
    """A lost or late backslash at the end of a report: ESC and the ESC of F12 form no key."""
    for kept in sorted({len(reply) - lost for lost in range(4)} | {1, 2, 3}):
        for stop, key in STOP_SEQUENCES.items():
            whole = reply[:kept] + stop
            for reads in cuts(whole, 1):
                for gap in GAPS:
                    found = [t.name for t in tokens(reads, gap) if isinstance(t, KeyToken)]
                    assert key in found, (reads, gap, found)


@given(
    st.sampled_from([*SENT_BEFORE, "\x1b[M"]),
    st.sampled_from(sorted(STOP_SEQUENCES)),
    st.sampled_from([gap for gap in GAPS if gap < SEQUENCE_WITHIN / 2]),
    st.booleans(),
    st.data(),
)
def test_stop_key_after_any_part_of_a_reply_stops(
    reply: str, stop: str, gap: float, mouse: bool, data: st.DataObject
) -> None:
    if mouse and stop == " ":
        return  # in the report of a mouse a space is a button
    whole = reply[: data.draw(st.integers(0, len(reply)))] + stop
    places = sorted(data.draw(st.sets(st.integers(1, len(whole)), max_size=4)) | {len(whole)})
    reads = [whole[a:b] for a, b in pairwise([0, *places])]
    found = [t.name for t in tokens(reads, gap, mouse=mouse) if isinstance(t, KeyToken)]
    assert STOP_SEQUENCES[stop] in found, reads


def test_stop_key_in_eight_bits_after_the_beginning_of_a_mouse_report_stops() -> None:
    assert names(tokens(["\x1b[M\x9b20~"], mouse=True)) == ["f9"]
    assert names(tokens(["\x1b[M !\x9b20~"], mouse=True)) == ["f9"]


def test_reply_that_loses_its_backslash_gives_no_alt_key() -> None:
    assert names(tokens(["\x1b]11;rgb:0/1\x1b\x1b[24~"])) == ["f12"]
    assert names(tokens(["\x1b]11;rgb:0/1\x1b", "\\", "\x1b[24~"], 0.06)) == ["f12"]
    assert names(tokens(["\x1b]11;rgb:0/1\x1b\x1b[A"])) == ["alt+up"]  # nothing moves by it


def test_unterminated_reply_releases_its_space_late() -> None:
    assert names(tokens(["\x1b]11; r"])) == ["space"]
    assert names(tokens(["\x1b]11;" + " r" * 3000]))[0] == "space"


@pytest.mark.parametrize("rest", ["[", "[2", "[24", "[1;5", "O", "[200"])
def test_bytes_after_a_lone_escape_are_no_keys_until_the_final_byte(rest: str) -> None:
    for after in (0.1, 0.5, 0.95):
        tokenizer = Tokenizer()
        assert tokenizer.feed("\x1b", 0.0) == []
        assert names(tokenizer.tick(ESCAPE_DELAY)) == ["escape"]
        assert tokenizer.feed(rest, ESCAPE_DELAY + after) == []
        assert tokenizer.feed("r", ESCAPE_DELAY + after + 0.5) == []
        assert names(tokenizer.feed("r", ESCAPE_DELAY + after + 0.5)) == ["r"]


def test_bracket_long_after_escape_is_a_key() -> None:
    tokenizer = Tokenizer()
    tokenizer.feed("\x1b", 0.0)
    assert names(tokenizer.tick(ESCAPE_DELAY)) == ["escape"]
    late = ESCAPE_DELAY + SEQUENCE_WITHIN + 0.01
    assert names(tokenizer.feed("[", late)) == ["left_square_bracket"]


def test_lone_escape_is_delivered_late_with_its_read_time() -> None:
    tokenizer = Tokenizer(escape_delay=0.2)
    tokenizer.feed("\x1b", 5.0, "then")
    assert tokenizer.deadline == pytest.approx(5.2)
    assert tokenizer.pending == 5.0
    assert tokenizer.tick(5.19) == []
    assert tokenizer.tick(5.21) == [KeyToken("escape", "\x1b", 5.0, 5.0, "then")]


def test_split_key_has_its_begin_and_end_times() -> None:
    tokenizer = Tokenizer()
    tokenizer.feed("\x1b[", 1.0, "first")
    assert tokenizer.feed("A", 1.5, "second") == [KeyToken("up", None, 1.0, 1.5, "first")]


def test_alt_with_a_key_is_never_that_key_alone() -> None:
    # O, [, ] and P begin something else
    for letter in set(string.ascii_letters + string.digits + "\r\n+-/?") - {"O", "P"}:
        for reads in (["\x1b" + letter], ["\x1b", letter]):
            (found,) = tokens(reads, 0.02)
            assert isinstance(found, KeyToken)
            assert found.name not in ("enter", letter)
            assert found.character is None or found.character not in string.printable


def test_escape_twice_is_two_keys_and_alt_with_an_arrow_is_one() -> None:
    assert names(tokens(["\x1b", "\x1b"], 0.06)) == ["escape", "escape"]
    assert names(tokens(["\x1b\x1b"])) == ["escape", "escape"]
    assert names(tokens(["\x1b\x1b[A"])) == ["alt+up"]
    assert names(tokens(["\x1b", "\x1b[A"], 0.06)) == ["escape", "up"]
    assert names(tokens(["\x1b\x1b[24~"])) == ["f12"]


TEXTUALS_OWN = {
    sequence: value
    for sequence, value in ANSI_SEQUENCES_KEYS.items()
    if len(sequence) == 1 or (sequence[:2] in ("\x1b[", "\x1bO") and sequence[2:] != "~")
}
OTHER_HERE = {
    "\x1b": "begins a sequence",
    "\x9b": "ESC [ in eight bits",
    "\x1b[1;2R": "a report of the cursor, for Textual too",
    "\x1b[1;5R": "a report",
    "\x1b[1;6R": "a report",
    "\x1b[25~": "Textual's own parser takes the number for a character",
    "\x1b[26~": "",
    "\x1b[28~": "",
    "\x1b[29~": "",
    "\x1b[31~": "",
    "\x1b[32~": "with Textual's own parser Shift and F8 of a PuTTY is a Space",
    "\x1b[33~": "",
    "\x1b[34~": "",
    "\x1b[62~": "",
    "\x1b[63~": "",
    "\x1b[5A": "",
    "\x1b[5B": "",
    "\x1b[5C": "",
    "\x1b[5D": "",
    "\x1b[167;5u": "",
}


def test_every_other_key_has_its_textual_name() -> None:
    parser, compared = XTermParser(), 0
    for sequence, value in TEXTUALS_OWN.items():
        theirs = [(k.key, k.character) for k in parser._sequence_to_key_events(sequence)]
        if sequence in OTHER_HERE or value is IGNORE_SEQUENCE or len(theirs) > 1:
            continue
        if sequence[2:3] == "1" and sequence[-1] in "pqrstuvwxy":
            continue  # digits with Ctrl, in mintty alone
        (ours,) = tokens([sequence])
        assert isinstance(ours, KeyToken)
        expected = ("enter", "\r") if sequence == "\x1bOM" else theirs[0]
        assert (ours.name, ours.character) == expected, sequence
        compared += 1
    assert compared > 150


@pytest.mark.parametrize(
    ("sent", "key"),
    [
        ("\x7f", "backspace"),
        ("\x08", "backspace"),
        ("\x10", "ctrl+p"),
        ("\x13", "ctrl+s"),
        ("\x0f", "ctrl+o"),
        ("\x0c", "ctrl+l"),
        ("\x11", "ctrl+q"),
        ("\t", "tab"),
        ("\x1b[Z", "shift+tab"),
        ("\x1b[H", "home"),
        ("\x1bOH", "home"),
        ("\x1b[1~", "home"),
        ("\x1b[F", "end"),
        ("\x1b[4~", "end"),
        ("\x1b[3~", "delete"),
        ("\x1b[5~", "pageup"),
        ("\x1b[6~", "pagedown"),
        ("\x1b[1;5A", "ctrl+up"),
        ("\x1b[1;2C", "shift+right"),
        ("\x1b[1;3D", "alt+left"),
        ("\x1b[1;129A", "up"),
        ("\x1b[24;65~", "f12"),
        ("\x1b[32u", "space"),
        ("\x1b[32;1;32u", "space"),
        ("\x1b[32;2u", "space"),
        ("\x1b[27;2;32~", "space"),
        ("\x1b[114u", "r"),
        ("\x1b[114;5u", "ctrl+r"),
        ("\x1b[97:65;2u", "A"),
        ("\x1b[13u", "enter"),
        ("\x1b[27u", "escape"),
        ("\r", "enter"),
        ("é", "é"),
        ("?", "question_mark"),
        (" ", "space"),
    ],
)
def test_panel_keys_are_recognized(sent: str, key: str) -> None:
    assert names(tokens([sent])) == [key]


def test_lock_keys_change_no_key() -> None:
    for sent in ("\x1b[114;65u", "\x1b[114;129u", "\x1b[114;193:1;114u"):
        (found,) = tokens([sent])
        assert isinstance(found, KeyToken)
        assert (found.name, found.character) == ("r", "r"), sent


@pytest.mark.parametrize("sent", ["\x1b[114;1:3u", "\x1b[24;1:3~", "\x1b[9999999u", "\x1b[55296u"])
def test_released_or_unknown_key_is_ignored(sent: str) -> None:
    assert tokens([sent]) == []


@given(st.text(max_size=40).filter(lambda text: "\x1b" not in text), st.floats(0, 0.9))
def test_paste_is_one_token_wherever_it_is_cut(text: str, gap: float) -> None:
    expected = text.replace("\x00", "").encode(errors="replace").decode()
    for reads in cuts(f"\x1b[200~{text}\x1b[201~", 1):
        if gap >= ESCAPE_DELAY and reads[0] == "\x1b":
            continue
        (found,) = tokens(reads, gap)
        assert isinstance(found, Paste)
        assert found.text == expected, reads


@pytest.mark.parametrize("end", ["", *("\x1b[201~"[:n] for n in range(1, 6))])
def test_unterminated_paste_ends_after_a_while_without_typing(end: str) -> None:
    tokenizer = Tokenizer()
    assert tokenizer.feed(f"\x1b[200~some text{end}", 0.0) == []
    assert tokenizer.tick(SEQUENCE_WITHIN - 0.01) == []
    assert tokenizer.tick(SEQUENCE_WITHIN) == [Paste("some text", 0.0)]
    assert tokenizer.feed("\x1b[201~"[len(end) :] if end else "", SEQUENCE_WITHIN + 0.5) == []
    assert names(tokenizer.feed("r", SEQUENCE_WITHIN + 0.5)) == ["r"]


ACTS = {"r", "v", "enter"}
TYPED = (string.digits + string.ascii_letters + string.punctuation).translate({92: None, 126: None})
"""Typed input, except for ends of replies and brackets of pastes."""
SEQUENCES = st.builds(
    lambda begin, middle, final: begin + middle + final,
    st.sampled_from(["\x1b[", "\x1bO", "\x1b[[", "\x1b\x1b[", "\x9b"]),
    st.text("0123456789;:<=>?!\"#$%&'()*+,-./", max_size=8),
    st.sampled_from([chr(code) for code in range(0x40, 0x7F)]),
)


def _is_more_than_one_sequence(sequence: str) -> bool:
    """True if the key was sent by its character number, is Enter of the keypad, or is two keys."""
    body = sequence.replace("\x1b\x1b[", "\x1b[").replace("\x9b", "\x1b[")
    rxvt_reply = re.match(r"\x1b\[\d{1,2}\$.", body)
    return bool(body.endswith("u") or body.startswith("\x1b[27;") or body == "\x1bOM" or rxvt_reply)


@given(SEQUENCES, st.sampled_from(GAPS), st.data())
def test_no_sequence_gives_a_key_that_acts(sequence: str, gap: float, data: st.DataObject) -> None:
    if _is_more_than_one_sequence(sequence):
        return
    cut = data.draw(st.integers(1, len(sequence)))
    found = tokens([sequence[:cut], sequence[cut:]], gap)
    typed = [token for token in found if isinstance(token, KeyToken)]
    assert not ACTS & {token.name for token in typed}
    # a keypad may type a digit; nothing else is typed out of a sequence
    assert {token.character for token in typed} <= {None, "\x1b", *"0123456789*+-./"}


@given(st.lists(st.tuples(st.binary(max_size=30), st.floats(0, 2)), max_size=8), st.booleans())
def test_random_bytes_never_crash_and_always_end(
    reads: list[tuple[bytes, float]], mouse: bool
) -> None:
    tokenizer, now, found = Tokenizer(mouse=mouse), 0.0, list[Token]()
    for read, gap in reads:
        now += gap
        found += tokenizer.feed(read.decode("utf-8", "surrogateescape"), now)
    found += tokenizer.tick(now + AFTERWARDS)
    found += tokenizer.tick(now + 2 * AFTERWARDS)
    assert tokenizer.deadline is None
    keys = [token for token in found if isinstance(token, KeyToken)]
    times = [key.at for key in keys]
    assert times == sorted(times)
    assert all(key.began <= key.at for key in keys)


@given(st.text(TYPED + " \r\t\x1b[O", max_size=30), st.sampled_from(GAPS), st.data())
def test_space_is_never_lost(text: str, gap: float, data: st.DataObject) -> None:
    cut = data.draw(st.integers(0, len(text)))
    found = tokens([text[:cut], text[cut:]], gap)
    spaces = [token for token in found if isinstance(token, KeyToken) and token.name == "space"]
    assert bool(spaces) == (" " in text)
