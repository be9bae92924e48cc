"""The errors of this package, all derived from :class:`Error`. A message says what was expected, what came and what to
do."""


class Error(Exception):
    """Base class of all errors that this package raises."""


class ArgumentError(Error, ValueError):
    """An argument has an invalid value."""


class ArgumentTypeError(Error, TypeError):
    """An argument has an invalid type."""


class OrderError(Error, RuntimeError):
    """A call came at the wrong time: before a reset, after an episode's end, in the middle of a step."""


class ClosedError(OrderError):
    """A call came after ``close()``."""


class MissingError(Error, ImportError):
    """A package that is needed is not installed."""
