"""The array type of all continuous quantities."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
