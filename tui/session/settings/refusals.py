"""Why a drive refused a write, in the words of its own family, with what to do next."""

from __future__ import annotations

from tui.bus.errors import DeviceException
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter


def device_refusal(
    profile: Profile, parameter: Parameter, error: DeviceException, headline: str
) -> str:
    """Return the exception's meaning in this family, the drive's state, and the next step."""
    known = next((e for e in profile.data.exceptions if e.code == error.code), None)
    if known is None:
        message = f"exception {error.code}, which no document of this family explains"
        return f"{parameter.code}: the drive refused with {message}. The drive is {headline}."
    meaning = _sentence(known.meaning)
    next_step = _sentence(known.remedy)
    text = f"{parameter.code}: the drive refused with exception {known.code}, {known.name}."
    return f"{text} {meaning} The drive is {headline}. {next_step}".strip()


def _sentence(text: str) -> str:
    return text if not text or text.endswith(".") else f"{text}."
