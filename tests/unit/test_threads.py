"""Work in threads: results in order, and errors of the work."""

from threading import Event

import pytest

from gradedesign.workspace.threads import in_threads


def test_results_come_in_the_order_of_the_items():
    assert list(in_threads(lambda n: n * n, range(50))) == [n * n for n in range(50)]


def test_an_error_of_the_work_is_raised_and_what_waits_is_left():
    done, never = [], Event()

    def work(n):
        done.append(n)
        if n == 3:
            raise ValueError("three")
        if n > 3:
            never.wait(0.01)  # All of them would take longer than any stop of this thread.
        return n

    results = in_threads(work, range(10_000))
    with pytest.raises(ValueError, match="three"):
        list(results)
    assert len(done) < 10_000
