"""Reference words of a profile, listed or known by their quantity alone."""

from __future__ import annotations

from .schema import Parameter, ProfileData, Quantity, ReferenceWay
from .toml_lines import TomlPath

QUANTITY_OF_KIND: dict[str, Quantity] = {
    "frequency": "command_frequency",
    "speed": "command_speed",
}


def reference_ways(data: ProfileData) -> list[tuple[TomlPath, ReferenceWay, Parameter]]:
    """Return each reference with its place in the file and its parameter.

    Those of `[[references]]` come first. Then come parameters that are a reference by their
    quantity alone.
    """
    parameters = {parameter.code: parameter for parameter in data.parameters}
    found: list[tuple[TomlPath, ReferenceWay, Parameter]] = [
        (("references", index), way, parameters[way.parameter])
        for index, way in enumerate(data.references)
        if way.parameter in parameters
    ]
    listed = {way.parameter for way in data.references}
    for index, parameter in enumerate(data.parameters):
        for kind, quantity in QUANTITY_OF_KIND.items():
            if parameter.quantity == quantity and parameter.code not in listed:
                way = ReferenceWay(parameter=parameter.code, kind=kind)  # type: ignore[arg-type]
                found.append((("parameters", index), way, parameter))
    return found
