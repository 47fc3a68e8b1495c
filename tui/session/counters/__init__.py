"""What was exchanged with a drive, as counted here and as the drive itself counts it."""
