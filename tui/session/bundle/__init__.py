"""One file about a line for a colleague or a manufacturer, without names and passwords."""
