"""Threads that work on several items at a time, each item with a value of its own, such as a process, and what they make alone."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, CancelledError, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack
from functools import cache
from queue import SimpleQueue

# Files in caches and filters of warnings are those of the process: what uses them is made by one thread at a time.
_MAKING = threading.RLock()


def made_once[T](make: Callable[[], T]) -> Callable[[], T]:
    """A function that returns the result of ``make``, called when it is first needed, while no other thread makes anything."""

    @cache
    def made() -> T:
        with _MAKING:
            return make()

    return made


def in_threads[T, R, A](
    work: Callable[[T, A], R],
    items: Sequence[T],
    contexts: Sequence[Callable[[], AbstractContextManager[A]]],
    ending: Callable[[], object] = lambda: None,
) -> tuple[R, ...]:
    """The results of ``work`` on the ``items``, in their order, on as many at a time as there are ``contexts``, each with the value
    of a context that no other uses. The contexts are closed even after an error or an interrupt: before that ``ending`` is called,
    and no more work begins. The first error of ``work`` is raised.
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
