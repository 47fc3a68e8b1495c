"""What a person has taught of one drive: kept with it, and used from then on."""
