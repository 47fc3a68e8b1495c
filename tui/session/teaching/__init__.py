"""Taught facts about one drive: kept with it, and used from then on."""
