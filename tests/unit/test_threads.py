"""Work in threads: results in order, and errors of the work."""

import pytest
from numba import get_num_threads

from gradedesign.common.system.threads import AHEAD, in_threads


def test_results_come_in_the_order_of_the_items():
    assert list(in_threads(lambda n: n * n, range(50))) == [n * n for n in range(50)]


def test_an_error_of_the_work_is_raised_and_what_waits_is_left():
    done = []

    def work(n):
        done.append(n)
        if n == 3:
            raise ValueError("three")
        return n

    results = in_threads(work, range(10_000))
    with pytest.raises(ValueError, match="three"):
        list(results)
    assert len(done) <= 4 + AHEAD * get_num_threads()


def test_few_results_wait_to_be_taken():
    begun = []
    results = in_threads(lambda n: begun.append(n) or n, range(1000))
    for taken, result in enumerate(results, 1):
        assert result == taken - 1
        assert len(begun) <= taken + AHEAD * get_num_threads()
    assert len(begun) == 1000
