"""Recordings of named codes, always or around triggers."""
