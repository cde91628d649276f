"""How long tests wait for what happens in its own time, on a slow and busy machine too."""

PATIENCE_S = 240.0  # [s] what comes sooner is not waited for; kernels may have to be compiled
