"""Clock offset and vertical from body-worn IMUs."""
