"""Several people before several sensors: who is who, whom to follow, a pose for each."""
