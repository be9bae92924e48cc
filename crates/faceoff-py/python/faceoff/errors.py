"""What goes wrong. Every error of this package is an :class:`Error`; its message says what was expected, what came and
what to do."""


class Error(Exception):
    """Anything that this package refuses, or fails at."""


class ArgumentError(Error, ValueError):
    """An argument has a value that it cannot have."""


class ArgumentTypeError(Error, TypeError):
    """An argument is of a type that it cannot be of."""


class OrderError(Error, RuntimeError):
    """A call came at the wrong time: before a reset, after an episode's end, in the middle of a step."""


class ClosedError(OrderError):
    """A call came after ``close()``."""


class MissingError(Error, ImportError):
    """Something that is not installed is needed."""
