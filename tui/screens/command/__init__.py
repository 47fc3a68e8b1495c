"""Commanding a drive from any of its screens: arming, commands, and their results."""
