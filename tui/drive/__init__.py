"""Model of a drive: profile, parameters, values, words and state chart; no line, no screen."""
