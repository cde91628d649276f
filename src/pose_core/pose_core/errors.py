"""Errors that a user can mend: each says what was found, what was expected, what to do."""


class PoseError(Exception):
    """Anything the user can mend; the message is one complete line."""


class ParameterError(PoseError):
    """A parameter is unknown, of the wrong type or outside its range."""


class InputError(PoseError):
    """A file, a device or a stream is missing or not what it should be."""


def one_line(error: BaseException) -> str:
    """What a foreign error says first, or its kind if it says nothing."""
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__
