"""Where the sensors stand, and how their clocks differ: li2020 (1)."""
