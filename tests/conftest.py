"""One thread for the many tiny systems, and no deadlines: a busy machine is no failure."""

from __future__ import annotations

import numpy  # noqa: F401, ICN001  a limit reaches only libraries that are loaded
import scipy.linalg  # noqa: F401
from hypothesis import settings
from threadpoolctl import threadpool_limits

threadpool_limits(limits=1)
settings.register_profile("tests", deadline=None)
settings.load_profile("tests")
