"""Rules that a profile's form cannot express: one subject per module, each error with its place."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..schema import ProfileData
from ..toml_lines import TomlPath
from . import (
    charts,
    commands,
    consistency,
    identification,
    limits,
    meanings,
    names,
    parameters,
    registers,
    signal_paths,
)

Finding = tuple[TomlPath, str]
"""Place of an error, and the error."""

Rules = tuple[Callable[[ProfileData], Iterator[Finding]], ...]

RULES: Rules = (
    *parameters.PARAMETER_RULES,
    *registers.REGISTER_RULES,
    *names.NAME_RULES,
    *limits.LIMIT_RULES,
    *charts.CHART_RULES,
    *commands.COMMAND_RULES,
    *meanings.MEANING_RULES,
    *consistency.CONSISTENCY_RULES,
    *signal_paths.PATH_RULES,
    *identification.IDENTIFICATION_RULES,
)

CHECKED_RULES = (*RULES, consistency.factory_choices, meanings.meanings_of_frames)
"""Rules of `profiles --check`: a profile that breaks only the further ones can still be used."""

__all__ = ["CHECKED_RULES", "RULES", "Finding", "Rules"]
