"""Two filter states, array by array."""

import numpy as np


def arrays_of(state):
    """All arrays of a state, by name."""
    groups = {name: getattr(state, name)._asdict() for name in ("pose", "views", "imus", "shared")}
    named = {f"{group}.{name}": a for group, of in groups.items() for name, a in of.items()}
    return {"P": state.P, "foot_height": state.foot_height, **named}


def assert_equal_states(fast, plain):
    """Both states agree within 1e-9."""
    expected = arrays_of(plain)
    for name, actual in arrays_of(fast).items():
        np.testing.assert_allclose(actual, expected[name], rtol=1e-9, atol=1e-9, err_msg=name)
