"""Threads that work on several items at a time, each with a resource such as a process, and functions that run only once."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, CancelledError, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack
from queue import SimpleQueue

# All threads of the process share cached files and warning filters, so functions that use them are run by one thread at a time.
_MAKING = threading.RLock()


def made_once[T](make: Callable[[], T]) -> Callable[[], T]:
    """Return a function that calls ``make`` when it is first called and returns that result from then on, in every thread. Only one
    thread at a time calls any ``make``.
    """
    results: list[T] = []

    def made() -> T:
        if not results:
            with _MAKING:
                if not results:  # another thread may have finished meanwhile
                    results.append(make())
        return results[0]

    return made


def in_threads[T, R, A](
    work: Callable[[T, A], R],
    items: Sequence[T],
    contexts: Sequence[Callable[[], AbstractContextManager[A]]],
    ending: Callable[[], object] = lambda: None,
) -> tuple[R, ...]:
    """Return the results of ``work`` on each of ``items``, in their order. ``work`` takes an item and the value of one of
    ``contexts``; as many items are worked on at a time as there are contexts, and no two of them share a context.

    The contexts are closed even after an error or an interrupt; before that, ``ending`` is called, and no further work begins. The
    first error of ``work`` is raised.
    """
    free, errors = SimpleQueue[A](), list[BaseException]()

    def on(item: T) -> R:
        if errors:
            raise CancelledError
        value = free.get()
        try:
            return work(item, value)
        except BaseException as error:
            errors.append(error)
            raise
        finally:
            free.put(value)

    with ThreadPoolExecutor(max(len(contexts), 1)) as pool, ExitStack() as stack:
        for context in contexts:
            free.put(stack.enter_context(context()))
        stack.callback(pool.shutdown, wait=False, cancel_futures=True)
        stack.callback(ending)
        found = [pool.submit(on, item) for item in items]
        wait(found, return_when=FIRST_EXCEPTION)
        if errors:
            raise errors[0]
    return tuple(future.result() for future in found)
