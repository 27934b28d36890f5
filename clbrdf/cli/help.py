"""Help as it is printed: sentences flow to the width of the terminal, however the docstring breaks them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cyclopts.help import HelpPanel
    from rich.console import Console, ConsoleOptions


class FlowingHelp:
    """The usual help, its texts joined into paragraphs. What it needs is loaded where help is asked for."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Print a panel of commands, arguments or options."""
        from cyclopts.help import DefaultFormatter

        for entry in panel.entries:
            _flow(entry.description)
        DefaultFormatter()(console, options, panel)

    def render_usage(self, console: Console, options: ConsoleOptions, usage: Any) -> None:
        """Print the line that begins with Usage."""
        from cyclopts.help import DefaultFormatter

        DefaultFormatter().render_usage(console, options, usage)

    def render_description(self, console: Console, options: ConsoleOptions, description: Any) -> None:
        """Print what stands above the panels."""
        from cyclopts.help import DefaultFormatter

        _flow(description)
        DefaultFormatter().render_description(console, options, description)


def joined(text: str) -> str:
    """Return a text whose lines are paragraphs: a line ends at an empty one, or where ';' or ':' ends it."""
    return re.sub(r"(?<![\n;:])\n(?!\n)", " ", text)


def _flow(description: Any) -> None:
    from cyclopts.help import InlineText
    from rich.text import Text

    if isinstance(description, InlineText) and isinstance(description.primary_renderable, Text):
        description.primary_renderable = Text(joined(description.primary_renderable.plain))
