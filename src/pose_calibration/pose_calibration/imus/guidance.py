"""Instructions to the person during the calibration of the IMUs."""

MOVES = {
    "thigh": "lift the {side}knee to the front, then the leg to the side",
    "shank": "lift the {side}knee, and kick the heel back",
    "foot": "lift the {side}foot, and turn the toes out",
    "upper_arm": "raise the {side}arm to the front, then to the side",
    "forearm": "raise the {side}arm and bend the elbow",
    "hand": "raise the {side}arm and wave",
    "torso": "lean forward, then turn to both sides",
    "pelvis": "bow forward from the hips, then turn to both sides",
    "head": "nod, then look to both sides",
}


def how_to_move(segment: str) -> str:
    """Instruction for a movement that excites a segment's sensor."""
    side, _, part = segment.partition("_")
    if side not in ("left", "right"):
        side, part = "", segment
    return MOVES[part].format(side=f"{side} " if side else "")
