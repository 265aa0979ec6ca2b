"""Ctrl-C ends the work, whatever becomes of the exception on its way."""

import os
import signal
import threading

import pytest

from vibrojax.cli.interrupt import interruptible


def press(number: signal.Signals = signal.SIGINT) -> None:
    """Ctrl-C, or what a batch system sends."""
    os.kill(os.getpid(), number)


@pytest.fixture(autouse=True)
def handler_restored():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_interrupts_at_once(number):
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), interruptible():
        press(number)
        pytest.fail("went on")
    assert signal.getsignal(number) is before


def test_an_import_that_turns_it_into_another_error_is_seen_through():
    with pytest.raises(KeyboardInterrupt), interruptible():
        try:
            press()
        except KeyboardInterrupt as error:
            raise ImportError("multiarray failed to import") from error


def test_other_errors_stay_what_they_are():
    with pytest.raises(ImportError, match="absent"), interruptible():
        raise ImportError("absent")


def test_one_that_was_swallowed_ends_the_work_at_the_next_stage():
    said = []
    with pytest.raises(KeyboardInterrupt), interruptible() as interruption:
        say = interruption.watched(said.append)
        say("first")
        try:
            press()
        except KeyboardInterrupt:
            pass
        say("second")
    assert said == ["first"]


def test_a_deferring_block_ends_first_and_a_second_one_does_not_wait():
    done = []
    with pytest.raises(KeyboardInterrupt), interruptible() as interruption, interruption.deferred():
        press()
        done.append("all of it")
    with pytest.raises(KeyboardInterrupt), interruptible() as interruption, interruption.deferred():
        press()
        press()
        done.append("never")
    assert done == ["all of it"]


def test_where_signals_cannot_be_handled_nothing_is_changed():
    seen = []

    def work() -> None:
        with interruptible() as interruption:
            interruption.check()
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


def test_an_ignored_ctrl_c_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interruptible() as interruption:
        press()
        interruption.check()
    signal.signal(signal.SIGINT, before)
