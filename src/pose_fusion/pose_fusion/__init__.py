"""One person's joint angles from skeleton streams and body-worn IMUs."""
