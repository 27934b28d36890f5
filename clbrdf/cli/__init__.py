"""The command line: one module a command, loaded when the command is given."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from io import TextIOWrapper

from cyclopts import App, CycloptsError, MissingArgumentError, UnusedCliTokensError

from clbrdf import __version__
from clbrdf.cli.help import FlowingHelp
from clbrdf.errors import LONGEST, ON_COMMAND_LINE, ClbrdfError, shortened

COMMANDS = {
    "demo": "run the main job end to end",
    "import": "bring measured files of any known format into a scan",
    "formats": "list the formats that are read and written",
    "info": "show what is in a scan or fit, or follow a running measurement",
    "fit": "fit the model at every wavelength",
    "choose": "compare models and say which describes a scan",
    "batch": "fit many scans on all cores, or on a cluster",
    "models": "list the models, or show the page of one",
    "view": "show lobes in a window, a file or a browser",
    "report": "write a fit as one page",
    "export": "write a fit or a scan in other people's formats",
    "render": "picture a material on a sphere and a panel, by Mitsuba",
    "evaluate": "print model values as a table",
    "simulate": "simulate a scene with the instrument effects it asks for",
    "measure": "run a measurement plan on the rig",
    "align": "find angular zeros and tilt from the specular peak",
    "emulate": "run a rig of emulated instruments on pseudo-terminals",
    "calibrate": "calibrate the raw counts of a measured scan again",
    "budget": "print the error budget of an absolute BRDF",
    "bench": "measure here and now, beside peers",
    "devices": "list the OpenCL devices and the one chosen",
}
"""Each is `command` in the module clbrdf.cli.<name>_command, and tells its own help there."""

USAGE_ERROR = 2
INTERRUPTED = 130


def mend_streams() -> None:
    """Give closed standard streams an empty end; let those of few letters replace what they lack."""
    for name in ("stdin", "stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, TextIOWrapper) and name != "stdin":
            stream.reconfigure(errors="replace")


def make_app(chosen: str = "") -> App:
    """Return the command-line application; only the command chosen is loaded, and gives its own help."""
    app = App(
        name="clbrdf",
        help="From a measured scan to an absolute spectral BRDF, its model at every wavelength, and lobes.",
        version=__version__,
        help_format="plaintext",
        help_formatter=FlowingHelp(),
        suppress_keyboard_interrupt=False,
    )
    for name, summary in COMMANDS.items():
        told = {} if name == chosen else {"help": summary}
        app.command(f"clbrdf.cli.{name}_command:command", name=name, **told)
    app.register_install_completion_command(
        help="let the shell complete commands and options: bash, zsh or fish", result_action="return_value"
    )
    return app


def _missing(error: MissingArgumentError) -> str:
    """Return what to say where an argument that is needed was not given, or an option has no value."""
    if error.argument is None:
        return str(error)
    command = " ".join(("clbrdf", *(error.command_chain or ())))
    lack = f"{error.keyword} has no value" if error.keyword else f"{error.argument.name} is missing"
    return f"{lack}; '{command} --help' shows what the command takes"


def _told(error: CycloptsError) -> str:
    """Return an error of the command line in our words."""
    if isinstance(error, MissingArgumentError):
        return _missing(error)
    if isinstance(error, UnusedCliTokensError):
        command = " ".join(("clbrdf", *(error.command_chain or ())))
        there = ", ".join(error.unused_tokens or ())
        return f"{there}: more than '{command}' takes; '{command} --help' shows what it takes"
    return str(error)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status: 0, 1 for a bad verdict, 2 for an error, 130 for Ctrl-C."""
    words = list(sys.argv[1:] if argv is None else argv)
    mend_streams()
    reader = ON_COMMAND_LINE.set(True)
    try:
        status = make_app(*words[:1])(
            words, exit_on_error=False, print_error=False, result_action="return_value"
        )
        sys.stdout.flush()
    except (ClbrdfError, CycloptsError) as error:
        text = _told(error) if isinstance(error, CycloptsError) else str(error)
        text = shortened(" ".join(text.split()), LONGEST)
        print(f"clbrdf: {text}", file=sys.stderr)
        return USAGE_ERROR
    except KeyboardInterrupt:
        print("clbrdf: interrupted; nothing was left half-written", file=sys.stderr)
        return INTERRUPTED
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            # The reader (head, less) has gone: nothing more to say, also not at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        print(f"clbrdf: {error.filename or 'standard output'}: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return USAGE_ERROR
    finally:
        ON_COMMAND_LINE.reset(reader)
    return status if isinstance(status, int) else 0
