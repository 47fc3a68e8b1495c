"""Reading: plans put into requests, read once more where a reply was lost, whole uploads."""
