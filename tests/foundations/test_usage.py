"""Memory and processor time of processes."""

import os
import subprocess
import time

import numpy as np

from fem_reference.foundations import usage
from fem_reference.foundations.subprocesses import command


def test_the_peak_is_that_since_it_was_forgotten() -> None:
    before = usage.peak_memory()
    block = np.ones(2**24)  # 128 MiB
    assert usage.peak_memory() > before + 50 or before > 500  # it may have been there
    del block
    usage.forget_peak_memory()
    assert usage.peak_memory() > 0


def test_processor_time_is_of_a_process_and_its_descendants() -> None:
    code = "import time\nend = time.process_time() + 0.2\nwhile time.process_time() < end: pass\nprint(flush=True)\ninput()"
    with subprocess.Popen(command("-c", code), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        found = usage.processor_times(os.getpid())
        assert {os.getpid(), process.pid} <= set(found)
        assert 0.15 < found[process.pid] < 60
        process.communicate(b"\n")
    time.sleep(0.05)
    assert process.pid not in usage.processor_times(os.getpid())
    assert usage.processor_times(2**30) == {}
