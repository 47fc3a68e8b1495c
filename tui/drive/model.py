"""Model of a drive, from the drive's own code word."""

from __future__ import annotations

from collections.abc import Mapping

from .profile.profile import Profile
from .profile.schema import Model


def model_codes(profile: Profile) -> list[str]:
    """Return the codes of the words that show the model: its code word, and its class word."""
    known = profile.data.identification
    return [code for code in (known.model_parameter, known.class_parameter) if code]


def model_of(profile: Profile, raws: Mapping[str, int]) -> Model | None:
    """Return the model that raw values show; None if they show no known model.

    If two models share a code, the class bit must be known.
    """
    known = profile.data.identification
    code = raws.get(known.model_parameter)
    found = [model for model in known.models if model.code == code] if code is not None else []
    word = raws.get(known.class_parameter)
    if word is not None and known.class_bit is not None:
        class_b = bool(word >> known.class_bit & 1)
        found = [model for model in found if model.class_b == class_b]
    return found[0] if len(found) == 1 else None


def model_read(profile: Profile, raws: Mapping[str, int]) -> str:
    """Return the model that a drive reports as text; empty if it reports none."""
    model = model_of(profile, raws)
    if model is not None:
        return model_text(model)
    code = raws.get(profile.data.identification.model_parameter)
    return f"code {code}, not in the profile" if code is not None else ""


def model_text(model: Model) -> str:
    """Describe a model: reference or code, voltage, power and filter class."""
    parts = (
        model.reference or f"code {model.code}",
        f"{model.voltage} V" if model.voltage else "",
        f"{model.power_kw} kW" if model.power_kw else "",
        model.variant,
        "class B filter" if model.class_b else "",
    )
    return ", ".join(part for part in parts if part)
