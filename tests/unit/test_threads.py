"""Work in threads: results in order, and errors of the work."""

import numpy as np
import pytest
from numba import get_num_threads, njit, set_num_threads

from gradedesign.common.system.threads import AHEAD, in_ranges, in_threads


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


@njit(nogil=True)
def count_up(low, high, step, times):
    for k in range(low, high):
        times[k] += step


@pytest.mark.parametrize("numbers", [range(0), range(1), range(7, 8), range(3, 1000, 64)])
def test_every_number_of_a_range_is_done_once(numbers):
    times = np.zeros(1000, np.int64)
    in_ranges(count_up, numbers, 3, times)
    inside = np.zeros(1000, np.int64)
    inside[numbers.start : numbers.stop] = 3
    np.testing.assert_array_equal(times, inside)


@pytest.mark.parametrize(("threads", "parts"), [(1, 1), (2, 2)])
def test_a_range_is_cut_at_its_steps_into_as_many_parts_as_threads(threads, parts):
    parts = min(parts, get_num_threads())
    seen = []
    before = get_num_threads()
    set_num_threads(min(threads, before))
    try:
        in_ranges(lambda low, high: seen.append((low, high)), range(5, 300, 64))
    finally:
        set_num_threads(before)
    assert sorted(seen) == [[(5, 300)], [(5, 133), (133, 300)]][parts - 1]


def test_a_range_is_not_cut_where_threads_do_not_pay():
    seen = []
    in_ranges(lambda low, high: seen.append((low, high)), range(100), threaded=False)
    assert seen == [(0, 100)]


@pytest.mark.parametrize("wrong", [0, 999])
def test_an_error_in_any_part_is_raised_once_all_have_ended(wrong):
    ended = []

    def work(low, high):
        if low <= wrong < high:
            raise ValueError("wrong")
        ended.append((low, high))

    with pytest.raises(ValueError, match="wrong"):
        in_ranges(work, range(1000))
    assert len(ended) == get_num_threads() - 1
