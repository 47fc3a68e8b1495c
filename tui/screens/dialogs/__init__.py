"""Dialogs: each opens over a screen and returns an answer to it."""
