"""Errors about drives, profiles and values; their texts are for the person at the panel."""


class DriveError(Exception):
    """An error in a drive's description or a value; the text says what to do."""


class ProfileError(DriveError):
    """A profile cannot be used; the text names the file, the place and the fault."""


class UnknownProfile(DriveError):
    """No profile has the wanted id."""


class UnknownParameter(DriveError):
    """A profile has no parameter with the typed code, number or address."""


class ValueRefused(DriveError):
    """A typed value cannot be held by the parameter: out of range, unknown name, no number."""


class UnitRefused(ValueRefused):
    """A typed value in a unit that cannot be converted to the parameter's unit."""
