"""Work in threads: results in order, as many at a time as there are contexts, and an end without waiting after an error."""

import threading
import time
from contextlib import contextmanager, nullcontext

import pytest

from fem_reference.foundations import threads
from fem_reference.foundations.threads import in_threads, made_once


@contextmanager
def named(name: str, closed: list[str]):
    try:
        yield name
    finally:
        closed.append(name)


def contexts(names: str, closed: list[str]):
    return [lambda name=name: named(name, closed) for name in names]


def test_results_are_in_order_and_each_context_serves_one_item_at_a_time() -> None:
    """The first two meet at a barrier, so they run at the same time; with one context it would break."""
    barrier, busy, closed = threading.Barrier(2, timeout=10), dict.fromkeys("ab", 0), list[str]()

    def work(item: int, own: str) -> int:
        busy[own] += 1
        assert busy[own] == 1
        if item < 2:
            barrier.wait()
        busy[own] -= 1
        return 10 * item

    assert in_threads(work, range(6), contexts("ab", closed)) == (0, 10, 20, 30, 40, 50)
    assert closed == ["b", "a"]
    assert in_threads(work, [], contexts("a", closed)) == ()


def test_after_an_error_no_more_work_begins_and_contexts_close(monkeypatch) -> None:
    """Also in the time that it takes until the calling thread hears of it."""
    wait = threads.wait
    monkeypatch.setattr(threads, "wait", lambda *found, **until: (wait(*found, **until), time.sleep(0.1))[0])
    begun, closed, ended = list[int](), list[str](), list[bool]()

    def work(item: int, _: str) -> None:
        begun.append(item)
        raise LookupError(f"item {item}")

    with pytest.raises(LookupError, match="item 0"):
        in_threads(work, range(5), contexts("a", closed), lambda: ended.append(not closed))
    assert begun == [0]
    assert closed == ["a"]
    assert ended == [True]


def test_an_error_ends_what_waits_for_another_context() -> None:
    """The second item waits for an event that only closing sets, as work waits for a process that closing ends."""
    closing, waiting = threading.Event(), threading.Event()

    @contextmanager
    def until_closed():
        try:
            yield
        finally:
            closing.set()

    def work(item: int, _: None) -> None:
        if item == 0:
            assert waiting.wait(10)
            raise LookupError("first")
        waiting.set()
        assert closing.wait(10)

    with pytest.raises(LookupError, match="first"):
        in_threads(work, range(2), [until_closed, until_closed])
    assert closing.is_set()


def test_what_is_made_once_is_made_by_one_thread_at_a_time() -> None:
    """The second begins only once the first has ended; one may need another."""
    making = list[str]()

    def make(name: str) -> str:
        making.append(f"{name} begins")
        time.sleep(0.05)
        making.append(f"{name} ends")
        return name

    parts = {name: made_once(lambda name=name: make(name)) for name in "ab"}
    whole = made_once(lambda: parts["a"]() + make("c"))
    assert in_threads(lambda one, _: one(), [whole, parts["b"]], 2 * [nullcontext]) == ("ac", "b")
    assert [line.split()[0] for line in making[::2]] == [line.split()[0] for line in making[1::2]]
    assert parts["a"]() == "a"
    assert len(making) == 6


def test_a_thread_that_waited_for_another_gets_the_same_result() -> None:
    """Both ask before the result exists, so a cache that is read before the lock would compute it twice."""
    both, made = threading.Barrier(2, timeout=10), list[object]()

    def make() -> object:
        time.sleep(0.05)
        made.append(object())
        return made[-1]

    once = made_once(make)
    one, other = in_threads(lambda _, __: (both.wait(), once())[1], range(2), 2 * [nullcontext])
    assert one is other is once() is made[0]
    assert len(made) == 1
