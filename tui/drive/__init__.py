"""Model of a drive: profile, parameters, values, words and state chart. No line, no screen."""
