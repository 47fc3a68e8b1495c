"""Why a drive does not answer: what is seen of its line, the rung of the ladder that fails."""
