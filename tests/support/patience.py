"""How long tests wait for what happens in its own time, on a slow and busy machine too."""

PATIENCE_S = 120.0  # [s] what comes sooner is not waited for
