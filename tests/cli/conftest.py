"""Fixtures of the tests of commands."""

from __future__ import annotations

from tests.internal_errors import no_internal_errors

__all__ = ["no_internal_errors"]
