"""Errors about drives, profiles and values; their texts are for the person at the panel."""


class DriveError(Exception):
    """An error in a drive's description or a value; the text says what to do."""


class ProfileError(DriveError):
    """A profile cannot be used; the text names the file, the place and the fault."""


class UnknownProfile(DriveError):
    """There is no profile with this id."""


class UnknownParameter(DriveError):
    """A profile has no parameter with the typed code, number or address."""


class ValueRefused(DriveError):
    """The parameter cannot hold a typed value: out of range, unknown name, or not a number."""


class ValueUndetermined(ValueRefused):
    """A typed value that cannot be judged: what it depends on was not read, or has changed."""
