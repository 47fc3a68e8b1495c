"""Words that show a drive's model, from the reference in its identity."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Model

from .motor import rating_of

REFERENCE_OBJECT = 1


def model_words(profile: Profile, identity: Mapping[int, bytes]) -> dict[str, int]:
    """Raw values by code of the model parameter and the class parameter, as far as known."""
    identification = profile.data.identification
    reference = identity.get(REFERENCE_OBJECT, b"").decode("ascii", "replace")
    model = _model(identification.models, reference)
    words: dict[str, int] = {}
    if model is None:
        return words
    if identification.model_parameter:
        words[identification.model_parameter] = model.code
    if identification.class_parameter and identification.class_bit is not None:
        words[identification.class_parameter] = int(model.class_b) << identification.class_bit
    return words


def _model(models: list[Model], reference: str) -> Model | None:
    """The model with this reference, or, where models have none, with its power."""
    named = next((m for m in models if m.reference == reference), None)
    if named is not None or not reference:
        return named
    power = rating_of(reference).power
    unnamed = (m for m in models if not m.reference and m.power_kw)
    return next((m for m in unnamed if _has_power(m, power)), None)


def _has_power(model: Model, power: float) -> bool:
    """Return True if a model has this power: 0.37/0.4 kW by 50 Hz and 60 Hz motors."""
    return any(math.isclose(float(part), power) for part in model.power_kw.split("/"))
