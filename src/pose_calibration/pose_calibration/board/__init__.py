"""Where cameras stand, from images of a board that they see at the same time: li2020 (1)."""
