"""How every command ends: with its answer, or with one sentence and a status other than 0."""

import importlib
import os
import signal
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from intent_perception.basics.late_module import remedy


def command(module: str, *arguments: Any) -> NoReturn:
    """Run the function `main` of a module as a command, with arguments, and leave the program.

    The module is imported here, so that Ctrl-C and SIGTERM end a command quietly from its first
    moment on. Statuses: 130 and 143 after these signals, 1 after an error that `main` did not
    answer itself. After a signal, and wherever ROS runs, the program leaves without Python's
    clean-up: threads of the middleware and of compiled libraries still run, and now and then
    crash in it or wait for each other for ever.
    """
    signal.signal(signal.SIGTERM, _terminated)
    run_as = sys.modules["__main__"].__spec__  # python -m
    name = run_as.name.rsplit(".", 1)[-1] if run_as is not None else Path(sys.argv[0]).stem
    if run_as is not None:
        sys.argv[0] = f"python -m {run_as.name}"  # what --help calls the command
    try:
        status = importlib.import_module(module).main(*arguments)
        sys.stdout.flush()
    except (_Terminated, KeyboardInterrupt) as end:
        _leave(143 if isinstance(end, _Terminated) else 130)
    except BrokenPipeError:  # whoever read the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _leave(141)
    except (MemoryError, ModuleNotFoundError, ValueError, OSError) as error:
        print(f"{name}: {_sentence(error)}", file=sys.stderr)
        _leave(1)
    except SystemExit as end:
        status = _status(end)
    except Exception:
        if "rclpy" not in sys.modules:
            raise
        traceback.print_exc()
        status = 1
    if "rclpy" in sys.modules:
        _leave(status or 0)
    raise SystemExit(status)


def _status(end: SystemExit) -> int | None:
    """Return the status of an end; its words, if it has some, are said as Python says them."""
    if end.code is None or isinstance(end.code, int):
        return end.code
    print(end.code, file=sys.stderr)
    return 1


def _sentence(error: Exception) -> str:
    """Return what a user is told of an error."""
    if isinstance(error, MemoryError):
        return "the machine's memory does not suffice"
    if isinstance(error, ModuleNotFoundError):
        return remedy(error)
    return " ".join(str(error).split())


class _Terminated(SystemExit):
    """What SIGTERM ends a program with."""


def _terminated(*_: Any) -> NoReturn:
    raise _Terminated(143)


def _leave(status: int) -> NoReturn:
    """End at once: a second signal must not meet Python in its clean-up."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)
