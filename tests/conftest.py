"""What holds for every test: nothing is left in the user's cache, and workers of pytest-xdist share the cores.

Kernels stay in Taichi's own cache, which is locked while it is written: what one worker has compiled the others load.
"""

from __future__ import annotations

import os

import pytest

if "PYTEST_XDIST_WORKER" in os.environ:  # one thread for each worker, where a test does not ask for another number
    os.environ |= {"TI_CPU_MAX_NUM_THREADS": "1", "TI_LOG_LEVEL": "error"}


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory):
    """Speeds of the runs of this session."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TAICHI_SPH_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
