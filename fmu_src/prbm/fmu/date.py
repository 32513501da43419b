"""The generation date in a model description."""

import os
from datetime import UTC, datetime

from ..base.errors import ParameterError

EPOCH = datetime(1980, 1, 1, tzinfo=UTC)  # Same as the time of the files in the archive.


def date() -> str:
    """Return the generation date in ISO 8601: SOURCE_DATE_EPOCH if set, else 1980-01-01.

    The time of the build is not used, so that equal inputs give equal bytes.

    Raises
    ------
    ParameterError
        If SOURCE_DATE_EPOCH is not a number of seconds or is out of range.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    try:
        moment = datetime.fromtimestamp(int(epoch), UTC) if epoch else EPOCH
    except (ValueError, OverflowError, OSError):
        raise ParameterError(
            f"the environment variable SOURCE_DATE_EPOCH = {epoch[:30]!r} must be a number of "
            "seconds since 1970, before the year 10000; unset it to date FMUs 1980-01-01"
        ) from None
    return moment.isoformat().replace("+00:00", "Z")
