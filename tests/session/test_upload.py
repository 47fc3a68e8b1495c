"""Reading all parameters of simulated drives, through lost replies and a lost line."""

from __future__ import annotations

import pytest

from tests.session.sets_bench import FAMILIES, bench
from tests.sweeps import kept
from tui.bus.errors import LineError
from tui.drive.profile import library
from tui.drive.settings.parameter_set import dump_set
from tui.drive.settings.set_file import load_set
from tui.session.read.upload import Upload, readable_codes, setting_codes
from tui.simulator import FaultRates


@pytest.mark.parametrize("family", kept(FAMILIES, "atv21", "atv31", "powerdrive"))
@pytest.mark.sweep
async def test_every_readable_parameter_is_read_correctly(family: str) -> None:
    with bench(family) as made:
        reported: list[tuple[int, int]] = []
        upload = Upload(made.session, progress=lambda done, of: reported.append((done, of)))
        await upload.run()
        codes = readable_codes(made.profile)
        assert upload.done
        assert reported[-1] == (len(codes), len(codes))
        assert reported == sorted(reported)
        values = upload.parameter_set()
        assert set(values.raws) == set(codes)
        assert values.absent == {}
        for code in setting_codes(made.profile):
            assert values.raws[code] == made.drive.raw(code), code
        text = dump_set(made.profile, values)
        assert load_set(text, "f", library.load).raws == values.raws
        requests = sum(frame.direction == "out" for frame in made.session.line.trace)
        single = made.profile.data.reading.single_words_only
        assert single or requests < len(codes)


async def test_refused_parameter_is_absent_with_reason() -> None:
    with bench("atv71", protects=frozenset({"ACC", "NMA1"})) as made:
        upload = Upload(made.session)
        await upload.run()
        absent = upload.parameter_set().absent
        assert set(absent) == {"ACC", "NMA1"}
        assert all("exception 2" in why for why in absent.values())
        assert upload.retrying.lacking == {"ACC", "NMA1"}


async def test_upload_continues_after_a_lost_line() -> None:
    with bench("atv31") as made:
        cut = [False]

        def progress(done: int, of: int) -> None:
            if done > of // 2 and not cut[0]:
                cut[0] = True
                made.lose_line()

        upload = Upload(made.session, progress=progress)
        with pytest.raises(LineError):
            await upload.run()
        half = len(upload.left)
        assert 0 < half < len(upload.codes)
        before = dict(upload.retrying.raws)
        made.regain_line()
        await upload.run()
        assert upload.done
        assert {code: upload.retrying.raws[code] for code in before} == before


async def test_lost_and_damaged_replies_are_requested_again() -> None:
    with bench("atv312", faults=FaultRates(lost=0.02, corrupted=0.02)) as made:
        upload = Upload(made.session)
        await upload.run()
        assert upload.done
        for code in setting_codes(made.profile):
            assert upload.retrying.raws[code] == made.drive.raw(code)
