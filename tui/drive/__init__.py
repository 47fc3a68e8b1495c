"""What a drive is: its profile, parameters, values, words and state chart; no line, no screen."""
