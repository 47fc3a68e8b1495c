"""Commanding a drive from any of its screens: arming, commands, and what became of them."""
