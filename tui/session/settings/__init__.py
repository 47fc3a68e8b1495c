"""Settings of a drive: the editor, writing of staged edits, restoring, EEPROM."""
