"""Errors about drives, their profiles and their values, in words for the person at the panel."""


class DriveError(Exception):
    """Something about a drive's description or a value is wrong; the text says what to do."""


class ProfileError(DriveError):
    """A profile cannot be used; the text names the file, the place and the fault."""


class UnknownProfile(DriveError):
    """No profile has the wanted id."""


class UnknownParameter(DriveError):
    """A profile has no parameter with the typed code, number or address."""


class ValueRefused(DriveError):
    """A typed value cannot be held by the parameter: out of range, unknown name, no number."""


class UnitRefused(ValueRefused):
    """A typed value in a unit that nothing known leads to the parameter's own from."""
