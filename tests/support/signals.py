"""Signals of processes that tests start."""

import signal


def interruptible() -> None:
    """Reset SIGINT, which a background shell ignores, in a child process before it starts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
