from __future__ import annotations

import os

# Thousands of small solutions: spinning threads that share busy cores make them several times slower.
os.environ.setdefault("MKL_NUM_THREADS", "1")
