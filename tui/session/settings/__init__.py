"""Changing settings: the editor, writing what is staged, restoring, keeping in the EEPROM."""
