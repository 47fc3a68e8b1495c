"""Reading parameters: planned requests, retries after a lost reply, uploads of a whole drive."""
