"""What can go wrong, as a user would name it. Every message is one line and says what to do."""


class RollcliError(Exception):
    """Base of every error that rollcli raises on purpose."""


class UsageError(RollcliError):
    """The request contradicts itself or names what is not there (exit status 2)."""


class InputError(RollcliError):
    """A file cannot be read as what it should be; costs that frame, not the batch."""


class EstimationError(RollcliError):
    """The pixels do not determine a roll angle; costs that frame, not the batch."""


class ClusterError(RollcliError):
    """The cluster cannot do the work (exit status 1)."""


class WorkerError(RollcliError):
    """Worker processes cannot be started (exit status 1)."""


class OutputError(RollcliError):
    """A result cannot be written: the program cannot do its job (exit status 1)."""
