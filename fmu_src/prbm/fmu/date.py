"""The date that an FMU carries."""

import os
from datetime import UTC, datetime

EPOCH = datetime(1980, 1, 1, tzinfo=UTC)  # the one of the archive


def date() -> str:
    """Return the date of generation: that of SOURCE_DATE_EPOCH, else the archive's own, 1980.

    It may not be the time of the build, because the same input is to give the same bytes.

    Raises
    ------
    ValueError
        If SOURCE_DATE_EPOCH is no time.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    try:
        moment = datetime.fromtimestamp(int(epoch), UTC) if epoch else EPOCH
    except (ValueError, OverflowError, OSError):
        raise ValueError(
            f"the environment variable SOURCE_DATE_EPOCH = {epoch[:30]!r} must be a number of "
            "seconds since 1970, before the year 10000; unset it for a date that is always the same"
        ) from None
    return moment.isoformat().replace("+00:00", "Z")
