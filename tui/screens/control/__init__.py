"""Control: who commands the drive."""
